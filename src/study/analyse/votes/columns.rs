//! Columns of a table of votes, their names in a file, and its rows. Delimited text: comma, semicolon or tab, quoted or
//! not, with or without a byte order mark. JSON Lines: one object per line whose keys are the columns.

use super::row::{MAX_ROWS, RowCells};
use crate::vote::VOTE_COLUMNS;
use anyhow::{Context, Result, bail, ensure};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Additional columns of simpler tables: one condition, whether the answer was correct, one score, a preference step.
const SHORT_FORMS: [&str; 4] = ["condition", "correct", "score", "step"];

fn fields() -> impl Iterator<Item = &'static str> {
    VOTE_COLUMNS.into_iter().chain(SHORT_FORMS)
}

/// File-specific column names by field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnNames(BTreeMap<&'static str, String>);

impl ColumnNames {
    /// Parses `participant=worker,clip=stimulus`.
    ///
    /// # Errors
    /// A pair has no `=`, its field is unknown or repeated, or its name is empty.
    pub fn parse(text: &str) -> Result<Self> {
        let mut names = BTreeMap::new();
        for pair in text.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
            let Some((field, name)) = pair.split_once('=').map(|(field, name)| (field.trim(), name.trim())) else {
                bail!(
                    "--columns: invalid pair \"{pair}\": expected FIELD=NAME pairs such as \
                     participant=worker,clip=stimulus"
                )
            };
            let Some(known) = fields().find(|known| *known == field) else {
                bail!(
                    "--columns: unknown field \"{field}\": expected one of {}",
                    fields().collect::<Vec<_>>().join(", ")
                )
            };
            ensure!(!name.is_empty(), "--columns: no column name after {field}=");
            ensure!(names.insert(known, name.to_owned()).is_none(), "--columns: {field} is given twice");
        }
        Ok(Self(names))
    }

    fn of(&self, field: &'static str) -> &str {
        self.0.get(field).map_or(field, String::as_str)
    }

    /// Column indices of the fields in a header. Names are compared ignoring case and surrounding whitespace.
    fn indices(&self, header: &[String]) -> Result<BTreeMap<&'static str, usize>> {
        let mut indices = BTreeMap::new();
        for field in fields() {
            let name = self.of(field);
            let mut found = (0..header.len()).filter(|index| is_named(&header[*index], name));
            match (found.next(), found.next()) {
                (Some(index), None) => drop(indices.insert(field, index)),
                (Some(_), Some(_)) => bail!("two columns are named \"{name}\": rename one"),
                (None, _) if self.0.contains_key(field) => {
                    bail!("column \"{name}\" not found: the columns are {}", shown(header))
                }
                (None, _) => {}
            }
        }
        Self::check(&indices.keys().copied().collect::<Vec<_>>(), header)?;
        Ok(indices)
    }

    /// Checks that a table has the required columns: participant, clip and an answer.
    fn check(fields: &[&str], header: &[String]) -> Result<()> {
        let lacks = |field: &str| !fields.contains(&field);
        for field in ["participant", "clip"] {
            if lacks(field) {
                let nearest = header.iter().max_by(|a, b| similarity(field, a).total_cmp(&similarity(field, b)));
                let example = nearest.map_or("NAME", |name| name.trim());
                let columns = shown(header);
                bail!(
                    "column \"{field}\" not found: the columns are {columns}; map it, such as --columns \
                     {field}={example}"
                );
            }
        }
        let answers = ["response", "correct", "score", "step"];
        if answers.iter().all(|answer| lacks(answer)) {
            bail!(
                "no column with answers: expected one of {}, found {}; map it, such as --columns correct=NAME",
                answers.join(", "),
                shown(header)
            );
        }
        Ok(())
    }
}

/// Whether a column or key has this name, ignoring case and surrounding whitespace.
fn is_named(found: &str, name: &str) -> bool {
    found.trim().chars().flat_map(char::to_lowercase).eq(name.chars().flat_map(char::to_lowercase))
}

/// Similarity of two names, 0 to 1.
fn similarity(field: &str, cell: &str) -> f64 {
    strsim::jaro_winkler(field, &cell.trim().to_lowercase())
}

/// Column names for an error message, at most 20.
fn shown(header: &[String]) -> String {
    let names: Vec<String> = header.iter().take(20).map(|name| name.trim().chars().take(40).collect()).collect();
    format!("{}{}", names.join(", "), if header.len() > 20 { ", ..." } else { "" })
}

/// Rows with line numbers, or the reason why a row cannot be read.
pub type NumberedRows = Vec<(u64, std::result::Result<RowCells, String>)>;

/// Reads the rows of delimited text. Rows that are not UTF-8 or of another number of cells are returned with a reason.
///
/// # Errors
/// The text is UTF-16, binary or empty, required columns are missing, or there are too many rows.
pub fn delimited_rows(bytes: &[u8], names: &ColumnNames) -> Result<NumberedRows> {
    ensure!(
        !bytes.starts_with(&[0xff, 0xfe]) && !bytes.starts_with(&[0xfe, 0xff]),
        "the file is UTF-16: save it as UTF-8"
    );
    ensure!(!bytes.iter().take(512).any(|byte| *byte == 0), "the file is binary: expected CSV, TSV or JSON Lines");
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let delimiter = delimiter(bytes);
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.delimiter(delimiter).flexible(true).has_headers(false).from_reader(bytes);
    let mut record = csv::ByteRecord::new();
    ensure!(reader.read_byte_record(&mut record)?, "the file is empty: expected column names in the first line");
    let header: Vec<String> = record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
    let indices = names.indices(&header)?;
    let mut rows = Vec::new();
    while reader.read_byte_record(&mut record).context("a row cannot be read")? {
        let line = record.position().map_or(0, csv::Position::line);
        if record.iter().all(<[u8]>::is_empty) {
            continue;
        }
        ensure!(rows.len() < MAX_ROWS, "the file has more than {MAX_ROWS} rows");
        rows.push((line, cells(&record, header.len(), &indices, delimiter == b';')));
    }
    Ok(rows)
}

fn cells(
    record: &csv::ByteRecord,
    width: usize,
    indices: &BTreeMap<&'static str, usize>,
    has_decimal_comma: bool,
) -> std::result::Result<RowCells, String> {
    if record.len() != width {
        return Err(format!("{} cells, but the header has {width}", record.len()));
    }
    let mut values = BTreeMap::new();
    for (field, index) in indices {
        let cell = std::str::from_utf8(&record[*index]).map_err(|_| format!("{field} is not valid UTF-8"))?;
        values.insert(*field, cell.trim().to_owned());
    }
    Ok(RowCells { values, has_decimal_comma })
}

/// Most frequent delimiter in the first line, outside quotes.
fn delimiter(bytes: &[u8]) -> u8 {
    let mut counts = [(b',', 0), (b';', 0), (b'\t', 0)];
    let mut is_quoted = false;
    for &byte in bytes.iter().take_while(|byte| **byte != b'\n') {
        is_quoted ^= byte == b'"';
        counts.iter_mut().filter(|(delimiter, _)| *delimiter == byte && !is_quoted).for_each(|(_, n)| *n += 1);
    }
    counts.iter().rev().max_by_key(|(_, n)| *n).map_or(b',', |(delimiter, _)| *delimiter)
}

/// Reads the rows of JSON Lines. Lines that are not objects are returned with the reason.
///
/// # Errors
/// The text is empty, the first object lacks required columns, or there are too many rows.
pub fn json_rows(bytes: &[u8], names: &ColumnNames) -> Result<NumberedRows> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut rows: NumberedRows = Vec::new();
    for (line, text) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if text.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        ensure!(rows.len() < MAX_ROWS, "the file has more than {MAX_ROWS} rows");
        let object = serde_json::from_slice::<Map<String, Value>>(text);
        let row = match object {
            Ok(object) if rows.is_empty() => {
                names.indices(&object.keys().cloned().collect::<Vec<_>>())?;
                json_cells(&object, names)
            }
            Ok(object) => json_cells(&object, names),
            Err(error) => Err(format!("not a JSON object: {error}")),
        };
        rows.push((line as u64 + 1, row));
    }
    ensure!(!rows.is_empty(), "the file is empty: expected a JSON object per line");
    Ok(rows)
}

fn json_cells(object: &Map<String, Value>, names: &ColumnNames) -> std::result::Result<RowCells, String> {
    let mut values = BTreeMap::new();
    for field in fields() {
        let name = names.of(field);
        let mut found = object.iter().filter(|(key, _)| is_named(key, name));
        let Some((_, value)) = found.next() else { continue };
        if found.next().is_some() {
            return Err(format!("two keys are named \"{name}\""));
        }
        values.insert(field, text(value));
    }
    Ok(RowCells { values, has_decimal_comma: false })
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.trim().to_owned(),
        Value::Array(parts) => parts.iter().map(text).collect::<Vec<_>>().join("|"),
        other => other.to_string(),
    }
}
