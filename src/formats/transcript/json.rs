//! JSON of speech recognisers: Google (GENEA 2020), Whisper and WhisperX, plain lists of words, and the `.words.json`
//! of a dataset. The words of a sentence without word times share the time of the sentence.

use super::word::{self, Word, WordSource};
use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Contents of a file.
#[derive(Debug, PartialEq)]
pub enum JsonTranscript {
    Words(Vec<Word>),
    /// Text without times.
    Text(String),
}

const START: &[&str] = &["start_secs", "start_time", "start", "startTime"];
const END: &[&str] = &["end_secs", "end_time", "end", "endTime"];
const WORD: &[&str] = &["word", "text", "value"];
const CONFIDENCE: &[&str] = &["confidence", "probability", "score"];

/// Collects every `words` list at any depth; of a recogniser's `alternatives` only the first is used.
///
/// # Errors
///
/// Invalid JSON, or JSON without words or text; the index of a word with invalid times.
pub fn read(text: &str) -> Result<JsonTranscript> {
    let value: Value = serde_json::from_str(text).context("it is not valid JSON")?;
    let mut words = Vec::new();
    match &value {
        Value::String(text) => return Ok(JsonTranscript::Text(text.clone())),
        Value::Array(list) if list.is_empty() => return Ok(JsonTranscript::Words(words)),
        Value::Array(list) if list.iter().any(|entry| seconds(entry, START).is_some()) => {
            collect_words(list, &mut words)?;
        }
        _ => collect_nested(&value, &mut words)?,
    }
    if words.is_empty() {
        let text = ["text", "transcript", "sentence"].iter().find_map(|key| value.get(key)?.as_str());
        let text = text.context("expected `words` with times, or a `text`")?;
        return Ok(JsonTranscript::Text(text.to_owned()));
    }
    Ok(JsonTranscript::Words(words))
}

fn collect_nested(value: &Value, words: &mut Vec<Word>) -> Result<()> {
    match value {
        Value::Array(list) => list.iter().try_for_each(|entry| collect_nested(entry, words)),
        Value::Object(fields) => {
            if let Some(Value::Array(list)) =
                fields.get("words").filter(|list| !list.as_array().is_some_and(Vec::is_empty))
            {
                return collect_words(list, words);
            }
            // A Whisper sentence without word times.
            if let (Some(start), Some(end), Some(text)) =
                (seconds(value, START), seconds(value, END), fields.get("text").and_then(Value::as_str))
            {
                return word::push(words, text, (start, end), None);
            }
            fields.iter().try_for_each(|(key, inner)| match (key.as_str(), inner) {
                ("alternatives", Value::Array(list)) => list.first().map_or(Ok(()), |best| collect_nested(best, words)),
                // WhisperX lists its words twice.
                ("word_segments", _) if fields.contains_key("segments") => Ok(()),
                _ => collect_nested(inner, words),
            })
        }
        _ => Ok(()),
    }
}

fn collect_words(list: &[Value], words: &mut Vec<Word>) -> Result<()> {
    let first = words.len();
    // Words without times that wait for the next word with times.
    let mut untimed: Vec<&str> = Vec::new();
    let is_timed = list.iter().any(|entry| seconds(entry, START).is_some());
    for (entry, n) in list.iter().zip(1..) {
        let text = WORD.iter().find_map(|key| entry.get(key)?.as_str());
        match (seconds(entry, START), seconds(entry, END), text) {
            (Some(start), Some(end), Some(text)) => {
                interpolate(words, first, &mut untimed, start);
                let at = words.len();
                let confidence = CONFIDENCE.iter().find_map(|key| entry.get(key)?.as_f64());
                word::push(words, text, (start, end), confidence).with_context(|| format!("word {n}"))?;
                let source = entry.get("source").and_then(|source| serde_json::from_value(source.clone()).ok());
                if let Some(source) = source {
                    words[at..].iter_mut().for_each(|word| word.source = source);
                }
            }
            // WhisperX does not time numerals.
            (None, None, Some(text)) if is_timed => untimed.push(text),
            _ => bail!("word {n}: expected start_time, end_time and word, found {entry}"),
        }
    }
    let end = words[first..].last().map_or(0.0, |word| word.end_secs);
    interpolate(words, first, &mut untimed, end);
    Ok(())
}

/// Spreads the `untimed` words evenly between the last word since index `first` and `until` seconds.
fn interpolate(words: &mut Vec<Word>, first: usize, untimed: &mut Vec<&str>, until: f64) {
    if untimed.is_empty() {
        return;
    }
    let start = words[first..].last().map_or(until, |word| word.end_secs).min(until);
    let secs = (until - start) / untimed.len() as f64;
    for (nth, text) in untimed.drain(..).enumerate().filter(|(_, text)| !text.trim().is_empty()) {
        let [start_secs, end_secs] = [nth, nth + 1].map(|n| start + secs * n as f64);
        let (word, source, confidence) = (text.trim().to_owned(), WordSource::Interpolated, Some(0.0));
        words.push(Word { word, start_secs, end_secs, source, confidence });
    }
}

/// Seconds as `1.5`, `"1.5"` or `"1.5s"`.
fn seconds(entry: &Value, keys: &[&str]) -> Option<f64> {
    let value = keys.iter().find_map(|key| entry.get(key))?;
    value.as_f64().or_else(|| value.as_str()?.trim().trim_end_matches('s').parse().ok())
}
