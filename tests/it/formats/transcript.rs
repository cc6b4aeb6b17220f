//! Transcripts in every format, their errors and notes.

use anyhow::Result;
use orator_formats::transcript::Transcript;

fn parse(text: &str, ending: &str) -> Result<Transcript> {
    Transcript::parse(text, ending, ("a", ""))
}

fn words_of(text: &str, ending: &str) -> String {
    let words = parse(text, ending).unwrap().words;
    let words = words.iter().map(|w| format!("{}@{}-{}", w.word, w.start_secs, w.end_secs));
    words.collect::<Vec<_>>().join(" ")
}

fn error_of(text: &str, ending: &str) -> String {
    format!("{:#}", parse(text, ending).unwrap_err())
}

#[test]
fn every_format_yields_the_same_words() {
    let expected = "so@0.5-0.7 well@1-1.25";
    assert_eq!(words_of("0.5\t0.7\tso\n1.0\t1.25\twell\n", "tsv"), expected);
    assert_eq!(words_of("start\tend\tword\n1.0\t1.25\twell\n\n0.5\t0.7\tso\n", "tsv"), expected);
    assert_eq!(words_of("start\tend\ttext\n500\t700\tso\n1000\t1250\twell\n", "tsv"), expected);
    assert_eq!(words_of("a 1 0.5 0.2 so 0.9\na 1 1 0.25 well\n", "ctm"), expected);
    assert_eq!(words_of(";; b\nb 1 9 1 no\na 1 0.5 0.2 so\na 1 1.0 0.25 well\n", "ctm"), expected);
    let plain = r#"[{"start": 0.5, "end": 0.7, "word": "so"}, {"start": 1, "end": 1.25, "word": "well"}]"#;
    assert_eq!(words_of(plain, "json"), expected);
    let whisper = r#"{"text": " so well", "language": "en", "segments": [{"id": 0, "start": 0.5, "end": 1.25,
        "text": " so well", "words": [{"word": " so", "start": 0.5, "end": 0.7, "probability": 0.8},
        {"word": " well", "start": 1.0, "end": 1.25, "probability": 0.9}]}]}"#;
    assert_eq!(words_of(whisper, "json"), expected);
    assert_eq!(parse(whisper, "json").unwrap().words[0].confidence, Some(0.8));
    let without_words = r#"{"text": " so well", "segments": [{"start": 0.5, "end": 2.0, "text": " so well"}]}"#;
    assert_eq!(words_of(without_words, "json"), "so@0.5-1 well@1-2");
    assert!(parse(without_words, "json").unwrap().notes[0].contains("2 of 2 words share"));
    assert_eq!(parse(r#"{"text": "so  well"}"#, "json").unwrap(), Transcript::of_text("so well"));
}

#[test]
fn errors_name_the_position_and_until_cuts_words() {
    assert!(error_of("0 1 so\n", "tsv").contains("line 1"));
    assert!(error_of("0\t1\tso\n2\tx\twell", "tsv").contains("line 2"));
    assert!(error_of("2\t1\tso\n", "tsv").contains("invalid times 2.00 to 1.00"));
    assert!(error_of("-1\t1\tso\n", "tsv").contains("line 1: invalid times -1.00"));
    assert!(error_of("a 1 0.5 0.2\n", "ctm").contains("line 1"));
    assert!(error_of("b 1 0 1 so\nc 1 0 1 so\n", "ctm").contains("no recording is named a"));
    assert!(parse("{", "json").is_err() && parse("{}", "json").is_err());
    assert!(error_of(r#"{"words": [{"word": "so"}]}"#, "json").contains("word 1"));
    let transcript = parse("0.5\t0.7\tso\n1.0\t1.25\twell\n", "tsv").unwrap();
    assert_eq!((transcript.notes.len(), transcript.until(1.0).text.as_str()), (0, "so"));
    assert_eq!(transcript.until(1.1).text, "so well");
    assert_eq!(Transcript::of_text(" a\nb ").until(0.1).text, "a b");
}

#[test]
fn doubtful_times_are_noted() {
    let notes = |text: &str, ending: &str| parse(text, ending).unwrap().notes.join("; ");
    assert!(notes("0\t1\tso\n0.5\t2\twell\n", "tsv").contains("1 of 2 words begin before"));
    assert!(notes("1\t2\tso\n0.5\t0.9\twell\n", "tsv").contains("`well` at 0.50 s is said behind `so`"));
    for (empty, ending) in [("", "txt"), ("", "tsv"), ("", "srt"), ("[]", "json"), ("", "ctm")] {
        assert_eq!(notes(empty, ending), "the transcript holds no word", "{ending}");
    }
    assert!(notes("so well", "txt").contains("no times"));
}
