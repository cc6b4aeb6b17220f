//! Recognised words, written as transcripts and read back.

use orator_formats::transcript::Transcript;
use orator_formats::transcript::word::{Word, WordSource};
use orator_formats::transcript::write::{SpokenSegment, TranscriptFormat};
use std::path::Path;

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
    let repeated = (0..5).map(|n| segment(vec![word("Yes.", 10.0 + 4.0 * f64::from(n), 10.25 + 4.0 * f64::from(n))]));
    let long =
        (0..60).map(|n| word(["one", "of", "several"][n % 3], 3700.0 + 0.25 * n as f64, 3700.25 + 0.25 * n as f64));
    let mut segments = vec![segment(words)];
    segments.extend(repeated);
    segments.push(segment(long.collect()));
    segments
}

fn read(format: TranscriptFormat, segments: &[SpokenSegment]) -> Vec<Word> {
    let ending = format!("{format:?}").to_lowercase();
    let text = format.write(segments, "en", 4000.0);
    Transcript::parse(&text, &ending, ("a", "")).unwrap_or_else(|error| panic!("{error:#}\n{text}")).words
}

#[test]
fn words_and_times_are_read_back() {
    let segments = spoken();
    let words: Vec<Word> = segments.iter().flat_map(|segment| segment.words.clone()).collect();
    assert_eq!(read(TranscriptFormat::Json, &segments), words);
    for format in [TranscriptFormat::Vtt, TranscriptFormat::TextGrid] {
        let found = read(format, &segments);
        assert_eq!(found.len(), words.len(), "{format:?}");
        for (found, expected) in found.iter().zip(&words) {
            let is_near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            let is_same_time =
                is_near(found.start_secs, expected.start_secs) && is_near(found.end_secs, expected.end_secs);
            assert!(found.word == expected.word && is_same_time, "{format:?}: {found:?} {expected:?}");
        }
    }
    // SubRip has no escapes.
    let found: Vec<String> = read(TranscriptFormat::Srt, &segments).into_iter().map(|word| word.word).collect();
    let texts: Vec<&str> = words.iter().map(|word| word.word.as_str()).filter(|text| *text != "<3").collect();
    assert_eq!(found, texts);
}

#[test]
fn aligned_and_estimated_words_keep_their_source() {
    let source = |source, confidence| Word { source, confidence: Some(confidence), ..word("so", 1.0, 1.5) };
    let words = vec![source(WordSource::Aligned, 0.5), source(WordSource::Interpolated, 0.0)];
    assert_eq!(read(TranscriptFormat::Json, &[segment(words.clone())]), words);
}

#[test]
fn no_speech_is_a_valid_transcript() {
    for format in [TranscriptFormat::Json, TranscriptFormat::Srt, TranscriptFormat::Vtt, TranscriptFormat::TextGrid] {
        assert!(read(format, &[]).is_empty(), "{format:?}");
    }
    let path = |name: &str| TranscriptFormat::from_path(Path::new(name)).ok();
    assert_eq!(
        (path("a.TextGrid"), path("a.words.json")),
        (Some(TranscriptFormat::TextGrid), Some(TranscriptFormat::Json))
    );
    assert_eq!((path("a.txt"), path("json")), (None, None));
}

#[test]
fn overlapping_words_and_words_without_length_are_written() {
    let words = vec![word("a", 1.0, 2.0), word("b", 1.5, 1.75), word("c", 2.5, 2.5)];
    for format in [TranscriptFormat::Json, TranscriptFormat::Srt, TranscriptFormat::Vtt, TranscriptFormat::TextGrid] {
        let found = read(format, &[segment(words.clone())]);
        assert_eq!(found.iter().map(|word| word.word.as_str()).collect::<String>(), "abc", "{format:?}");
    }
}
