//! Transcripts: words with times from `.tsv` (start, end, word: GENEA 2022 and 2023) and `.json` (output of speech
//! recognisers with `words`: GENEA 2020, and plain lists), `.srt`, `.vtt` and `.TextGrid`, or words alone from `.txt`.

use super::word::Word;
use super::{subtitles, textgrid};
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::path::Path;

/// Transcript; `words` is empty without times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transcript {
    pub text: String,
    pub words: Vec<Word>,
}

impl Transcript {
    /// Transcript without times.
    pub fn of_text(text: &str) -> Self {
        Self { text: text.split_whitespace().collect::<Vec<_>>().join(" "), words: Vec::new() }
    }

    fn of_words(mut words: Vec<Word>) -> Self {
        words.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        let text = words.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" ");
        Self { text, words }
    }

    /// Reads a transcript by its ending. Errors name the line or the word.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let text = text.trim_start_matches('\u{feff}');
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let read = match ending.as_str() {
            "tsv" => tsv(text),
            "json" => json(text),
            "srt" | "vtt" => subtitles::read(text).map(Self::of_words),
            "textgrid" => textgrid::read(text).map(Self::of_words),
            _ => Ok(Self::of_text(text)),
        };
        read.with_context(|| format!("{} is no transcript", path.display()))
    }

    /// Transcript of the words that begin before second `end`; text without times is kept whole.
    pub fn until(&self, end: f64) -> Self {
        if self.words.is_empty() {
            return self.clone();
        }
        Self::of_words(self.words.iter().filter(|word| word.start_secs < end).cloned().collect())
    }
}

fn tsv(text: &str) -> Result<Transcript> {
    let mut words = Vec::new();
    for (line, n) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let mut parts = line.splitn(3, '\t').map(str::trim);
        let (Some(start), Some(end), Some(word)) = (parts.next(), parts.next(), parts.next()) else {
            bail!("line {n}: expected start, end and word with tabs between, found `{line}`");
        };
        match (start.parse::<f64>(), end.parse::<f64>()) {
            (Ok(start), Ok(end)) => words.push(word_at(start, end, word).with_context(|| format!("line {n}"))?),
            // Header line.
            _ if n == 1 => {}
            _ => bail!("line {n}: `{start}` and `{end}` are no seconds"),
        }
    }
    Ok(Transcript::of_words(words))
}

/// Finds every list `words` at any depth; of a recogniser's `alternatives` the first counts.
fn json(text: &str) -> Result<Transcript> {
    let value: Value = serde_json::from_str(text).context("it is not valid JSON")?;
    let mut words = Vec::new();
    match &value {
        Value::String(said) => return Ok(Transcript::of_text(said)),
        Value::Array(list) if list.iter().any(|entry| seconds(entry, START).is_some()) => gather(list, &mut words)?,
        _ => search(&value, &mut words)?,
    }
    if words.is_empty() {
        let said = ["text", "transcript", "sentence"].iter().find_map(|key| value.get(key)?.as_str());
        return Ok(Transcript::of_text(said.context("it has neither `words` with times nor a `text`")?));
    }
    Ok(Transcript::of_words(words))
}

const START: &[&str] = &["start_secs", "start_time", "start", "startTime"];
const END: &[&str] = &["end_secs", "end_time", "end", "endTime"];
const WORD: &[&str] = &["word", "text", "value"];

fn search(value: &Value, words: &mut Vec<Word>) -> Result<()> {
    match value {
        Value::Array(list) => list.iter().try_for_each(|entry| search(entry, words)),
        Value::Object(fields) => {
            if let Some(Value::Array(list)) = fields.get("words") {
                return gather(list, words);
            }
            fields.iter().try_for_each(|(key, inner)| match (key.as_str(), inner) {
                ("alternatives", Value::Array(list)) => list.first().map_or(Ok(()), |best| search(best, words)),
                _ => search(inner, words),
            })
        }
        _ => Ok(()),
    }
}

fn gather(list: &[Value], words: &mut Vec<Word>) -> Result<()> {
    for (entry, n) in list.iter().zip(1..) {
        let word = WORD.iter().find_map(|key| entry.get(key)?.as_str());
        let (Some(start), Some(end), Some(word)) = (seconds(entry, START), seconds(entry, END), word) else {
            bail!("word {n}: expected start_time, end_time and word, found {entry}");
        };
        words.push(word_at(start, end, word).with_context(|| format!("word {n}"))?);
    }
    Ok(())
}

/// Seconds as `1.5`, `"1.5"` or `"1.5s"`.
fn seconds(entry: &Value, keys: &[&str]) -> Option<f64> {
    let value = keys.iter().find_map(|key| entry.get(key))?;
    value.as_f64().or_else(|| value.as_str()?.trim().trim_end_matches('s').parse().ok())
}

fn word_at(start_secs: f64, end_secs: f64, word: &str) -> Result<Word> {
    ensure!(
        start_secs.is_finite() && end_secs.is_finite() && end_secs >= start_secs,
        "`{word}` is said from {start_secs} to {end_secs} s"
    );
    Ok(Word { start_secs, end_secs, word: word.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(transcript: &Transcript) -> String {
        let words = transcript.words.iter().map(|w| format!("{}@{}-{}", w.word, w.start_secs, w.end_secs));
        words.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn every_layout_gives_the_same_words() {
        let expected = "so@0.5-0.7 well@1-1.25";
        assert_eq!(said(&tsv("0.5\t0.7\tso\n1.0\t1.25\twell\n").unwrap()), expected);
        assert_eq!(said(&tsv("start\tend\tword\n1.0\t1.25\twell\n\n0.5\t0.7\tso\n").unwrap()), expected);
        let google = r#"[{"alternatives": [{"transcript": "so well", "words": [
            {"start_time": "0.500s", "end_time": "0.700s", "word": "so"}]}, {"words": [{"start_time": "9s"}]}]},
            {"alternatives": [{"words": [{"start_time": "1s", "end_time": "1.250s", "word": "well"}]}]}]"#;
        assert_eq!(said(&json(google).unwrap()), expected);
        let plain = r#"[{"start": 0.5, "end": 0.7, "word": "so"}, {"start": 1, "end": 1.25, "word": "well"}]"#;
        assert_eq!(said(&json(plain).unwrap()), expected);
        assert_eq!(json(r#"{"text": "so  well"}"#).unwrap(), Transcript::of_text("so well"));
    }

    #[test]
    fn errors_say_where_and_an_end_cuts_words() {
        assert!(format!("{:#}", tsv("0 1 so\n").unwrap_err()).contains("line 1"));
        assert!(format!("{:#}", tsv("0\t1\tso\n2\tx\twell").unwrap_err()).contains("line 2"));
        assert!(format!("{:#}", tsv("2\t1\tso\n").unwrap_err()).contains("from 2 to 1"));
        assert!(json("{").is_err() && json("{}").is_err());
        assert!(format!("{:#}", json(r#"{"words": [{"word": "so"}]}"#).unwrap_err()).contains("word 1"));
        let transcript = tsv("0.5\t0.7\tso\n1.0\t1.25\twell\n").unwrap();
        assert_eq!(transcript.until(1.0).text, "so");
        assert_eq!(transcript.until(1.1).text, "so well");
        assert_eq!(Transcript::of_text(" a\nb ").until(0.1).text, "a b");
    }
}
