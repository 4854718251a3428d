//! Spreadsheets: the first sheet that holds a table, one that is shown before one that is hidden.

use std::io::Cursor;
use std::panic;

use calamine::{Data, Range, Reader, SheetVisible, Sheets, open_workbook_auto_from_rs};
use measurement::import::{ImportError, Table};

/// Spreadsheets count in days.
const SECONDS_OF_A_DAY: f64 = 86_400.0;

/// The first sheet's table.
pub(super) fn table(bytes: &[u8]) -> Result<Table, ImportError> {
    // The reader panics at some spoilt files, as at a cell's name that is too long.
    panic::catch_unwind(|| first_table(bytes))
        .unwrap_or_else(|_| Err(not_one("it is damaged".to_owned())))
}

fn not_one(reason: String) -> ImportError {
    ImportError::new(
        format!("this is no spreadsheet that can be read: {reason}"),
        "save the sheet as CSV, and import that",
    )
}

fn first_table(bytes: &[u8]) -> Result<Table, ImportError> {
    let mut book: Sheets<_> = open_workbook_auto_from_rs(Cursor::new(bytes))
        .map_err(|error| not_one(error.to_string()))?;
    let mut sheets = book.sheets_metadata().to_vec();
    sheets.sort_by_key(|sheet| sheet.visible != SheetVisible::Visible);
    for sheet in &sheets {
        let Ok(cells) = book.worksheet_range(&sheet.name) else {
            continue;
        };
        let hidden = match sheet.visible {
            SheetVisible::Visible => "",
            _ => ", which is hidden",
        };
        let written = format!("the sheet '{}'{hidden}", sheet.name);
        let found = Table::find(text(&cells).as_bytes()).map_err(|error| error.within(&written))?;
        if let Some(mut table) = found {
            let others = match sheets.len() {
                1 => String::new(),
                sheets => format!(", of {sheets} sheets"),
            };
            table.written = written + &others;
            return Ok(table);
        }
    }
    let names: Vec<_> = sheets.iter().map(|sheet| sheet.name.as_str()).collect();
    let names = names.join(", ");
    Err(not_one(format!("no table of numbers is in {names}")))
}

/// A sheet as lines of cells between tabs, each line with the number of its row.
fn text(sheet: &Range<Data>) -> String {
    let line = |row: &[Data]| {
        let cells: Vec<String> = row.iter().map(cell).collect();
        cells.join("\t") + "\n"
    };
    let above = sheet.start().map_or(0, |(row, _)| row as usize);
    let lines = sheet.rows().map(line);
    "\n".repeat(above) + &lines.collect::<String>()
}

fn cell(data: &Data) -> String {
    match data {
        Data::DateTime(instant) if instant.is_datetime() => {
            let (year, month, day, hour, minute, second, milli) = instant.to_ymd_hms_milli();
            format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{milli:03}")
        }
        Data::DateTime(duration) => (duration.as_f64() * SECONDS_OF_A_DAY).to_string(),
        Data::Error(_) => String::new(),
        other => other.to_string().replace(['\t', '\n', '\r'], " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Write;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// A sheet of words, and one of these rows.
    fn workbook(rows: &str) -> Vec<u8> {
        let words = "<row r=\"1\"><c r=\"A1\" t=\"inlineStr\"><is><t>Set-up</t></is></c></row>";
        of_sheets("visible", words, rows)
    }

    /// The least that is a workbook (ECMA-376, part 1): two sheets, the first of which is in this state.
    fn of_sheets(state: &str, notes: &str, rows: &str) -> Vec<u8> {
        let sheet = |rows: &str| {
            format!(
                "<worksheet xmlns=\"http://schemas.openxmlformats.org/spreadsheetml/2006/main\"><sheetData>{rows}</sheetData></worksheet>"
            )
        };
        let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
        let relations = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
        let package = "http://schemas.openxmlformats.org/package/2006/relationships";
        let parts = [
            (
                "_rels/.rels",
                format!(
                    "<Relationships xmlns=\"{package}\"><Relationship Id=\"r1\" Type=\"{relations}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
                ),
            ),
            (
                "xl/workbook.xml",
                format!(
                    "<workbook xmlns=\"{main}\" xmlns:r=\"{relations}\"><sheets><sheet name=\"Notes\" sheetId=\"1\" state=\"{state}\" r:id=\"r1\"/><sheet name=\"Sweep\" sheetId=\"2\" r:id=\"r2\"/></sheets></workbook>"
                ),
            ),
            (
                "xl/_rels/workbook.xml.rels",
                format!(
                    "<Relationships xmlns=\"{package}\"><Relationship Id=\"r1\" Type=\"{relations}/worksheet\" Target=\"worksheets/sheet1.xml\"/><Relationship Id=\"r2\" Type=\"{relations}/worksheet\" Target=\"worksheets/sheet2.xml\"/></Relationships>"
                ),
            ),
            ("xl/worksheets/sheet1.xml", sheet(notes)),
            ("xl/worksheets/sheet2.xml", sheet(rows)),
        ];
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in parts {
            archive
                .start_file(name, SimpleFileOptions::default())
                .expect("a member");
            archive.write_all(text.as_bytes()).expect("written");
        }
        archive.finish().expect("whole").into_inner()
    }

    /// A header and three rows.
    const SWEEP: &str = "<row r=\"1\"><c r=\"A1\" t=\"inlineStr\"><is><t>U (mV)</t></is></c><c r=\"B1\" t=\"inlineStr\"><is><t>z (nm)</t></is></c></row>\
        <row r=\"2\"><c r=\"A2\"><v>0</v></c><c r=\"B2\"><v>0</v></c></row>\
        <row r=\"3\"><c r=\"A3\"><v>1000</v></c><c r=\"B3\"><v>26100.5</v></c></row>\
        <row r=\"4\"><c r=\"A4\"><v>2000</v></c></row>";

    #[test]
    fn the_first_sheet_with_a_table_is_read() {
        let table = table(&workbook(SWEEP)).expect("a table");
        assert_eq!(table.names, ["U (mV)", "z (nm)"]);
        assert_eq!(table.rows[1], [Some(1000.0), Some(26100.5)]);
        assert_eq!(table.rows[2], [Some(2000.0), None]);
        assert_eq!(table.written, "the sheet 'Sweep', of 2 sheets");
    }

    #[test]
    fn a_hidden_sheet_is_read_where_no_other_holds_a_table() {
        let both = table(&of_sheets("hidden", &SWEEP.replace("26100.5", "1"), SWEEP));
        assert_eq!(both.expect("a table").rows[1][1], Some(26100.5));
        let hidden = table(&of_sheets("hidden", SWEEP, "")).expect("a table");
        let told = "the sheet 'Notes', which is hidden, of 2 sheets";
        assert_eq!(hidden.written, told);
    }

    /// Another table below the first is no reason to read another sheet.
    #[test]
    fn a_table_that_cannot_be_read_is_told_by_its_sheet_and_row() {
        let second = "<row r=\"7\"><c r=\"A7\" t=\"inlineStr\"><is><t>U (V)</t></is></c><c r=\"B7\" t=\"inlineStr\"><is><t>z (um)</t></is></c></row>";
        let book = of_sheets("visible", &format!("{SWEEP}{second}"), SWEEP);
        let refused = table(&book).expect_err("two tables").to_string();
        assert!(
            refused.starts_with("the sheet 'Notes': line 7 has other headings"),
            "{refused}"
        );
    }

    #[test]
    fn a_cell_whose_name_is_too_long_is_an_error() {
        let book = workbook("<row r=\"1\"><c r=\"ZZZZZZZZZZZZ1\"><v>1</v></c></row>");
        assert!(table(&book).is_err());
    }

    #[test]
    fn a_workbook_without_a_table_is_told() {
        let error = table(&workbook("")).expect_err("no table").to_string();
        assert!(
            error.contains("no table of numbers is in Notes, Sweep"),
            "{error}"
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_spoilt_workbook_makes_no_panic(at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>()) {
            let mut bytes = workbook(SWEEP);
            let place = at.index(bytes.len());
            bytes[place] = byte;
            let _ = table(&bytes);
            bytes.truncate(cut.index(bytes.len()));
            let _ = table(&bytes);
        }
    }
}
