//! Transcripts, read by file extension: `.json` (recognisers), `.tsv`, `.ctm`, `.srt`, `.vtt`, `.TextGrid`, or words
//! without times from `.txt`. Impossible times are errors with their position, doubtful ones are notes.

use super::json::JsonTranscript;
use super::word::{self, Word, WordSource};
use super::{encoding, json, marks, subtitles, textgrid};
use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use std::collections::BTreeSet;
use std::path::Path;

/// File extensions of transcripts, in order of preference.
pub const ENDINGS: [&str; 7] = ["tsv", "json", "TextGrid", "ctm", "srt", "vtt", "txt"];

/// Maximum size of a transcript, 256 MiB: a hundred days of speech.
const MAX_BYTES: u64 = 256 << 20;
/// Overlap of consecutive words that is not noted, seconds: the rounding of recognisers.
const OVERLAP_SECS: f64 = 0.02;

/// A transcript; `words` is empty if it has no times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transcript {
    pub text: String,
    /// Words sorted by start time.
    pub words: Vec<Word>,
    /// One sentence for each doubtful property.
    pub notes: Vec<String>,
}

impl Transcript {
    /// Creates a transcript without times.
    pub fn of_text(text: &str) -> Self {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let note = match text.is_empty() {
            true => "the transcript holds no word",
            false => "the transcript has no times",
        };
        Self { text, words: Vec::new(), notes: vec![note.to_owned()] }
    }

    /// Creates a transcript of words with times, sorted by start time.
    pub fn of_words(mut words: Vec<Word>) -> Self {
        let disorder = words.windows(2).find(|pair| pair[1].start_secs < pair[0].start_secs);
        let disorder = disorder.map(|pair| {
            format!(
                "`{}` at {:.2} s is said behind `{}` at {:.2} s: the words were sorted",
                pair[1].word, pair[1].start_secs, pair[0].word, pair[0].start_secs
            )
        });
        words.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        // A mark such as `[loud music]` may consist of several words with times.
        let tokens: Vec<&str> = words.iter().map(|word| word.word.as_str()).collect();
        let mut are_spoken = marks::are_spoken(&tokens).into_iter();
        words.retain(|_| are_spoken.next().unwrap_or(true));
        let mut notes: Vec<String> = disorder.into_iter().chain(overlaps(&words)).chain(untimed(&words)).collect();
        if words.is_empty() {
            notes.push("the transcript holds no word".to_owned());
        }
        let text = words.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" ");
        Self { text, words, notes }
    }

    /// Reads a transcript of one speaker in the format of its file extension.
    pub fn read(path: &Path) -> Result<Self> {
        Self::of_speaker(path, "")
    }

    /// Reads a transcript in the format of its file extension; `speaker` selects the words in a file of several speakers.
    ///
    /// # Errors
    ///
    /// The file is unreadable, larger than 256 MiB, in another encoding or not a transcript, or has several speakers of
    /// other names; the message names the line or the word.
    pub fn of_speaker(path: &Path, speaker: &str) -> Result<Self> {
        let reading = || format!("cannot read {}", path.display());
        let bytes = input::read(path, MAX_BYTES).with_context(reading)?;
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let read = encoding::text_of(&bytes).and_then(|text| Self::parse(&text, &ending, (&*stem, speaker)));
        read.with_context(|| format!("{} is not a valid transcript", path.display()))
    }

    /// Parses text in the format of a lower-case file extension; `stem` selects the recording in a file of several,
    /// `speaker` the person.
    ///
    /// # Errors
    ///
    /// The line or the word that does not conform to the format; several recordings or speakers of other names.
    pub fn parse(text: &str, ending: &str, (stem, speaker): (&str, &str)) -> Result<Self> {
        let without_marks = |text: &str| Self::of_text(&marks::spoken(text).join(" "));
        let words = match ending {
            "tsv" => tsv(text)?,
            "ctm" => ctm(text, stem)?,
            "srt" | "vtt" => subtitles::read(text)?,
            "textgrid" => textgrid::read(text, speaker)?,
            "json" => match json::read(text, speaker)? {
                JsonTranscript::Words(words) => words,
                JsonTranscript::Text(text) => return Ok(without_marks(&text)),
            },
            _ => return Ok(without_marks(text)),
        };
        Ok(Self::of_words(words))
    }

    /// Transcript of the words that start before `end` seconds; a transcript without times is returned unchanged.
    pub fn until(&self, end: f64) -> Self {
        if self.words.is_empty() {
            return self.clone();
        }
        Self::of_words(self.words.iter().filter(|word| word.start_secs < end).cloned().collect())
    }
}

/// Words of a tab-separated table, one word or sentence per row: start, end and text in seconds (GENEA 2022 and
/// 2023), or in milliseconds with the header `start end text` (Whisper). Errors name the line.
fn tsv(text: &str) -> Result<Vec<Word>> {
    let mut words = Vec::new();
    let mut per_sec = 1.0;
    for (line, n) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let mut parts = line.splitn(3, '\t').map(str::trim);
        let (Some(start), Some(end), Some(text)) = (parts.next(), parts.next(), parts.next()) else {
            bail!("line {n}: expected start, end and word separated by tabs, found `{line}`");
        };
        match (start.parse::<f64>(), end.parse::<f64>()) {
            (Ok(start), Ok(end)) => word::push(&mut words, text, (start / per_sec, end / per_sec), None)
                .with_context(|| format!("line {n}"))?,
            // Header line.
            _ if n == 1 => per_sec = if (start, end, text) == ("start", "end", "text") { 1000.0 } else { 1.0 },
            _ => bail!("line {n}: expected seconds, found `{start}` and `{end}`"),
        }
    }
    Ok(words)
}

/// Words of the recording `name`, or of the only recording, in CTM of NIST's scoring tools and of Kaldi: recording,
/// channel, start, duration, word and optionally confidence. Errors: an invalid row (with its line); several
/// recordings, none of which has this name.
fn ctm(text: &str, name: &str) -> Result<Vec<Word>> {
    let rows = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty() && !line.starts_with(";;"));
    let recordings: BTreeSet<&str> =
        rows.clone().filter_map(|(line, _)| line.split_whitespace().next()).take(1 << 20).collect();
    ensure!(
        recordings.len() <= 1 || recordings.contains(name),
        "no recording is named {name}: found {} recordings ({}, ...)",
        recordings.len(),
        recordings.first().copied().unwrap_or_default()
    );
    let mut words = Vec::new();
    for (line, n) in rows {
        let parts: Vec<&str> = line.split_whitespace().collect();
        let number = |at: usize| parts.get(at).and_then(|part| part.parse::<f64>().ok());
        let (Some(start), Some(secs), Some(text)) = (number(2), number(3), parts.get(4)) else {
            bail!("line {n}: expected recording, channel, start, duration and word, found `{line}`");
        };
        if recordings.len() == 1 || parts[0] == name {
            word::push(&mut words, text, (start, start + secs), number(5)).with_context(|| format!("line {n}"))?;
        }
    }
    Ok(words)
}

/// Note on words that start after the end of the audio at `sound_secs`.
pub fn after_end(words: &[Word], sound_secs: f64) -> Option<String> {
    let mut outside = words.iter().filter(|word| word.start_secs >= sound_secs);
    let first = outside.next()?;
    Some(format!(
        "{} of {} words are said after the end of the sound ({sound_secs:.2} s), the first `{}` at {:.2} s: is it the \
         transcript of another sound?",
        1 + outside.count(),
        words.len(),
        first.word,
        first.start_secs
    ))
}

/// Note on words that start before the previous word ends.
fn overlaps(words: &[Word]) -> Option<String> {
    let over = |pair: &[Word]| pair[0].end_secs - pair[1].start_secs;
    let pairs = words.windows(2).filter(|pair| over(pair) > OVERLAP_SECS);
    let first = pairs.clone().next()?;
    Some(format!(
        "{} of {} words begin before the one before ends, the first `{}` at {:.2} s, {:.2} s too early",
        pairs.count(),
        words.len(),
        first[1].word,
        first[1].start_secs,
        over(first)
    ))
}

/// Note on words whose times were shared or interpolated.
fn untimed(words: &[Word]) -> Option<String> {
    let shared = words.iter().filter(|word| word.source == WordSource::Shared).count();
    let between = words.iter().filter(|word| word.source == WordSource::Interpolated).count();
    let n = words.len();
    match (shared, between) {
        (0, 0) => None,
        (0, _) => {
            Some(format!("{between} of {n} words have no times of their own, but those between their neighbours"))
        }
        _ => Some(format!("{shared} of {n} words share the time of their sentence")),
    }
}
