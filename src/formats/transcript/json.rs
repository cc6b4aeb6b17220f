//! JSON of speech recognisers: Google's (GENEA 2020), Whisper and WhisperX, lists of words, and the `.words.json` of a
//! dataset. Sentences that time no word share their time between the words.

use super::word::{self, Word, WordSource};
use anyhow::{Context, Result, bail};
use serde_json::Value;

/// What a file holds.
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

/// Finds every list `words` at any depth; of a recogniser's `alternatives` the first counts. Errors: no JSON, or none
/// with words or text; the number of a word whose times cannot be.
pub fn read(text: &str) -> Result<JsonTranscript> {
    let value: Value = serde_json::from_str(text).context("it is not valid JSON")?;
    let mut words = Vec::new();
    match &value {
        Value::String(said) => return Ok(JsonTranscript::Text(said.clone())),
        Value::Array(list) if list.is_empty() => return Ok(JsonTranscript::Words(words)),
        Value::Array(list) if list.iter().any(|entry| seconds(entry, START).is_some()) => gather(list, &mut words)?,
        _ => search(&value, &mut words)?,
    }
    if words.is_empty() {
        let said = ["text", "transcript", "sentence"].iter().find_map(|key| value.get(key)?.as_str());
        let said = said.context("it has neither `words` with times nor a `text`")?;
        return Ok(JsonTranscript::Text(said.to_owned()));
    }
    Ok(JsonTranscript::Words(words))
}

fn search(value: &Value, words: &mut Vec<Word>) -> Result<()> {
    match value {
        Value::Array(list) => list.iter().try_for_each(|entry| search(entry, words)),
        Value::Object(fields) => {
            if let Some(Value::Array(list)) =
                fields.get("words").filter(|list| !list.as_array().is_some_and(Vec::is_empty))
            {
                return gather(list, words);
            }
            // A sentence of Whisper that times no word.
            if let (Some(start), Some(end), Some(said)) =
                (seconds(value, START), seconds(value, END), fields.get("text").and_then(Value::as_str))
            {
                return word::push(words, said, (start, end), None);
            }
            fields.iter().try_for_each(|(key, inner)| match (key.as_str(), inner) {
                ("alternatives", Value::Array(list)) => list.first().map_or(Ok(()), |best| search(best, words)),
                // WhisperX says its words twice.
                ("word_segments", _) if fields.contains_key("segments") => Ok(()),
                _ => search(inner, words),
            })
        }
        _ => Ok(()),
    }
}

fn gather(list: &[Value], words: &mut Vec<Word>) -> Result<()> {
    let first = words.len();
    // Words without times wait for the next that has some.
    let mut untimed: Vec<&str> = Vec::new();
    let is_timed = list.iter().any(|entry| seconds(entry, START).is_some());
    for (entry, n) in list.iter().zip(1..) {
        let said = WORD.iter().find_map(|key| entry.get(key)?.as_str());
        match (seconds(entry, START), seconds(entry, END), said) {
            (Some(start), Some(end), Some(said)) => {
                between(words, first, &mut untimed, start);
                let at = words.len();
                let confidence = CONFIDENCE.iter().find_map(|key| entry.get(key)?.as_f64());
                word::push(words, said, (start, end), confidence).with_context(|| format!("word {n}"))?;
                let source = entry.get("source").and_then(|source| serde_json::from_value(source.clone()).ok());
                if let Some(source) = source {
                    words[at..].iter_mut().for_each(|word| word.source = source);
                }
            }
            // WhisperX times no number.
            (None, None, Some(said)) if is_timed => untimed.push(said),
            _ => bail!("word {n}: expected start_time, end_time and word, found {entry}"),
        }
    }
    let end = words[first..].last().map_or(0.0, |word| word.end_secs);
    between(words, first, &mut untimed, end);
    Ok(())
}

/// Adds words that have no times between the last word since `first` and `until` seconds.
fn between(words: &mut Vec<Word>, first: usize, untimed: &mut Vec<&str>, until: f64) {
    if untimed.is_empty() {
        return;
    }
    let start = words[first..].last().map_or(until, |word| word.end_secs).min(until);
    let secs = (until - start) / untimed.len() as f64;
    for (nth, said) in untimed.drain(..).enumerate().filter(|(_, said)| !said.trim().is_empty()) {
        let [start_secs, end_secs] = [nth, nth + 1].map(|n| start + secs * n as f64);
        let (word, source, confidence) = (said.trim().to_owned(), WordSource::Interpolated, Some(0.0));
        words.push(Word { word, start_secs, end_secs, source, confidence });
    }
}

/// Seconds as `1.5`, `"1.5"` or `"1.5s"`.
fn seconds(entry: &Value, keys: &[&str]) -> Option<f64> {
    let value = keys.iter().find_map(|key| entry.get(key))?;
    value.as_f64().or_else(|| value.as_str()?.trim().trim_end_matches('s').parse().ok())
}
