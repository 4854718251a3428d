//! What a page shows, beside what it carries.

use super::differences::Difference;
use super::inside::around;

/// So much of two pages is told from where they part (characters), and so much before that.
const TOLD: usize = 60;
const BEFORE: usize = 20;

/// The first place where a page shows something else than one that is written now, whatever both carry.
pub(crate) fn shown_otherwise(page: &str, now: &str) -> Option<Difference> {
    // A mail that went by another system ends its lines otherwise.
    let page = page.replace("\r\n", "\n");
    let [page, now] = [&page, now].map(|text| around(text.trim_end()).concat());
    if page == now {
        return None;
    }
    let same = page.bytes().zip(now.bytes()).take_while(|(a, b)| a == b);
    let mut at = same.count();
    while !(page.is_char_boundary(at) && now.is_char_boundary(at)) {
        at -= 1;
    }
    let line = 1 + page[..at].matches('\n').count();
    let [page, now] = [page, now].map(|text| excerpt(&text, at));
    Some(Difference::new(
        format!("what it shows, line {line}"),
        page.into(),
        now.into(),
    ))
}

/// A line's text around a place.
fn excerpt(text: &str, at: usize) -> String {
    let before = text[..at].chars().rev().take_while(|c| *c != '\n');
    let before: Vec<char> = before.take(BEFORE).collect();
    let after = text[at..].chars().take_while(|c| *c != '\n').take(TOLD);
    before.into_iter().rev().chain(after).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_shows_something_else_is_told_with_the_place() {
        let page = |error: &str| format!("<html>\n<p>Error µ {error} um rms</p>\n</html>\n");
        let now = page("0.520");
        assert_eq!(shown_otherwise(&now, &now), None);
        assert_eq!(shown_otherwise(&now.replace('\n', "\r\n"), &now), None);
        let other = shown_otherwise(&page("0.320"), &now).expect("another number");
        assert_eq!(
            other.to_string(),
            "what it shows, line 2: \"<p>Error µ 0.320 um rms</p>\" in the page, \"<p>Error µ 0.520 um rms</p>\" now"
        );
        assert!(!other.is_rounding());
        for other in ["", "<html>", &page("µ"), &format!("{now}<p>")] {
            assert!(shown_otherwise(other, &now).is_some(), "{other}");
        }
    }
}
