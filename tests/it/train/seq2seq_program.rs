//! `orator train seq2seq` by the program: default paths, and the page of the training.

use crate::fixtures::animation::captures::write_capture;
use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::write_dataset::write_dataset;
use orator_dataset::Split;
use std::path::Path;
use std::process::{Command, Output};

const CONFIG: &str = r#"
[[speaker]]
name = "anna"
videos = ["videos/anna/*.mp4"]
[seq2seq]
batch = 3
hidden = 8
steps = 20
epoch_steps = 10
"#;

const BEN: &str = "[[speaker]]\nname = \"ben\"\nvideos = [\"videos/ben/*.mp4\"]\n";

fn orator(dir: &Path, args: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(args.split_whitespace()).current_dir(dir).output().unwrap()
}

/// JSON answer of a successful command.
fn answer(dir: &Path, args: &str) -> serde_json::Value {
    let output = orator(dir, &format!("{args} --json"));
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_training_is_saved_in_the_work_folder_with_its_page() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::write(dir.join("pipeline.toml"), CONFIG).unwrap();
    let samples = [
        (Split::Train, sample("a-00000000-000000", 99, 0.0)),
        (Split::Validation, sample("c-00000000-000000", 128, 4.0)),
    ];
    write_dataset(&dir.join("work/dataset/anna"), "anna", FPS, &samples).unwrap();
    let trained = answer(dir, "train seq2seq");
    let out = dir.join("work/seq2seq/anna");
    let path = std::path::Path::new(trained["page"].as_str().unwrap());
    assert_eq!(path.canonicalize().unwrap(), out.join("training.html").canonicalize().unwrap());
    let page = || std::fs::read_to_string(out.join("training.html")).unwrap();
    let written = page();
    for text in ["Training of anna", "L1 error", "Motion energy", "Score", "Gradient norm", "strip", "20 steps"] {
        assert!(written.contains(text), "{text}");
    }
    assert!(
        !written.contains("PCK")
            && !written.contains("NaN")
            && written.contains("on 8 sequences of the validation split")
    );
    answer(dir, "train seq2seq");
    assert!(page() == written, "the same training has the same page");
    assert!(std::fs::read_dir(&out).unwrap().flatten().any(|e| e.file_name().to_string_lossy().contains("tfevents")));
}

#[test]
fn all_speakers_are_trained_by_the_papers_reading() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::write(dir.join("pipeline.toml"), CONFIG.replace("steps = 20\n", "") + BEN).unwrap();
    for speaker in ["anna", "ben"] {
        let samples = [(Split::Train, sample("a-00000000-000000", 99, 0.0))];
        write_dataset(&dir.join("work/dataset").join(speaker), speaker, FPS, &samples).unwrap();
    }
    std::fs::create_dir_all(dir.join("models/words")).unwrap();
    std::fs::write(dir.join("models/words/glove.safetensors"), "not read").unwrap();
    let trained = answer(dir, "train seq2seq --all --set seq2seq.reading=paper --set seq2seq.epochs=2");
    let speakers = trained["speakers"].as_array().unwrap();
    let of = |key: &str| speakers.iter().map(|trained| trained[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("speaker"), ["anna", "ben"]);
    // 99 frames at 15 fps: six segments of 8 previous and 15 predicted poses, in batches of three.
    assert_eq!((of("segments"), of("steps")), (vec![6.into(), 6.into()], vec![4.into(), 4.into()]));
    let page = std::fs::read_to_string(dir.join("work/seq2seq/ben/training.html")).unwrap();
    assert!(page.contains("poses of train a-00000000-000000") && page.contains("Without validation data"));
    let facts = orator_formats::checkpoint::facts(&dir.join("work/seq2seq/ben/best.safetensors")).unwrap();
    let settings = &facts["settings"];
    assert_eq!((&settings["distance"], &settings["continuity"]), (&"mse".into(), &"poses".into()));
    assert_eq!((&settings["words_around_secs"], &facts["speaker"]["carries_state"]), (&0.5.into(), &true.into()));

    let resumed = orator(dir, "train seq2seq --speaker ben --set seq2seq.reading=code --set seq2seq.epochs=3");
    let said = String::from_utf8_lossy(&resumed.stderr).into_owned();
    assert!(said.contains("the installed word vectors are not used: the dataset has no transcripts"), "{said}");
    assert!(said.contains("warning: 6.0 s of motion to train on: expect a result close to the mean pose"), "{said}");
    assert!(resumed.status.success() && said.contains("seq2seq.reading is \"code\", but \"paper\""), "{said}");
    assert!(String::from_utf8_lossy(&resumed.stdout).contains("6 steps"), "{resumed:?}");
    let rejected = orator(dir, "train seq2seq --speaker ben --device cuda");
    let said = String::from_utf8_lossy(&rejected.stderr).into_owned();
    assert!(said.contains("device cuda: sequence-to-sequence networks run on the CPU only"), "{said}");
    let rejected = orator(dir, "train seq2seq --speaker ben --set seq2seq.lambda_adversarial=0.5");
    let said = String::from_utf8_lossy(&rejected.stderr).into_owned();
    assert!(said.contains("seq2seq.lambda_adversarial has no effect on the network \"contextual\""), "{said}");
}

#[test]
fn captures_need_an_output_folder_and_have_a_page_without_poses() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_capture(&dir.join("takes"), "a", 4.0, 0.0, true);
    let rejected = orator(dir, "train seq2seq --captures takes");
    assert!(!rejected.status.success() && String::from_utf8_lossy(&rejected.stderr).contains("--out"));
    let rejected = orator(dir, "train seq2seq --out model");
    assert!(String::from_utf8_lossy(&rejected.stderr).contains("pipeline.toml"), "{rejected:?}");
    std::fs::create_dir_all(dir.join("models/words")).unwrap();
    std::fs::write(dir.join("models/words/glove.safetensors"), "not read").unwrap();
    let set = "--set seq2seq.batch=3 --set seq2seq.hidden=8 --set seq2seq.epoch_steps=4";
    let trained = orator(dir, &format!("train seq2seq --captures takes --steps 8 --out model {set}"));
    let said = String::from_utf8_lossy(&trained.stderr);
    let has_hint = said.contains("not used: add --words ") && said.contains("models/words/glove.safetensors");
    assert!(trained.status.success() && has_hint, "{said}");
    let page = std::fs::read_to_string(dir.join("model/training.html")).unwrap();
    assert!(page.contains("Training of takes") && page.contains("No interval with the 49 joints to show"));
    let generate = "generate --checkpoint model --audio takes/a.wav --transcript takes/a.tsv --out a.bvh";
    let rejected = orator(dir, &format!("{generate} --device cuda"));
    assert!(String::from_utf8_lossy(&rejected.stderr).contains("networks run on the CPU only"), "{rejected:?}");
    let output = orator(dir, &format!("{generate} --device auto"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("device: CPU (sequence-to-sequence"), "{output:?}");
    assert!(output.status.success() && dir.join("a.bvh").is_file());
}
