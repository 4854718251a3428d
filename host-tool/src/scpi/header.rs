//! Headers: a pattern as `[SOURce:]POSition?` stands for all the ways in which a header may be typed.

/// A node of a pattern.
struct Node<'a> {
    /// In capitals what must be typed: `POSition` may be `POS`.
    mnemonic: &'a str,
    /// In brackets.
    is_optional: bool,
}

impl Node<'_> {
    /// Long or short form and nothing in between, in capitals or not (SCPI-1999, 6.2.1).
    fn is(&self, typed: &str) -> bool {
        let is_short = |character: &char| !character.is_ascii_lowercase();
        let short: String = self.mnemonic.chars().filter(is_short).collect();
        typed.eq_ignore_ascii_case(self.mnemonic) || typed.eq_ignore_ascii_case(&short)
    }
}

/// Whether a header as typed, without a colon in front of it, is one that `pattern` stands for.
pub(crate) fn matches(pattern: &str, typed: &str) -> bool {
    if pattern.ends_with('?') != typed.ends_with('?') {
        return false;
    }
    let words: Vec<&str> = typed.trim_end_matches('?').split(':').collect();
    fit(&nodes(pattern.trim_end_matches('?')), &words)
}

fn nodes(pattern: &str) -> Vec<Node<'_>> {
    let node = |piece| {
        let mnemonic = str::trim_matches(piece, ['[', ']']);
        let is_opened = piece.trim_start_matches(']').starts_with('[');
        let is_optional = is_opened || piece.trim_end_matches('[').ends_with(']');
        Node {
            mnemonic,
            is_optional,
        }
    };
    let nodes = pattern.split(':').map(node);
    nodes.filter(|node| !node.mnemonic.is_empty()).collect()
}

fn fit(nodes: &[Node], words: &[&str]) -> bool {
    let Some((node, later)) = nodes.split_first() else {
        return words.is_empty();
    };
    let is_here = words
        .split_first()
        .is_some_and(|(word, rest)| node.is(word) && fit(later, rest));
    is_here || node.is_optional && fit(later, words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn long_and_short_forms_in_any_case_and_nothing_in_between() {
        let pattern = "[SOURce:]POSition[:LEVel][:IMMediate]?";
        for typed in [
            "SOURce:POSition?",
            "sour:pos?",
            "POS?",
            "position:level?",
            "Pos:Imm?",
            "SOUR:POS:LEV:IMM?",
        ] {
            assert!(matches(pattern, typed), "{typed}");
        }
        for typed in [
            "POS",
            "POSI?",
            "SOUR?",
            "POS:POS?",
            "SOUR::POS?",
            ":POS?",
            "",
            "?",
            "POS:IMM:LEV?",
            "POS??x",
        ] {
            assert!(!matches(pattern, typed), "{typed}");
        }
        assert!(matches("*IDN?", "*idn?"));
        assert!(!matches("*IDN?", "*IDN"));
    }

    proptest! {
        #[test]
        fn any_form_of_a_pattern_is_one_and_any_text_ends(
            forms in proptest::collection::vec((any::<bool>(), any::<bool>()), 3),
            text in ".{0,40}",
        ) {
            let pattern = "STATus:QUEStionable[:EVENt]?";
            let words = [("STATus", "STAT"), ("QUEStionable", "QUES"), ("EVENt", "EVEN")];
            let typed: Vec<String> = words
                .iter()
                .zip(&forms)
                .map(|((long, short), (is_long, is_low))| {
                    let word = if *is_long { long } else { short };
                    if *is_low { word.to_lowercase() } else { word.to_uppercase() }
                })
                .collect();
            let whole = typed.join(":") + "?";
            let without = typed[..2].join(":") + "?";
            prop_assert!(matches(pattern, &whole));
            prop_assert!(matches(pattern, &without));
            let _ = matches(pattern, &text);
        }
    }
}
