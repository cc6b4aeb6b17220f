//! `orator transcribe` with a small network that recognises the same words in every sound.

use crate::fixtures::clips::tone;
use crate::fixtures::media::recogniser::write_recogniser;
use orator_base::types::sound::Sound;
use orator_formats::transcript::Transcript;
use orator_formats::wav;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Words that the network recognises.
const WORDS: [&str; 2] = ["the", "the"];

/// A folder with a sound of three seconds and the network.
struct Recording {
    dir: tempfile::TempDir,
}

impl Recording {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        write_recogniser(&dir.path().join("whisper"));
        wav::write(&dir.path().join("talk.wav"), &tone(16_000, 3.0, 200.0)).unwrap();
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Exit code, JSON output and errors.
    fn answer(&self, arguments: &[&str]) -> (i32, Value, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.args(["--json", "transcribe"]).args(arguments).args(["--set", "models.dir=models"]);
        let output = command.current_dir(self.dir.path()).output().unwrap();
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code().unwrap_or(-1), json, String::from_utf8_lossy(&output.stderr).into_owned())
    }

    /// Errors of a command that fails.
    #[track_caller]
    fn error(&self, arguments: &[&str]) -> String {
        let (code, _, errors) = self.answer(arguments);
        assert_eq!(code, 1, "{errors}");
        errors
    }

    #[track_caller]
    fn expect_no_scratch(&self) {
        let hidden = |folder: &Path| {
            let names = fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
            names.filter(|name| name.starts_with('.')).collect::<Vec<_>>()
        };
        assert_eq!(hidden(self.dir.path()), [""; 0]);
    }
}

fn words(path: &Path) -> Vec<String> {
    Transcript::read(path).unwrap().words.into_iter().map(|word| word.word).collect()
}

#[test]
fn words_of_a_sound_are_written_in_every_format() {
    let recording = Recording::new();
    for out in ["talk.json", "talk.srt", "talk.vtt", "talk.TextGrid"] {
        let (code, json, errors) =
            recording.answer(&["talk.wav", "--model", "whisper", "--language", "en", "--out", out]);
        assert_eq!(code, 0, "{errors}");
        let [written] = json["transcripts"].as_array().unwrap().as_slice() else { panic!("{json}") };
        assert!(written["words"] == 2 && written["secs"] == 3.0 && written["language"] == "en", "{json}");
        assert_eq!(words(&recording.path(out)), WORDS, "{out}");
    }
    let transcript = Transcript::read(&recording.path("talk.json")).unwrap();
    let is_inside = |secs: f64| (0.0..=3.0).contains(&secs);
    assert!(transcript.words.iter().all(|word| is_inside(word.start_secs) && is_inside(word.end_secs)));
    recording.expect_no_scratch();
}

#[test]
fn several_files_are_written_to_a_folder_and_one_may_fail() {
    let recording = Recording::new();
    fs::write(recording.path("broken.mp4"), "no film").unwrap();
    let arguments = ["talk.wav", "broken.mp4", "--model", "whisper", "--out", "texts", "--format", "vtt"];
    let (code, json, errors) = recording.answer(&arguments);
    assert!(code == 2 && errors.contains("broken.mp4"), "{errors}");
    assert!(json["transcripts"][0]["words"] == 2 && json["transcripts"][1]["error"].is_string(), "{json}");
    assert_eq!(words(&recording.path("texts/talk.vtt")), WORDS);
    assert!(!recording.path("texts/broken.vtt").exists());
    recording.expect_no_scratch();
    fs::create_dir(recording.path("copy")).unwrap();
    fs::copy(recording.path("talk.wav"), recording.path("copy/talk.wav")).unwrap();
    let errors = recording.error(&["talk.wav", "copy/talk.wav", "--model", "whisper", "--out", "texts"]);
    assert!(errors.contains("would both be written"), "{errors}");
}

#[test]
fn silence_short_and_narrow_band_sounds_are_transcripts() {
    let recording = Recording::new();
    let silence = Sound { rate: 16_000, samples: vec![0.0; 64_000] };
    let sounds = [("silence", silence), ("short", tone(16_000, 0.05, 200.0)), ("narrow", tone(8_000, 2.0, 200.0))];
    for (name, sound) in sounds {
        wav::write(&recording.path(name).with_extension("wav"), &sound).unwrap();
        let (input, out) = (format!("{name}.wav"), format!("{name}.json"));
        let (code, json, errors) = recording.answer(&[&input, "--model", "whisper", "--out", &out]);
        assert_eq!(code, 0, "{errors}");
        let n_words = words(&recording.path(&out)).len();
        assert_eq!(json["transcripts"][0]["words"], n_words, "{json}");
        assert_eq!(
            n_words,
            match name {
                "silence" => 0,
                "narrow" => 2,
                _ => n_words,
            }
        );
    }
}

#[test]
fn unusable_models_are_errors_with_the_command_that_fetches_one() {
    let recording = Recording::new();
    let talk = ["talk.wav", "--out", "talk.json"];
    let with = |arguments: &[&str]| recording.error(&[&talk[..], arguments].concat());
    let errors = with(&["--language", "en"]);
    assert!(errors.contains("`orator models fetch whisper-tiny-en`"), "{errors}");
    let errors = with(&[]);
    assert!(errors.contains("`orator models fetch whisper-base`") && errors.contains("--language en"), "{errors}");
    let errors = with(&["--model", "nothing"]);
    assert!(errors.contains("\"nothing\"") && errors.contains("whisper-tiny-en, whisper-base"), "{errors}");
    fs::create_dir(recording.path("empty")).unwrap();
    let errors = with(&["--model", "empty"]);
    assert!(errors.contains("empty") && errors.contains("model.bin"), "{errors}");
    let errors = with(&["--model", "whisper", "--language", "de"]);
    assert!(errors.contains("`de`") && errors.contains("`en`"), "{errors}");

    let weights = recording.path("whisper/model.bin");
    let bytes = fs::read(&weights).unwrap();
    for n_bytes in [0, 3, 40, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&weights, &bytes[..n_bytes]).unwrap();
        let errors = with(&["--model", "whisper"]);
        assert!(errors.contains("model.bin") && errors.contains("damaged"), "{n_bytes} bytes: {errors}");
    }
    // A spectrogram of other height: two lengths of a shape are exchanged.
    let mut other = bytes.clone();
    let name = b"encoder/conv1/weight\0\x03";
    let shape = name.len() + other.windows(name.len()).position(|part| part == name).unwrap();
    let (outputs, bands) = other[shape..shape + 8].split_at_mut(4);
    outputs.swap_with_slice(bands);
    let n_bands = u32::from_le_bytes(bands.try_into().unwrap());
    fs::write(&weights, other).unwrap();
    let errors = with(&["--model", "whisper"]);
    assert!(errors.contains(&format!("{n_bands} mel bands")), "{errors}");
    fs::remove_file(recording.path("whisper/tokenizer.json")).unwrap();
    fs::write(&weights, &bytes).unwrap();
    let errors = with(&["--model", "whisper"]);
    assert!(errors.contains("tokenizer.json"), "{errors}");
    assert!(!recording.path("talk.json").exists());
}

#[test]
fn invalid_arguments_and_inputs_are_errors() {
    let recording = Recording::new();
    fs::write(recording.path("text.txt"), "- ...").unwrap();
    fs::write(recording.path("text.srt"), "").unwrap();
    let with = |arguments: &[&str]| recording.error(&[arguments, &["--model", "whisper"]].concat());
    assert!(with(&["talk.wav", "--out", "talk.txt"]).contains(".json, .srt, .vtt or .TextGrid"));
    assert!(with(&["talk.wav", "--text", "text.srt", "--out", "text.srt"]).contains("is an input"));
    assert!(with(&["talk.wav", "--text", "text.txt", "--out", "a.json"]).contains("contains no words"));
    assert!(with(&["talk.wav", "talk.wav", "--text", "text.txt", "--out", "."]).contains("--text: expected one"));
    assert!(with(&["absent.wav", "--out", "a.json"]).contains("absent.wav"));
    assert!(with(&["text.txt", "--out", "a.json"]).contains("text.txt"));
    assert!(!recording.path("a.json").exists());
    recording.expect_no_scratch();
}
