//! Which columns of a LibreOffice sheet hold percent: of such cells the spreadsheet's reader tells no more than a number.

use std::collections::HashSet;
use std::io::{Cursor, Read};

use zip::ZipArchive;

/// The most of a file's content that is read (bytes), as of a table.
const MOST: u64 = 200 * input_file::MB;
/// More columns than a spreadsheet has (OpenDocument 1.3 states none; LibreOffice has 16 384).
const MOST_COLUMNS: u32 = 16_384;

/// The columns, from 0, of a sheet of this place in a file; none of files of other kinds.
pub(super) fn columns(file: &[u8], sheet: usize) -> HashSet<u32> {
    content(file).map_or_else(HashSet::new, |content| of_content(&content, sheet))
}

/// Where OpenDocument has its cells (part 2, 3.1).
fn content(file: &[u8]) -> Option<String> {
    let mut archive = ZipArchive::new(Cursor::new(file)).ok()?;
    let member = archive.by_name("content.xml").ok()?;
    let mut content = String::new();
    member.take(MOST).read_to_string(&mut content).ok()?;
    Some(content)
}

fn of_content(content: &str, sheet: usize) -> HashSet<u32> {
    let table = content.split("<table:table ").nth(sheet + 1);
    let rows = table.into_iter().flat_map(|table| {
        let table = table.split("</table:table>").next().unwrap_or_default();
        table.split("<table:table-row").skip(1)
    });
    let mut found = HashSet::new();
    for row in rows {
        let mut column = 0_u32;
        for tag in row.split('<').filter(|tag| is_cell(tag)) {
            let repeated = attribute(tag, "table:number-columns-repeated");
            let repeated = repeated.and_then(|times| times.parse().ok()).unwrap_or(1);
            let end = column.saturating_add(repeated).min(MOST_COLUMNS);
            if attribute(tag, "office:value-type") == Some("percentage") {
                found.extend(column..end);
            }
            column = end;
        }
    }
    found
}

fn is_cell(tag: &str) -> bool {
    let cells = ["table:table-cell", "table:covered-table-cell"];
    cells.iter().any(|cell| tag.starts_with(cell))
}

/// The value of a tag's attribute.
fn attribute<'t>(tag: &'t str, name: &str) -> Option<&'t str> {
    let (attributes, _) = tag.split_once('>')?;
    let (_, after) = attributes.split_once(&format!(" {name}=\""))?;
    Some(after.split_once('"')?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_with_a_cell_in_percent_are_found() {
        let row = "<table:table-row><table:table-cell table:number-columns-repeated=\"2\"/>\
            <table:table-cell table:number-columns-repeated=\"2\" office:value-type=\"percentage\" office:value=\"0.07\"><text:p>7%</text:p></table:table-cell>\
            <table:covered-table-cell/><table:table-cell office:value-type=\"percentage\" office:value=\"1\"/></table:table-row>";
        let content = format!(
            "<table:table table:name=\"A\"><table:table-row/></table:table><table:table table:name=\"B\">{row}</table:table>"
        );
        assert_eq!(of_content(&content, 1), HashSet::from([2, 3, 5]));
        for other in [0, 2] {
            assert!(of_content(&content, other).is_empty());
        }
    }
}
