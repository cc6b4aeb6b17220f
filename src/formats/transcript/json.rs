//! JSON of speech recognisers and aligners, recognised by content: Google v1 (GENEA 2020) and v2, Whisper, WhisperX,
//! whisper.cpp, OpenAI, the pipelines of Hugging Face, Vosk, AssemblyAI, AWS Transcribe, Gentle, MFA, plain lists of
//! words, and the `.words.json` of a dataset. The words of a sentence without word times share the time of the sentence.

use super::collector::WordCollector;
use super::json_values::{confidence, list, parse, text, times};
use super::tiers;
use super::word::{self, Word};
use anyhow::{Context, Result, anyhow, bail};
use serde_json::Value;

/// Contents of a file.
#[derive(Debug, PartialEq)]
pub enum JsonTranscript {
    Words(Vec<Word>),
    /// Text without times.
    Text(String),
}

/// Words of the tier of `speaker` (MFA), or of every list of words at any depth; of a recogniser's `alternatives` only
/// the first is used. Words without times are placed within their sentence.
pub fn read(content: &str, speaker: &str) -> Result<JsonTranscript> {
    let value = parse(content)?;
    if let Some(tiers) = value.get("tiers") {
        return Ok(JsonTranscript::Words(tiers::words_of(intervals(tiers)?, speaker)?));
    }
    let mut reader = JsonReader { per_sec: units_per_sec(&value), collector: WordCollector::default() };
    match &value {
        Value::String(text) => return Ok(JsonTranscript::Text(text.clone())),
        Value::Array(list) if list.is_empty() => return Ok(JsonTranscript::Words(Vec::new())),
        Value::Array(list) if reader.has_times(list) => reader.add_words(list)?,
        _ => reader.add(&value)?,
    }
    let text = ["text", "transcript", "sentence"].iter().find_map(|key| value.get(key)?.as_str());
    match reader.collector.finish() {
        Ok(words) if !words.is_empty() => Ok(JsonTranscript::Words(words)),
        found => match text {
            Some(text) => Ok(JsonTranscript::Text(text.to_owned())),
            // A recogniser that found no speech.
            None if value.get("segments").and_then(Value::as_array).is_some_and(Vec::is_empty) => {
                Ok(JsonTranscript::Words(Vec::new()))
            }
            None => Err(found.err().unwrap_or_else(|| anyhow!("expected `words` with times, or a `text`"))),
        },
    }
}

/// Units of time per second: AssemblyAI states milliseconds. Its transcripts have an identifier, a status and words with
/// integer times, its sentences an identifier and the duration of the audio.
fn units_per_sec(value: &Value) -> f64 {
    let has_integers = |words: &[Value]| words.iter().all(|word| word.get("start").is_some_and(Value::is_u64));
    let is_transcript = value.get("status").is_some_and(|status| status == "completed")
        && list(value, "words").is_some_and(has_integers);
    let is_division =
        value.get("audio_duration").is_some() && ["sentences", "paragraphs"].iter().any(|key| value.get(key).is_some());
    let is_assembly_ai = value.get("id").is_some() && (is_transcript || is_division);
    if is_assembly_ai { 1000.0 } else { 1.0 }
}

/// Interval tiers with their names, as an object or a list. An entry is a list of start, end and label.
fn intervals(tiers: &Value) -> Result<Vec<(String, Vec<Word>)>> {
    let named: Vec<(&str, &Value)> = match tiers {
        Value::Object(tiers) => tiers.iter().map(|(name, tier)| (name.as_str(), tier)).collect(),
        _ => {
            let list = tiers.as_array().into_iter().flatten();
            list.map(|tier| (tier.get("name").and_then(Value::as_str).unwrap_or_default(), tier)).collect()
        }
    };
    let mut found = Vec::new();
    for (name, tier) in named {
        let entries = tier.get("entries").and_then(Value::as_array);
        // A point has one time.
        let entries = entries.into_iter().flatten().filter(|entry| entry.as_array().is_some_and(|e| e.len() == 3));
        let mut words = Vec::new();
        for (entry, n) in entries.zip(1..) {
            let at = || format!("tier {name}: interval {n}");
            let (start, end) = (entry.get(0).and_then(Value::as_f64), entry.get(1).and_then(Value::as_f64));
            let (Some(start), Some(end), Some(label)) = (start, end, entry.get(2).and_then(Value::as_str)) else {
                bail!("{}: expected two times and a text", at());
            };
            word::push(&mut words, label, (start, end), None).with_context(at)?;
        }
        found.push((name.to_owned(), words));
    }
    Ok(found)
}

/// Text, start and end, and confidence of a part of a word.
type Piece = (String, (Option<f64>, Option<f64>), Option<f64>);

struct JsonReader {
    per_sec: f64,
    collector: WordCollector,
}

impl JsonReader {
    fn times(&self, entry: &Value) -> (Option<f64>, Option<f64>) {
        times(entry, self.per_sec)
    }

    /// Whether any entry has a start.
    fn has_times(&self, entries: &[Value]) -> bool {
        entries.iter().any(|entry| self.times(entry).0.is_some())
    }

    /// Adds the words at any depth of `value`.
    fn add(&mut self, value: &Value) -> Result<()> {
        if let Value::Array(entries) = value {
            return entries.iter().try_for_each(|entry| self.add(entry));
        }
        let Value::Object(fields) = value else { return Ok(()) };
        // Vosk has its words under `result`.
        let of_vosk = list(value, "result").filter(|words| words.iter().all(|word| word.get("word").is_some()));
        if let Some(words) = list(value, "words").or(of_vosk) {
            let (start, end) = self.times(value);
            if let Some(start) = start {
                self.collector.begin(start);
            }
            self.add_words(words)?;
            if let Some(end) = end {
                self.collector.end(end);
            }
            return Ok(());
        }
        // A Whisper sentence without word times.
        if let ((Some(start), Some(end)), Some(sentence)) =
            (self.times(value), fields.get("text").and_then(Value::as_str))
        {
            return self.collector.push(sentence, (Some(start), Some(end)), None);
        }
        for (key, inner) in fields {
            match (key.as_str(), inner) {
                ("alternatives", Value::Array(alternatives)) => {
                    alternatives.first().map_or(Ok(()), |best| self.add(best))?;
                }
                // WhisperX lists its words twice, and AWS Transcribe those of several channels.
                ("word_segments", _) if fields.contains_key("segments") => {}
                ("channel_labels", _) if fields.contains_key("items") => {}
                ("segments" | "chunks", Value::Array(sentences)) => {
                    sentences.iter().try_for_each(|sentence| self.add_sentence(sentence))?;
                }
                ("items" | "results", Value::Array(items)) if items.iter().any(|item| content(item).is_some()) => {
                    self.add_items(items)?;
                }
                ("transcription", Value::Array(segments)) => self.add_pieces(segments)?,
                _ => self.add(inner)?,
            }
        }
        Ok(())
    }

    fn add_words(&mut self, words: &[Value]) -> Result<()> {
        for (entry, n) in words.iter().zip(1..) {
            let Some(word) = text(entry) else {
                bail!("word {n}: expected start_time, end_time and word, found {entry}")
            };
            // Words without times are estimated: WhisperX does not time numerals, nor Gentle words that are not audible.
            let (times, confidence) = (self.times(entry), confidence(entry));
            if let Some(start) = times.0 {
                self.collector.end(start);
            }
            let first = self.collector.n_words();
            self.collector.push(word, times, confidence).with_context(|| format!("word {n}"))?;
            let source = entry.get("source").and_then(|source| serde_json::from_value(source.clone()).ok());
            if let (Some(source), (Some(_), Some(_))) = (source, times) {
                self.collector.set_source(first, source);
            }
        }
        Ok(())
    }

    /// Adds a sentence, of which the words or the times may be missing.
    fn add_sentence(&mut self, sentence: &Value) -> Result<()> {
        match sentence.get("text").and_then(Value::as_str) {
            Some(text) if list(sentence, "words").is_none() => {
                let times = self.times(sentence);
                self.collector.push(text, times, None)
            }
            _ => self.add(sentence),
        }
    }

    /// Adds the items of AWS Transcribe: words with times, and punctuation without.
    fn add_items(&mut self, items: &[Value]) -> Result<()> {
        for (item, n) in items.iter().zip(1..) {
            let Some((text, confidence)) = content(item) else { continue };
            if item.get("type").is_some_and(|kind| kind == "punctuation") {
                self.collector.append(text);
            } else {
                let times = self.times(item);
                self.collector.push(text, times, confidence).with_context(|| format!("item {n}"))?;
            }
        }
        Ok(())
    }

    /// Adds the segments of whisper.cpp, or their tokens if these have times. One without a leading space continues the
    /// word before it, unless no text has leading spaces.
    fn add_pieces(&mut self, segments: &[Value]) -> Result<()> {
        let pieces = segments.iter().flat_map(|segment| match list(segment, "tokens") {
            Some(tokens) if self.has_times(tokens) => tokens,
            _ => std::slice::from_ref(segment),
        });
        let pieces = pieces.filter_map(|piece| {
            let text = text(piece).filter(|text| !text.starts_with("[_") && !text.starts_with("<|"))?;
            Some((text.to_owned(), self.times(piece), piece.get("p").and_then(Value::as_f64)))
        });
        let pieces: Vec<Piece> = pieces.collect();
        let has_spaces = pieces.iter().any(|(text, ..)| text.starts_with(' '));
        let mut words: Vec<Piece> = Vec::new();
        for (text, times, confidence) in pieces {
            let continues = has_spaces && !text.contains(char::is_whitespace);
            match words.last_mut().filter(|_| continues) {
                Some((word, (_, end), least)) => {
                    word.push_str(&text);
                    *end = times.1.or(*end);
                    *least = least.zip(confidence).map(|(a, b)| a.min(b));
                }
                None => words.push((text, times, confidence)),
            }
        }
        for ((text, times, confidence), n) in words.iter().zip(1..) {
            self.collector.push(text, *times, *confidence).with_context(|| format!("word {n}"))?;
        }
        Ok(())
    }
}

/// Text and confidence of an item of AWS Transcribe.
fn content(item: &Value) -> Option<(&str, Option<f64>)> {
    let best = list(item, "alternatives")?.first()?;
    Some((best.get("content")?.as_str()?, confidence(best)))
}
