//! JSON Lines: one object a line, its keys the columns.

use super::columns::{ColumnNames, FIELDS};
use super::delimited::LinedRows;
use super::row::{MOST_ROWS, RowCells};
use anyhow::{Result, ensure};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Rows of a file. A line that is no object is given with the reason.
pub fn rows(bytes: &[u8], names: &ColumnNames) -> Result<LinedRows> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut rows: LinedRows = Vec::new();
    for (line, text) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if text.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        ensure!(rows.len() < MOST_ROWS, "it has more than {MOST_ROWS} rows");
        let object = serde_json::from_slice::<Map<String, Value>>(text);
        let row = match object {
            Ok(object) if rows.is_empty() => {
                names.places(&object.keys().cloned().collect::<Vec<_>>())?;
                Ok(cells(&object, names))
            }
            Ok(object) => Ok(cells(&object, names)),
            Err(error) => Err(format!("it is no JSON object: {error}")),
        };
        rows.push((line as u64 + 1, row));
    }
    ensure!(!rows.is_empty(), "it is empty");
    Ok(rows)
}

fn cells(object: &Map<String, Value>, names: &ColumnNames) -> RowCells {
    let value = |field| object.get(names.of(field)).map(|value| (field, text(value)));
    let values: BTreeMap<_, _> = FIELDS.into_iter().filter_map(value).collect();
    RowCells { values, has_decimal_comma: false }
}

/// Value as the cell of a table would have it.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.trim().to_owned(),
        Value::Array(parts) => parts.iter().map(text).collect::<Vec<_>>().join("|"),
        other => other.to_string(),
    }
}
