//! `orator transcribe` on read speech: wrong words one by one, and word times beside those of `orator align`.

use super::aligned_words::{align, python_with};
use crate::fixtures::media::spoken::{KnownWord, WordComparison};
use orator_formats::transcript::Transcript;
use orator_test_support::skip::{aligner, fetched_model, real_data};
use std::process::Command;

const READ: [(&str, &str); 3] = [
    (
        "ljspeech_LJ001-0001.wav",
        "Printing, in the only sense with which we are at present concerned, differs from most if not from all the arts \
         and crafts represented in the Exhibition",
    ),
    (
        "ljspeech_LJ001-0003.wav",
        "For although the Chinese took impressions from wood blocks engraved in relief for centuries before the \
         woodcutters of the Netherlands, by a similar process",
    ),
    (
        "jfk_whisper_11s.flac",
        "And so, my fellow Americans, ask not what your country can do for you, ask what you can do for your country.",
    ),
];

#[test]
fn words_of_read_speech_are_recognised_near_those_of_forced_alignment() {
    let (Some(models), Some(packages)) = (fetched_model("whisper-tiny-en/model.bin"), aligner()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let python = python_with(&packages, dir.path());
    let mut all = WordComparison::default();
    for (file, text) in READ {
        let Some(sound) = real_data(&format!("data/audio/{file}")) else { return };
        let [written, given, aligned] = ["words.json", "given.txt", "aligned.json"].map(|name| dir.path().join(name));
        std::fs::write(&given, text).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.arg("transcribe").arg(&sound).args(["--language", "en", "--out"]).arg(&written);
        let output = command.arg("--set").arg(format!("models.dir={}", models.display())).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let output = align(&python, &sound, &given, &aligned);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let words = |path| Transcript::read(path).unwrap().words;
        let known: Vec<KnownWord> = words(&aligned).into_iter().map(KnownWord::from).collect();
        let mut compared = WordComparison::default();
        for comparison in [&mut compared, &mut all] {
            comparison.add(&known, &words(&written));
        }
        compared.print(file);
    }
    all.print("read speech");
    let [median, _] = all.boundary_errors();
    assert!(all.n_errors <= 3 && median <= 0.07, "{} {median}", all.n_errors);
}
