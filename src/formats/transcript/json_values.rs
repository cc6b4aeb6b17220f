//! Fields of the JSON of speech recognisers: times in their units, confidence, and text, under the names that each
//! program uses.

use anyhow::{Context, Result};
use serde_json::{Deserializer, Value};

const START: [&str; 4] = ["start_secs", "start_time", "start", "startTime"];
const END: [&str; 4] = ["end_secs", "end_time", "end", "endTime"];
/// Google v2. Gentle uses the names for positions in the text, which are numbers.
const START_OFFSET: [&str; 2] = ["startOffset", "start_offset"];
const END_OFFSET: [&str; 2] = ["endOffset", "end_offset"];
const WORD: [&str; 3] = ["word", "text", "value"];
const CONFIDENCE: [&str; 4] = ["confidence", "probability", "score", "conf"];

/// Parses JSON in which Python's `NaN` and `Infinity` stand for null; several values in a row become a list.
pub(super) fn parse(text: &str) -> Result<Value> {
    let all = |text: &str| Deserializer::from_str(text).into_iter::<Value>().collect::<serde_json::Result<Vec<_>>>();
    let has_literals = ["NaN", "Infinity"].iter().any(|literal| text.contains(literal));
    let values = all(text).or_else(|error| if has_literals { all(&with_null(text)) } else { Err(error) });
    let mut values = values.context("it is not valid JSON")?;
    match values.len() {
        0 => anyhow::bail!("the file is empty: expected JSON"),
        1 => Ok(values.swap_remove(0)),
        _ => Ok(Value::Array(values)),
    }
}

/// JSON text with null in the place of the numbers that JSON does not have.
fn with_null(text: &str) -> String {
    let (mut valid, mut from, mut is_string, mut is_escaped) = (String::with_capacity(text.len()), 0, false, false);
    let mut add = |part: &str, is_string: bool| match is_string {
        true => valid.push_str(part),
        false => valid += &part.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null"),
    };
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = is_string,
            b'"' => {
                add(&text[from..at], is_string);
                (from, is_string) = (at, !is_string);
            }
            _ => {}
        }
    }
    add(&text[from..], is_string);
    valid
}

/// Start and end of an entry in seconds; whisper.cpp (`offsets`) states milliseconds, others `per_sec` units a second.
pub(super) fn times(entry: &Value, per_sec: f64) -> (Option<f64>, Option<f64>) {
    let field = |keys: &[&str], offset_keys: &[&str]| {
        let offset = || offset_keys.iter().find_map(|key| entry.get(key)).filter(|offset| !offset.is_number());
        keys.iter().find_map(|key| entry.get(key)).or_else(offset)
    };
    let (start, end) = (field(&START, &START_OFFSET), field(&END, &END_OFFSET));
    if let (None, None, Some(range)) = (start, end, entry.get("timestamp")) {
        return (range.get(0).and_then(seconds), range.get(1).and_then(seconds));
    }
    if let (None, None, Some(offsets)) = (start, end, entry.get("offsets")) {
        let secs = |key: &str| Some(offsets.get(key)?.as_f64()? / 1000.0);
        return (secs("from"), secs("to"));
    }
    // The JSON of protocol buffers omits a time of zero.
    let is_duration = |value: &Value| value.as_str().is_some_and(|text| text.ends_with('s'));
    let zero = (start.is_none() && end.is_some_and(is_duration)).then_some(0.0);
    let scaled = |value: &Value| seconds(value).map(|time| time / per_sec);
    (start.and_then(scaled).or(zero), end.and_then(scaled))
}

/// Seconds as `1.5`, `"1.5"`, `"1.5s"` or `{"seconds": 1, "nanos": 500000000}`.
fn seconds(value: &Value) -> Option<f64> {
    let secs = match value {
        Value::Object(parts) if parts.keys().all(|key| key == "seconds" || key == "nanos") => {
            let part = |key: &str| parts.get(key).map_or(Some(0.0), number);
            part("seconds")? + part("nanos")? / 1e9
        }
        _ => number(value)?,
    };
    Some(secs).filter(|secs| secs.is_finite())
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.trim().trim_end_matches('s').parse().ok())
}

/// Text of a word or sentence.
pub(super) fn text(entry: &Value) -> Option<&str> {
    WORD.iter().find_map(|key| entry.get(key)?.as_str())
}

/// Confidence of a word.
pub(super) fn confidence(entry: &Value) -> Option<f64> {
    CONFIDENCE.iter().find_map(|key| number(entry.get(key)?))
}

/// The non-empty list in a field.
pub(super) fn list<'a>(value: &'a Value, key: &str) -> Option<&'a [Value]> {
    value.get(key)?.as_array().map(Vec::as_slice).filter(|list| !list.is_empty())
}
