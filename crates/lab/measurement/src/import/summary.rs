//! Rows of a table that sum others up: means, spreads, extremes.

use super::quantity;
use super::style::Style;

/// What people and spreadsheets call them, in lower case, with `_` between words.
const NAMES: [&str; 30] = [
    "mean",
    "means",
    "average",
    "avg",
    "mittel",
    "mittelwert",
    "durchschnitt",
    "median",
    "std",
    "std_dev",
    "stdev",
    "stddev",
    "sd",
    "standardabweichung",
    "stabw",
    "σ",
    "rms",
    "var",
    "variance",
    "varianz",
    "min",
    "minimum",
    "max",
    "maximum",
    "sum",
    "summe",
    "total",
    "gesamt",
    "count",
    "anzahl",
];

/// Which of these numbered lines are such rows, where one of their names stands in a column of numbers or of nothing; and what is to be told
/// of them. In a column of other words it is a label.
pub(super) fn rows<'l>(
    style: Style,
    lines: impl Iterator<Item = (usize, &'l &'l str)> + Clone,
) -> (Vec<usize>, Option<String>) {
    let cell = |line: &str, column: usize| {
        let cells = style.cells(line).into_iter();
        cells.map(String::from).nth(column).unwrap_or_default()
    };
    let is_of_words = |column: usize| {
        let mut others = lines.clone().map(|(_, line)| cell(line, column));
        others.any(|cell| !(cell.is_empty() || is_name(&cell) || style.is_number(&cell)))
    };
    let named = |line: &str| {
        let cells = has_a_word(line).then(|| style.cells(line))?;
        cells.iter().position(|cell| is_name(cell))
    };
    let named: Vec<_> = lines
        .clone()
        .filter_map(|(number, line)| Some((number, *line, named(line)?)))
        .collect();
    let mut columns: Vec<usize> = named.iter().map(|&(.., column)| column).collect();
    columns.sort_unstable();
    columns.dedup();
    columns.retain(|&column| !is_of_words(column));
    let sums = named.iter().filter(|(.., column)| columns.contains(column));
    let numbers: Vec<usize> = sums.clone().map(|&(number, ..)| number).collect();
    let told = sums.clone().next().map(|&(number, line, column)| {
        let name = cell(line, column);
        match numbers.len() {
            1 => format!("'{name}' in line {number} sums other rows up, and is left out"),
            rows => format!("{rows} rows that sum others up are left out, '{name}' in line {number} is the first"),
        }
    });
    (numbers, told)
}

/// Whether any letter is no number's exponent: most lines of a million have no word, and are not split once more.
fn has_a_word(line: &str) -> bool {
    let mut before = ' ';
    line.chars().any(|letter| {
        let is_of_a_number = before.is_ascii_digit() || before == '.';
        before = letter;
        letter.is_alphabetic() && !is_of_a_number
    })
}

fn is_name(cell: &str) -> bool {
    NAMES.contains(&quantity::key(cell.trim_end_matches([':', '.'])).as_str())
}

#[cfg(test)]
mod tests {
    use super::super::Table;

    #[test]
    fn rows_that_sum_others_up_are_left_out_and_counted() {
        for (index, sums) in [
            ("n", "Mittel;1,5;40\nStd:;1,3;50\n"),
            ("", "Mean;1,5;40\nMax;2;90\n"),
        ] {
            let row = |n: usize| {
                format!(
                    "{};{n},5;{}\n",
                    if index.is_empty() {
                        String::new()
                    } else {
                        n.to_string()
                    },
                    18 * n
                )
            };
            let rows: String = (0..5).map(row).collect();
            let table = Table::read(format!("{index};V (V);z (um)\n{rows}{sums}").as_bytes())
                .expect("a table");
            assert_eq!(table.rows.len(), 5, "{sums}");
            assert!(
                table
                    .told
                    .iter()
                    .any(|(_, said)| said.starts_with("2 rows that sum others up")),
                "{:?}",
                table.told
            );
        }
    }

    #[test]
    fn a_label_is_no_sum() {
        let text = "where;V (V);z (um)\nstart;0;0\nup;1;18\nmax;2;62\n";
        assert_eq!(Table::read(text.as_bytes()).expect("a table").rows.len(), 3);
    }
}
