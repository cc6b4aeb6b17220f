//! Text of rows and columns: comma, semicolon or tab, quoted or not, with or without a byte order mark.

use super::columns::ColumnNames;
use super::row::{MOST_ROWS, RowCells};
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;

/// Rows with their line, or why one cannot be read.
pub type LinedRows = Vec<(u64, std::result::Result<RowCells, String>)>;

/// Rows of a file. A row that is no text or has another number of cells than the header is given with the reason.
pub fn rows(bytes: &[u8], names: &ColumnNames) -> Result<LinedRows> {
    ensure!(!bytes.starts_with(&[0xff, 0xfe]) && !bytes.starts_with(&[0xfe, 0xff]), "it is UTF-16; save it as UTF-8");
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let delimiter = delimiter(bytes);
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.delimiter(delimiter).flexible(true).has_headers(false).from_reader(bytes);
    let mut record = csv::ByteRecord::new();
    ensure!(reader.read_byte_record(&mut record)?, "it is empty; the first line names the columns");
    let header: Vec<String> = record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
    let places = names.places(&header)?;
    let mut rows = Vec::new();
    loop {
        if !reader.read_byte_record(&mut record).context("a row cannot be read")? {
            break;
        }
        let line = record.position().map_or(0, csv::Position::line);
        if record.iter().all(<[u8]>::is_empty) {
            continue;
        }
        if rows.len() == MOST_ROWS {
            bail!("it has more than {MOST_ROWS} rows");
        }
        rows.push((line, cells(&record, header.len(), &places, delimiter == b';')));
    }
    Ok(rows)
}

fn cells(
    record: &csv::ByteRecord,
    width: usize,
    places: &BTreeMap<&'static str, usize>,
    has_decimal_comma: bool,
) -> std::result::Result<RowCells, String> {
    if record.len() != width {
        return Err(format!("it has {} cells where the header has {width}", record.len()));
    }
    let mut values = BTreeMap::new();
    for (field, place) in places {
        let cell = std::str::from_utf8(&record[*place]).map_err(|_| format!("{field} is no UTF-8"))?;
        values.insert(*field, cell.trim().to_owned());
    }
    Ok(RowCells { values, has_decimal_comma })
}

/// Delimiter that occurs most often in the first line outside quotes.
fn delimiter(bytes: &[u8]) -> u8 {
    let mut counts = [(b',', 0), (b';', 0), (b'\t', 0)];
    let mut is_quoted = false;
    for &byte in bytes.iter().take_while(|byte| **byte != b'\n') {
        is_quoted ^= byte == b'"';
        counts.iter_mut().filter(|(delimiter, _)| *delimiter == byte && !is_quoted).for_each(|(_, n)| *n += 1);
    }
    counts.iter().rev().max_by_key(|(_, n)| *n).map_or(b',', |(delimiter, _)| *delimiter)
}
