//! Writers of recognised or aligned speech: JSON as WhisperX writes it, SubRip, WebVTT with word times, and TextGrid.
//! The readers of this folder give back the words and their times, except that words of SubRip share that of their cue.

use super::word::{Word, WordSource};
use anyhow::{Result, bail};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Limits of a cue of subtitles: characters per line, lines, seconds, and seconds of a pause that ends it.
const MAX_CHARS: usize = 42;
const MAX_LINES: usize = 2;
const MAX_SECS: f64 = 7.0;
const MAX_PAUSE_SECS: f64 = 1.0;
/// Shortest cue in seconds, unless the next one begins before.
const MIN_SECS: f64 = 1.0;

/// File format of a written transcript.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TranscriptFormat {
    Json,
    Srt,
    Vtt,
    TextGrid,
}

/// A sentence or phrase. Times are in seconds from the start of the audio; words are sorted by time.
#[derive(Clone, Debug, PartialEq)]
pub struct SpokenSegment {
    pub start_secs: f64,
    pub end_secs: f64,
    pub text: String,
    pub words: Vec<Word>,
}

impl TranscriptFormat {
    /// The format of a file name.
    ///
    /// # Errors
    ///
    /// Another extension.
    pub fn from_path(path: &Path) -> Result<Self> {
        Ok(match path.extension().unwrap_or_default().to_ascii_lowercase().to_str() {
            Some("json") => Self::Json,
            Some("srt") => Self::Srt,
            Some("vtt") => Self::Vtt,
            Some("textgrid") => Self::TextGrid,
            _ => bail!("{}: expected a file that ends in .json, .srt, .vtt or .TextGrid", path.display()),
        })
    }

    /// Contents of the file. `language` is the code of the language, such as `en`; `secs` is the length of the audio.
    pub fn write(self, segments: &[SpokenSegment], language: &str, secs: f64) -> String {
        let words: Vec<&Word> = segments.iter().flat_map(|segment| &segment.words).collect();
        match self {
            Self::Json => format!("{:#}\n", json_of(segments, language)),
            Self::Srt => srt(&cues(&words)),
            Self::Vtt => vtt(&cues(&words)),
            Self::TextGrid => text_grid(&words, secs),
        }
    }
}

/// Times in whole milliseconds.
fn milliseconds(secs: f64) -> u64 {
    (1000.0 * secs.max(0.0)).round() as u64
}

fn json_of(segments: &[SpokenSegment], language: &str) -> Value {
    let secs = |secs: f64| milliseconds(secs) as f64 / 1000.0;
    let word = |word: &Word| {
        let mut value = json!({ "word": word.word, "start": secs(word.start_secs), "end": secs(word.end_secs) });
        if let Some(score) = word.confidence {
            value["score"] = json!((1000.0 * score).round() / 1000.0);
        }
        if word.source != WordSource::Given {
            value["source"] = json!(word.source);
        }
        value
    };
    let segment = |of: &SpokenSegment| {
        let words: Vec<Value> = of.words.iter().map(word).collect();
        json!({ "start": secs(of.start_secs), "end": secs(of.end_secs), "text": of.text, "words": words })
    };
    let words: Vec<Value> = segments.iter().flat_map(|segment| &segment.words).map(word).collect();
    let segments: Vec<Value> = segments.iter().map(segment).collect();
    json!({ "segments": segments, "word_segments": words, "language": language })
}

/// Words that are shown together, in lines; times in milliseconds.
struct WordCue<'a> {
    start: u64,
    end: u64,
    lines: Vec<Vec<&'a Word>>,
}

impl WordCue<'_> {
    /// Text of each line.
    fn texts(&self) -> Vec<String> {
        let text = |line: &Vec<&Word>| line.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" ");
        self.lines.iter().map(text).collect()
    }
}

fn n_chars(line: &[&Word]) -> usize {
    line.iter().map(|word| word.word.chars().count() + 1).sum()
}

/// Divides words into cues of at most two lines and seven seconds, at pauses and at the ends of sentences that fill a
/// line.
fn cues<'a>(words: &[&'a Word]) -> Vec<WordCue<'a>> {
    let mut cues: Vec<WordCue<'a>> = Vec::new();
    for &word in words {
        let (start, end) = (milliseconds(word.start_secs), milliseconds(word.end_secs.max(word.start_secs)));
        let new = || WordCue { start, end, lines: vec![vec![word]] };
        let Some(cue) = cues.last_mut() else {
            cues.push(new());
            continue;
        };
        let (n_lines, line) = (cue.lines.len(), cue.lines.last().map(Vec::as_slice).unwrap_or_default());
        let is_full = n_chars(line) + word.word.chars().count() > MAX_CHARS;
        let ends_sentence = line.last().is_some_and(|last| last.word.ends_with(['.', '?', '!']));
        let begins_cue = (is_full && n_lines == MAX_LINES)
            || (ends_sentence && (is_full || n_lines > 1))
            || end.saturating_sub(cue.start) > milliseconds(MAX_SECS)
            || start.saturating_sub(cue.end) >= milliseconds(MAX_PAUSE_SECS);
        if begins_cue {
            cues.push(new());
            continue;
        }
        cue.end = cue.end.max(end);
        match cue.lines.last_mut().filter(|_| !is_full) {
            Some(line) => line.push(word),
            None => cue.lines.push(vec![word]),
        }
    }
    let starts: Vec<u64> = cues.iter().skip(1).map(|cue| cue.start).chain([u64::MAX]).collect();
    for (cue, next) in cues.iter_mut().zip(starts) {
        let shown = cue.end.max(cue.start + milliseconds(MIN_SECS));
        cue.end = shown.min(next).max(cue.start + 1);
    }
    cues
}

/// Time of subtitles, with `point` before the milliseconds.
fn time(ms: u64, point: char) -> String {
    let secs = ms / 1000;
    format!("{:02}:{:02}:{:02}{point}{:03}", secs / 3600, secs / 60 % 60, secs % 60, ms % 1000)
}

fn srt(cues: &[WordCue]) -> String {
    let mut text = String::new();
    for (cue, n) in cues.iter().zip(1..) {
        let lines = cue.texts().join("\n");
        let _ = write!(text, "{n}\n{} --> {}\n{lines}\n\n", time(cue.start, ','), time(cue.end, ','));
    }
    text
}

/// WebVTT with the end of each word, if that is not the end of the cue, and the start of the next one.
fn vtt(cues: &[WordCue]) -> String {
    let escaped = |word: &str| word.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let mut text = "WEBVTT\n\n".to_owned();
    let mut previous: Vec<String> = Vec::new();
    for (cue, n) in cues.iter().zip(0..) {
        let _ = writeln!(text, "{} --> {}", time(cue.start, '.'), time(cue.end, '.'));
        let texts = cue.texts();
        if n > 0 && (texts == previous || texts.first() == previous.last()) {
            // Readers of rolling captions would skip the line as a repetition, and also an equal empty line before it.
            text.push_str(if n % 2 == 0 { "<c></c>\n" } else { "<c>&nbsp;</c>\n" });
        }
        let mut at = cue.start;
        let mut mark = |text: &mut String, ms: u64| {
            if ms > at && ms < cue.end {
                at = ms;
                let _ = write!(text, "<{}>", time(ms, '.'));
            }
        };
        for (n, line) in cue.lines.iter().enumerate() {
            text.push_str(if n > 0 { "\n" } else { "" });
            for (n, word) in line.iter().enumerate() {
                text.push_str(if n > 0 { " " } else { "" });
                mark(&mut text, milliseconds(word.start_secs));
                text.push_str(&escaped(&word.word));
                mark(&mut text, milliseconds(word.end_secs));
            }
        }
        text.push_str("\n\n");
        previous = texts;
    }
    text
}

/// TextGrid with the tier `words`. Its intervals follow each other without gaps, so overlaps of words are shared out.
fn text_grid(words: &[&Word], secs: f64) -> String {
    let mut intervals: Vec<(u64, u64, String)> = Vec::new();
    let mut at = 0;
    for word in words {
        let start = milliseconds(word.start_secs).max(at);
        let end = milliseconds(word.end_secs).max(start + 1);
        intervals.extend((start > at).then(|| (at, start, String::new())));
        intervals.push((start, end, word.word.replace('"', "\"\"")));
        at = end;
    }
    let end = milliseconds(secs).max(at);
    intervals.extend((end > at || intervals.is_empty()).then(|| (at, end, String::new())));
    let secs = |ms: u64| ms as f64 / 1000.0;
    let mut text = format!(
        "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\nxmin = 0\nxmax = {}\ntiers? <exists>\nsize = 1\n\
         item []:\n    item [1]:\n        class = \"IntervalTier\"\n        name = \"words\"\n        xmin = 0\n        \
         xmax = {}\n        intervals: size = {}\n",
        secs(end),
        secs(end),
        intervals.len()
    );
    for ((start, end, word), n) in intervals.iter().zip(1..) {
        let _ = write!(
            text,
            "        intervals [{n}]:\n            xmin = {}\n            xmax = {}\n            text = \"{word}\"\n",
            secs(*start),
            secs(*end)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(word: &str, start_secs: f64, end_secs: f64) -> Word {
        Word { word: word.to_owned(), start_secs, end_secs, source: WordSource::Given, confidence: Some(0.875) }
    }

    fn segment(words: Vec<Word>) -> SpokenSegment {
        let text = words.iter().map(|word| word.word.as_str()).collect::<Vec<_>>().join(" ");
        let (start_secs, end_secs) = (words[0].start_secs, words[words.len() - 1].end_secs);
        SpokenSegment { start_secs, end_secs, text, words }
    }

    /// Words with spaces between them, marks that need escapes, repetitions and an hour without speech.
    fn spoken() -> Vec<SpokenSegment> {
        let mut words = vec![word("So,", 0.5, 0.75), word("AT&T", 0.75, 1.0), word("said", 1.125, 1.5)];
        words.extend([word("\"no\"", 1.5, 1.75), word("<3", 2.0, 2.25)]);
        let repeated =
            (0..5).map(|n| segment(vec![word("Yes.", 10.0 + 4.0 * f64::from(n), 10.25 + 4.0 * f64::from(n))]));
        let long =
            (0..60).map(|n| word(["one", "of", "several"][n % 3], 3700.0 + 0.25 * n as f64, 3700.25 + 0.25 * n as f64));
        let mut segments = vec![segment(words)];
        segments.extend(repeated);
        segments.push(segment(long.collect()));
        segments
    }

    #[test]
    fn cues_are_short_and_end_at_pauses() {
        let segments = spoken();
        let words: Vec<&Word> = segments.iter().flat_map(|segment| &segment.words).collect();
        let cues = cues(&words);
        for cue in &cues {
            assert!(cue.end > cue.start && cue.end - cue.start <= 7000 && cue.lines.len() <= MAX_LINES);
            assert!(cue.texts().iter().all(|line| line.chars().count() <= MAX_CHARS));
        }
        assert!(cues.windows(2).all(|pair| pair[0].end <= pair[1].start));
        // Five repetitions four seconds apart; a short cue stays for a second.
        let repeated: Vec<&WordCue> = cues.iter().filter(|cue| cue.texts() == ["Yes."]).collect();
        assert!(repeated.len() == 5 && repeated.iter().all(|cue| cue.end - cue.start == 1000));
    }
}
