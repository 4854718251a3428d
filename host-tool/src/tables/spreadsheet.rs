//! Spreadsheets: the first sheet that holds a table, one that is shown before one that is hidden.

mod percent;
mod sheet;

use std::io::Cursor;
use std::panic;

use calamine::{Reader, SheetVisible, Sheets, open_workbook_auto_from_rs};
use measurement::import::{ImportError, Table};

use sheet::Sheet;

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
        let Some(cells) = Sheet::read(bytes, &mut book, &sheet.name) else {
            continue;
        };
        let hidden = match sheet.visible {
            SheetVisible::Visible => "",
            _ => ", which is hidden",
        };
        let written = format!("the sheet '{}'{hidden}", sheet.name);
        let found = Table::find(cells.text().as_bytes()).map_err(|error| error.within(&written))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::import::{guesses, import};
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
                    "<Relationships xmlns=\"{package}\"><Relationship Id=\"r1\" Type=\"{relations}/worksheet\" Target=\"worksheets/sheet1.xml\"/><Relationship Id=\"r2\" Type=\"{relations}/worksheet\" Target=\"worksheets/sheet2.xml\"/><Relationship Id=\"r3\" Type=\"{relations}/styles\" Target=\"styles.xml\"/></Relationships>"
                ),
            ),
            ("xl/styles.xml", styles(main)),
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

    /// Formats of cells, by their places: general, percent, a time of day, a duration, a date, millimetres.
    fn styles(main: &str) -> String {
        let formats = [0, 10, 21, 46, 22, 164].map(|id| format!("<xf numFmtId=\"{id}\"/>"));
        format!(
            "<styleSheet xmlns=\"{main}\"><numFmts count=\"1\"><numFmt numFmtId=\"164\" formatCode=\"0.000&quot; mm&quot;\"/></numFmts><cellXfs count=\"6\">{}</cellXfs></styleSheet>",
            formats.concat()
        )
    }

    /// Columns `Time`, `V` and `z`, of cells as XML has them behind their names.
    fn rows(cells: &[[&str; 3]]) -> String {
        let heading = |name: &str| format!(" t=\"inlineStr\"><is><t>{name}</t></is></c>");
        let headings = ["Time", "V", "z"].map(heading);
        let headings = headings.each_ref().map(String::as_str);
        let row = |(number, cells): (usize, &[&str; 3])| {
            let cells = ["A", "B", "C"].iter().zip(cells);
            let cells = cells.map(|(column, cell)| format!("<c r=\"{column}{number}\"{cell}"));
            format!("<row r=\"{number}\">{}</row>", cells.collect::<String>())
        };
        let all = [&[headings][..], cells].concat();
        (1..).zip(&all).map(row).collect()
    }

    fn imported(cells: &[[&str; 3]]) -> Result<(Vec<f64>, Vec<String>), ImportError> {
        let table = table(&workbook(&rows(cells)))?;
        let made = import(&table, &guesses(&table), false)?;
        Ok((
            made.file.rows.iter().map(|row| row.t_s).collect(),
            made.notes,
        ))
    }

    #[test]
    fn times_of_day_go_on_over_midnight() {
        let (t_s, _) = imported(&[
            [
                " s=\"2\"><v>0.999988425925926</v></c>",
                "><v>0</v></c>",
                "><v>0</v></c>",
            ],
            [" s=\"2\"><v>0</v></c>", "><v>1</v></c>", "><v>26</v></c>"],
            [
                " s=\"2\"><v>1.15740740740741E-05</v></c>",
                "><v>2</v></c>",
                "><v>90</v></c>",
            ],
        ])
        .expect("a measurement");
        assert_eq!(t_s, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn cells_of_other_kinds_are_no_volts_or_micrometres() {
        for (cell, told) in [
            (
                " s=\"1\"><v>0.07</v></c>",
                "column 2 'V' is V_V, and holds parts of a hundred in line 3: 7%",
            ),
            (
                " s=\"4\"><v>46085</v></c>",
                "holds a date or a time in line 3: 2026-03-04T00:00:00",
            ),
            (
                " s=\"2\"><v>0.5</v></c>",
                "holds a date or a time in line 3: 12:00:00",
            ),
            (
                " s=\"3\"><v>0.5</v></c>",
                "holds a duration in line 3: PT43200S",
            ),
        ] {
            let refused = imported(&[
                ["><v>0</v></c>", "><v>0</v></c>", "><v>0</v></c>"],
                ["><v>1</v></c>", cell, "><v>1</v></c>"],
                ["><v>2</v></c>", "><v>2</v></c>", "><v>90</v></c>"],
            ]);
            let refused = refused.expect_err(told).to_string();
            assert!(refused.contains(told), "{refused}");
        }
    }

    #[test]
    fn a_unit_in_the_format_of_cells_is_read() {
        let z = " s=\"5\"><v>0.026</v></c>";
        let cells = [["><v>1</v></c>", "><v>1</v></c>", z]; 3];
        let table = table(&workbook(&rows(&cells))).expect("a table");
        assert_eq!(table.names[2], "z (mm)");
        assert_eq!(table.rows[0][2], Some(0.026));
    }

    #[test]
    fn formulas_without_results_are_told() {
        let (_, notes) = imported(&[
            ["><v>0</v></c>", "><v>0</v></c>", "><f>B2*2</f><v></v></c>"],
            ["><v>1</v></c>", "><v>1</v></c>", "><f>B3*2</f></c>"],
            [
                "><v>2</v></c>",
                "><f>1+1</f><v>2</v></c>",
                "><f>B4*2</f><v/></c>",
            ],
        ])
        .expect("a measurement");
        let told = "3 cells of 'z' have no number that can be read, and count as missing: '=B2*2' in line 2 is the first; a formula";
        assert!(notes.iter().any(|note| note.starts_with(told)), "{notes:?}");
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
