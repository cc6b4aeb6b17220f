//! `orator align` on speech synthesised by espeak-ng, with known word times, using the Python package pocketsphinx
//! (`make aligner`). `ORATOR_LONG=1` (`make prove`) aligns more than eight minutes of speech, otherwise half a minute.

use orator_formats::transcript::{Transcript, WordSource};
use orator_test_support::skip::{aligner, skip};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SENTENCES: [&str; 14] = [
    "Good evening, everybody.",
    "Today I want to talk about the way that people move their hands while they speak.",
    "When we explain something difficult, our fingers draw shapes in the air, and the listener understands us better.",
    "She paid 350 dollars for a ticket in 1998.",
    "Some researchers believe that gestures help the speaker to find the right words.",
    "Others think that they are a second language, older than the one we write.",
    "In my first year at the university, I watched hundreds of hours of video, and I counted every movement.",
    "Nobody paid me for that work.",
    "Please put the blue box next to the window.",
    "It's a matter of trust, and of patience.",
    "We went through the forest, across the river, and up the hill.",
    "The weather in Chicago was terrible last winter.",
    "Kubernetes and TypeScript are words no dictionary from that time contains.",
    "Can you hear me now, or should I speak a little louder?",
];
const UNRELATED_TEXT: &str = "the committee met on tuesday to consider a proposal from the ministry of agriculture \
    concerning the price of wheat and barley members asked whether farmers in the northern provinces would receive \
    any support during winter the chairman replied that money was short and that every department had been told to \
    save a tenth of its budget";

/// Synthesised speech: its words with their start and end times, where the synthesiser reports them.
struct Speech {
    dir: tempfile::TempDir,
    python: PathBuf,
    words: Vec<(String, Option<f64>, Option<f64>)>,
}

impl Speech {
    /// Synthesises `n_sentences`, ordered so that none is repeated within a minute.
    #[track_caller]
    fn synthesise(n_sentences: usize) -> Option<Self> {
        let packages = aligner()?;
        let dir = tempfile::tempdir().unwrap();
        let text: Vec<&str> = (0..n_sentences).map(|n| SENTENCES[(n * 5 + n / 14) % 14]).collect();
        let path = |name: &str| dir.path().join(name);
        std::fs::write(path("speech.txt"), text.join(" ")).unwrap();
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/spoken_words.py");
        let files = ["speech.txt", "speech.wav", "speech.json"].map(path);
        let synthesis = Command::new("python3").arg(script).args(files).arg("en-us+f2").output().unwrap();
        if !synthesis.status.success() {
            skip(&format!("no voice of espeak-ng (`make aligner`): {}", String::from_utf8_lossy(&synthesis.stderr)));
            return None;
        }
        let known: Value = serde_json::from_slice(&std::fs::read(path("speech.json")).unwrap()).unwrap();
        let words = known.as_array().unwrap().iter().map(|word| {
            (word["word"].as_str().unwrap().to_owned(), word["start_secs"].as_f64(), word["end_secs"].as_f64())
        });
        let words = words.collect();
        let python = python_with(&packages, dir.path());
        Some(Self { dir, python, words })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Transcript that `orator align` writes for `text` and this speech, or its error output.
    fn aligned(&self, file: &str, text: impl AsRef<[u8]>) -> Result<Transcript, String> {
        std::fs::write(self.path(file), text).unwrap();
        let output = align(&self.python, &self.path("speech.wav"), &self.path(file), &self.path("out.words.json"));
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        Ok(Transcript::read(&self.path("out.words.json")).unwrap())
    }
}

/// Creates a virtual environment with these packages in `dir`, as Python is run without PYTHONPATH; returns its Python.
pub(crate) fn python_with(packages: &Path, dir: &Path) -> PathBuf {
    let environment = dir.join("environment");
    let created = Command::new("python3").args(["-m", "venv", "--without-pip"]).arg(&environment).status().unwrap();
    assert!(created.success(), "python3 -m venv");
    let version = std::fs::read_dir(environment.join("lib")).unwrap().next().unwrap().unwrap().path();
    std::fs::write(version.join("site-packages/aligner.pth"), packages.to_str().unwrap()).unwrap();
    environment.join("bin/python")
}

pub(crate) fn align(python: &Path, audio: &Path, text: &Path, out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.arg("align").args([audio, text]).arg("--out").arg(out);
    command.env("ORATOR_PYTHON", python).output().unwrap()
}

/// Sorted absolute errors of the boundaries of aligned words, seconds; `known` is `None` for a mismatched word.
fn boundary_errors(found: &Transcript, known: &[Option<(Option<f64>, Option<f64>)>]) -> Vec<f64> {
    assert_eq!(found.words.len(), known.len());
    let aligned = found.words.iter().zip(known).filter(|(word, _)| word.source == WordSource::Aligned);
    let mut errors: Vec<f64> = aligned
        .filter_map(|(word, known)| Some((word, (*known)?)))
        .flat_map(|(word, (start, end))| [start.map(|s| s - word.start_secs), end.map(|s| s - word.end_secs)])
        .flatten()
        .map(f64::abs)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Share of the words selected by `is_selected` that are marked as mismatched.
fn marked_share(found: &Transcript, is_selected: impl Fn(usize) -> bool) -> f64 {
    let selected: Vec<_> = (0..found.words.len()).filter(|&n| is_selected(n)).collect();
    let marked = selected.iter().filter(|&&n| found.words[n].source == WordSource::Interpolated);
    assert!(marked.clone().all(|&n| found.words[n].confidence == Some(0.0)));
    marked.count() as f64 / selected.len() as f64
}

#[test]
fn words_of_plain_text_are_aligned_to_the_audio() {
    let n_sentences = if std::env::var("ORATOR_LONG").is_ok() { 140 } else { 8 };
    let Some(speech) = Speech::synthesise(n_sentences) else { return };
    let text: Vec<&str> = speech.words.iter().map(|word| word.0.as_str()).collect();
    let found = speech.aligned("text.txt", text.join("\n")).unwrap();
    let known: Vec<_> = speech.words.iter().map(|(_, start, end)| Some((*start, *end))).collect();
    let errors = boundary_errors(&found, &known);
    let (median, p95) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
    let mismatched = marked_share(&found, |_| true);
    let secs = found.words.last().unwrap().end_secs;
    eprintln!(
        "{} words in {secs:.0} s: boundaries off by {:.0} ms (median), {:.0} ms (95 %); {:.1} % marked",
        text.len(),
        1000.0 * median,
        1000.0 * p95,
        100.0 * mismatched
    );
    assert!(median <= 0.05 && p95 <= 0.2 && mismatched <= 0.03, "{median} {p95} {mismatched}");
    assert!(n_sentences < 100 || secs > 480.0, "{secs}");
}

#[test]
fn mismatched_words_are_marked_and_do_not_shift_the_others() {
    let Some(speech) = Speech::synthesise(8) else { return };
    let other: Vec<&str> = UNRELATED_TEXT.split_whitespace().collect();
    let words = &speech.words;
    let is_replaced = |n: usize| n % 25 >= 20 && n / 25 < 3;
    // One spoken sentence is missing in the text.
    let chosen: Vec<usize> = (0..words.len()).filter(|n| !(32..42).contains(n)).collect();
    let text = chosen.iter().map(|&n| if is_replaced(n) { other[(5 * n) % other.len()] } else { words[n].0.as_str() });
    let found = speech.aligned("text.txt", text.collect::<Vec<_>>().join(" ")).unwrap();
    let known: Vec<_> = chosen.iter().map(|&n| (!is_replaced(n)).then_some((words[n].1, words[n].2))).collect();
    let errors = boundary_errors(&found, &known);
    let far = errors.iter().filter(|error| **error > 0.2).count() as f64 / errors.len() as f64;
    let (mismatched, matching) =
        (marked_share(&found, |n| is_replaced(chosen[n])), marked_share(&found, |n| !is_replaced(chosen[n])));
    eprintln!(
        "words marked: mismatched {mismatched:.2}, matching {matching:.2}; boundaries off by over 0.2 s: {far:.3}"
    );
    assert!(mismatched >= 0.7 && matching <= 0.15 && far <= 0.05, "{mismatched} {matching} {far}");

    let error = speech.aligned("other.txt", UNRELATED_TEXT).unwrap_err();
    assert!(error.contains("words match the") && error.contains("expected the English transcript"), "{error}");
}

#[test]
fn subtitle_cues_limit_the_search_for_words() {
    let Some(speech) = Speech::synthesise(8) else { return };
    let cue = |n: usize, words: &[(String, Option<f64>, Option<f64>)]| {
        let start = words.iter().find_map(|word| word.1).unwrap();
        let end = words.iter().rev().find_map(|word| word.2).unwrap();
        let time = |secs: f64| format!("00:00:{:02},{:03}", secs as u32, (secs * 1000.0) as u32 % 1000);
        let text: Vec<&str> = words.iter().map(|word| word.0.as_str()).collect();
        format!("{}\n{} --> {}\n{}\n\n", n + 1, time(start), time(end), text.join(" "))
    };
    let srt: String = speech.words.chunks(12).enumerate().map(|(n, words)| cue(n, words)).collect();
    let found = speech.aligned("text.srt", srt).unwrap();
    let known: Vec<_> = speech.words.iter().map(|(_, start, end)| Some((*start, *end))).collect();
    let errors = boundary_errors(&found, &known);
    assert!(errors[errors.len() / 2] <= 0.05 && errors[errors.len() * 95 / 100] <= 0.2);
    assert!(marked_share(&found, |_| true) <= 0.05);
}

#[test]
fn unalignable_input_is_an_error_with_its_location() {
    let Some(speech) = Speech::synthesise(1) else { return };
    let error = |file: &str, text: &[u8]| speech.aligned(file, text).unwrap_err();
    assert!(error("text.txt", b"so\nsch\xf6n").contains("line 2: byte 0xf6"));
    assert!(error("text.txt", b" \n").contains("contains no words"));
    assert!(
        error("text.txt", "\u{434}\u{430} \u{43d}\u{435}\u{442}".as_bytes())
            .contains("expected the English transcript")
    );
    let out = speech.path("silent.words.json");
    std::fs::write(speech.path("text.txt"), "Good evening").unwrap();
    // The WAV header of the speech, followed by silence.
    let mut silent = std::fs::read(speech.path("speech.wav")).unwrap();
    silent[44..].fill(0);
    std::fs::write(speech.path("silent.wav"), silent).unwrap();
    let output = align(&speech.python, &speech.path("silent.wav"), &speech.path("text.txt"), &out);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("expected the English transcript of audible speech")
            && !out.exists()
    );
    let output = align(&speech.python, &speech.path("text.txt"), &speech.path("text.txt"), &out);
    assert!(!output.status.success() && !out.exists());
}

#[test]
fn a_missing_python_package_is_an_error_with_its_install_command() {
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["align", "a.wav", "a.txt", "--out", "a.words.json", "--python", "/nowhere/python"]);
    let output = command.current_dir(dir.path()).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("/nowhere/python") && stderr.contains("pip install pocketsphinx==5.1.1"), "{stderr}");
}
