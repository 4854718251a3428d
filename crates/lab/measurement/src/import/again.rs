//! Headings that stand again below a table's first rows.

use std::borrow::Cow;

use super::error::ImportError;
use super::header;

/// What is to be told of numbered lines without numbers below the first row of a table: headings that repeat a line above it
/// are passed over, as those of a new page.
///
/// # Errors
/// Where there are other headings: what follows is another table, which these columns are not those of.
pub(super) fn headings<'l>(
    lines: impl Iterator<Item = (usize, Vec<Cow<'l, str>>)>,
    above: &[Vec<Cow<'l, str>>],
) -> Result<Option<String>, ImportError> {
    let mut repeated = Vec::new();
    for (number, cells) in lines.filter(|(_, cells)| header::is_one(cells)) {
        if !above.contains(&cells) {
            return Err(others(number, &cells));
        }
        repeated.push(number);
    }
    let Some(first) = repeated.first() else {
        return Ok(None);
    };
    let lines = match repeated.len() {
        1 => format!("line {first}, which repeats"),
        lines => format!("{lines} lines, the first in line {first}, which repeat"),
    };
    Ok(Some(format!(
        "{lines} the headings, {} passed over",
        if repeated.len() == 1 { "is" } else { "are" }
    )))
}

fn others(number: usize, cells: &[Cow<'_, str>]) -> ImportError {
    let filled = cells.iter().filter(|cell| !cell.is_empty());
    let words: Vec<&str> = filled.map(AsRef::as_ref).collect();
    ImportError::new(
        format!(
            "line {number} has other headings than the table above it: {}",
            words.join(", ")
        ),
        format!(
            "a file holds one table: put what stands from line {number} on into a file of its own, or delete the table that is not \
             meant; several files of one mirror are one session"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::super::Table;

    fn read(text: &str) -> Result<Table, String> {
        Table::read(text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_second_table_below_is_refused() {
        for below in [
            "t (s),V2 (V),z (um)",
            "t (s),V1 (V),z (mm)",
            "t (s),z (um),V1 (V)",
            "z (um),t (s)",
        ] {
            let text =
                format!("t (s),V1 (V),z (um)\n0,0,0\n1,1,26\n\nRun 2,,\n{below}\n2,0,0\n3,1,26\n");
            let refused = read(&text).expect_err(below);
            assert!(refused.contains("line 6 has other headings"), "{refused}");
        }
    }

    #[test]
    fn headings_of_a_new_page_are_passed_over_and_told() {
        let heads = "Time,V,z\ns,V,um\n";
        let table =
            read(&format!("{heads}0,0,0\n1,1,26\n{heads}2,2,90\nend,,\n")).expect("a table");
        let told = &table.told;
        assert!(
            told.iter()
                .any(|(_, said)| said.starts_with("2 lines, the first in line 5")),
            "{told:?}"
        );
        assert_eq!(table.names, ["Time (s)", "V (V)", "z (um)"]);
    }
}
