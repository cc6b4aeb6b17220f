//! Transcripts of imported takes: one that cannot be read costs no take, and the next file of its name is read.

use super::import::{bvh, plan, samples, wav, write};
use crate::foreign::transcripts::FORMATS;
use orator_base::stage::ledger::TranscriptReport;
use orator_base::stage::progress::Silent;
use orator_dataset::import::import;
use orator_dataset::verify::verify::{read_ledgers, verify};
use std::fs;

/// A face tracker's file, as it lies beside the words in some datasets.
const TRACKER: &str = r#"{"names": ["jawOpen"], "frames": [{"weights": [0.5], "time": 0.1, "rotation": []}]}"#;

/// An imported take.
struct ImportedWords {
    /// Words of the sample; `None`: the sample has no list of words.
    words: Option<String>,
    message: String,
    report: Option<TranscriptReport>,
}

/// Imports a take of 5.3 s of `speaker` with these transcripts (name, content), which must be accepted.
fn imported(transcripts: &[(&str, &str)], speaker: &str) -> ImportedWords {
    let dir = tempfile::tempdir().unwrap();
    let (source, out) = (dir.path().join("in"), dir.path().join("out"));
    write(source.join("take.bvh"), &bvh(160));
    wav(&source.join("take.wav"), 5.3, 1);
    transcripts.iter().for_each(|(name, text)| write(source.join(name), text));
    fs::create_dir_all(&out).unwrap();
    let mut plan = plan(&[&source]);
    speaker.clone_into(&mut plan.about.speaker);
    let imported = import(&plan, &out, &Silent).unwrap();
    assert_eq!((imported.lines.len(), imported.lines[0].outcome), (1, "kept"), "{:?}", imported.lines);
    assert_eq!(verify(&out, true, &Silent).unwrap().problems, []);
    let (sample, _) = samples(&out).into_values().next().unwrap();
    let words = sample.words.map(|words| {
        let words = words.iter().map(|word| format!("{} {}-{}", word.word, word.start_secs, word.end_secs));
        words.collect::<Vec<_>>().join(", ")
    });
    let report = read_ledgers(&out).unwrap().remove(0).ledger.words;
    let ledger = fs::read_to_string(out.join("ledger.jsonl")).unwrap();
    assert!(!ledger.contains(source.to_str().unwrap()), "{ledger}");
    ImportedWords { words, message: imported.lines[0].message.clone(), report }
}

fn text_grid(name: &str) -> &'static str {
    FORMATS.into_iter().find(|format| format.name == name && format.ending == "TextGrid").unwrap().text
}

#[test]
fn an_unreadable_transcript_costs_no_take() {
    for (name, text, expected) in [
        ("take.json", "{", "take.json is not a valid transcript: it is not valid JSON"),
        ("take.json", TRACKER, "take.json is not a valid transcript: expected `words` with times"),
        ("take.tsv", "so well", "take.tsv is not a valid transcript: line 1: expected start, end and word"),
        ("take.srt", "1\n00:00:02,000 --> 00:00:01,000\nso\n", "take.srt is not a valid transcript: line 2"),
        ("take.TextGrid", "so", "the file has no interval tier"),
        ("take.ctm", "other 1 0 1 so\nmore 1 0 1 so\n", "no recording is named take"),
        ("take.tsv", "91\t92\ta\n92\t93\tb\n93\t94\tc\n94\t95\td\n", "4 of 4 words lie after the end of the sound"),
    ] {
        let ImportedWords { words, message, report } = imported(&[(name, text)], "host");
        assert!(message.contains(expected), "{name}: {message}");
        assert_eq!(words.as_deref(), Some(""), "{name}");
        let report = report.unwrap();
        assert_eq!((report.file.as_deref(), report.count.n_words), (Some(name), 0));
    }
    // Text without times gives no list of words.
    let ImportedWords { words, message, report } = imported(&[("take.txt", "so well")], "host");
    assert_eq!((words, report), (None, None));
    assert!(message.contains("the transcript has no times"), "{message}");
}

#[test]
fn the_next_transcript_of_the_take_is_read() {
    let penn = text_grid("penn");
    let ImportedWords { words, message, report } = imported(&[("take.json", TRACKER), ("take.TextGrid", penn)], "host");
    assert_eq!(words.as_deref(), Some("RAIN 0.2-0.6, FALLS 1-1.5"));
    assert!(
        message.contains("take.json is not a valid transcript") && message.contains("take.TextGrid was read instead")
    );
    assert_eq!(report.unwrap().file.as_deref(), Some("take.TextGrid"));
    // Words with times take precedence over text.
    let both = imported(&[("take.json", r#"{"text": "so"}"#), ("take.TextGrid", penn)], "host");
    assert!(both.words == words && !both.message.contains("transcript"), "{}", both.message);
}

#[test]
fn the_words_of_the_named_speaker_are_imported() {
    let transcripts = [("take.TextGrid", text_grid("speakers"))];
    let of = |speaker: &str| imported(&transcripts, speaker);
    assert_eq!(of("HOST").words.as_deref(), Some("\"rain\" 0.2-0.6, falls 1-1.5"));
    assert_eq!(of("guest").words.as_deref(), Some("no 0-2"));
    let other = of("anna");
    assert_eq!(other.words.as_deref(), Some(""));
    assert!(other.message.contains("(Guest, Host)") && other.message.contains("--speaker"), "{}", other.message);
}

#[test]
fn the_command_reports_an_unreadable_transcript_as_a_note() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path().join("in/take.bvh"), &bvh(160));
    wav(&dir.path().join("in/take.wav"), 5.3, 1);
    write(dir.path().join("in/take.json"), TRACKER);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orator"));
    let args = ["--json", "import", "in", "--speaker", "host", "--out", "out"];
    let output = command.current_dir(dir.path()).args(args).output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), json["imported"].as_u64(), json["failed"].as_u64()), (Some(0), Some(1), Some(0)));
    assert!(json["takes"][0]["message"].as_str().unwrap().contains("take.json is not a valid transcript"), "{json}");
}
