//! Interrupted trainings: Ctrl-C and SIGTERM end a training after the current step with a checkpoint from which it
//! resumes to identical bytes; progress is printed to pipes; the training page exists from the first validation on; a
//! dataset alone is enough, and the error of one without windows gives the reason.

use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::progress::Silent;
use orator_dataset::{Dataset, Sample, Split};
use orator_gesture::train::seq2seq::source::TrainingSource;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

/// Training steps of a network, enough for a signal to arrive during training.
fn steps(network: &str) -> usize {
    if network == "gan" { 20 } else { 200 }
}

fn write_anna(dir: &Path, samples: &[(Split, Sample)]) {
    write_dataset(&dir.join("data/anna"), "anna", FPS, samples).unwrap();
}

fn sufficient_samples() -> [(Split, Sample); 2] {
    [(Split::Train, sample("a-00000000-000000", 99, 0.0)), (Split::Validation, sample("c-00000000-000000", 128, 4.0))]
}

/// `orator train NETWORK` with a dataset only, in a folder without a configuration.
fn train(dir: &Path, network: &str, out: &str) -> Command {
    let small = match network {
        "gan" => "--set gan.batch=2 --set gan.window_frames=32 --set gan.epoch_steps=6",
        _ => "--set seq2seq.batch=3 --set seq2seq.hidden=8 --set seq2seq.epoch_steps=60",
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["train", network, "--dataset", "data/anna", "--json", "--steps", &steps(network).to_string()]);
    command.args(small.split(' ')).current_dir(dir).stdout(Stdio::piped()).stderr(Stdio::piped());
    if !out.is_empty() {
        command.args(["--out", out]);
    }
    command
}

/// Starts a training, signals it at the first line with `prefix`, and returns exit code, answer and progress lines.
pub(crate) fn signalled(mut training: Command, prefix: &str, signal: Signal) -> (Option<i32>, Value, String) {
    let mut child = training.spawn().unwrap();
    let mut text = String::new();
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    while lines.read_line(&mut text).unwrap() > 0 {
        if text.lines().last().is_some_and(|line| line.starts_with(prefix)) {
            kill_process(Pid::from_child(&child), signal).unwrap();
            break;
        }
    }
    lines.read_to_string(&mut text).unwrap();
    let output = child.wait_with_output().unwrap();
    (output.status.code(), serde_json::from_slice(&output.stdout).unwrap(), text)
}

fn assert_stops_twice(network: &str) {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_anna(dir, &sufficient_samples());
    // With a dataset only, checkpoints are saved in the folder of its speaker.
    let uninterrupted_out = format!("work/{network}/anna");
    let uninterrupted = train(dir, network, "").output().unwrap();
    let text = String::from_utf8(uninterrupted.stderr).unwrap();
    assert!(uninterrupted.status.success(), "{text}");
    assert!(
        text.lines()
            .any(|line| line.contains(" of data/anna; writing checkpoints") && line.ends_with(&uninterrupted_out))
    );
    // A training of any length prints twenty lines, none of them on standard output.
    let lines = text.lines().filter(|line| line.starts_with("step ") && line.ends_with(" left"));
    assert_eq!(lines.count(), 20, "{text}");
    assert_eq!(String::from_utf8(uninterrupted.stdout).unwrap().lines().count(), 1);

    let n_steps = steps(network);
    let line = |twentieth: usize| format!("step {} of {n_steps}: ", n_steps * twentieth / 20);
    let (code, answer, first) = signalled(train(dir, network, "stopped"), &line(3), Signal::INT);
    assert_eq!(code, Some(130), "{first}");
    let step = answer["step"].as_u64().unwrap();
    assert!(answer["stopped"] == true && step >= n_steps as u64 * 3 / 20 && step < n_steps as u64, "{answer}");
    let newest = dir.join(answer["newest"].as_str().unwrap());
    assert!(newest.is_file() && newest.ends_with(format!("step-{step:07}.safetensors")), "{answer}");
    let next = format!("orator train {network} --dataset data/anna --json --steps {n_steps} ");
    assert!(answer["next"].as_str().unwrap().starts_with(&next), "{answer}");
    assert!(
        first.contains("stopping after the current step") && first.contains("writing checkpoints to stopped"),
        "{first}"
    );

    let (code, answer, second) = signalled(train(dir, network, "stopped"), &line(12), Signal::TERM);
    assert_eq!(code, Some(143), "{second}");
    assert!(answer["step"].as_u64().unwrap() > step && second.contains("resuming from"), "{answer} {second}");
    // After an epoch its validation was printed, and the page exists before the training ends.
    let text = first + &second;
    let validation = format!("step {}: validation L1 ", n_steps * 6 / 20);
    assert!(text.contains(&validation) && text.contains(", score ") && answer["best_step"].is_u64(), "{text}");
    assert!(dir.join("stopped/training.html").is_file());

    assert!(train(dir, network, "stopped").output().unwrap().status.success());
    let last = format!("step-{n_steps:07}.safetensors");
    for file in [&last, "best.safetensors", "metrics.jsonl", "training.html"] {
        let read = |out: &str| std::fs::read(dir.join(out).join(file)).unwrap();
        assert!(read("stopped") == read(&uninterrupted_out), "{network}: {file} differs");
    }
}

#[test]
fn a_stopped_gan_training_resumes_to_identical_bytes() {
    assert_stops_twice("gan");
}

#[test]
fn a_stopped_seq2seq_training_resumes_to_identical_bytes() {
    assert_stops_twice("seq2seq");
}

#[test]
fn a_dataset_without_windows_is_an_error_with_reason_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let error_of = |network: &str| {
        let output = train(dir, network, "out").output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).unwrap()
    };
    let held_out = |n_frames| (Split::Validation, sample("c-00000000-000000", n_frames, 4.0));
    write_anna(dir, &[held_out(64)]);
    for network in ["gan", "seq2seq"] {
        let text = error_of(network);
        assert!(
            text.contains("the train split is empty (validation has 1 interval, 4.3 s, test has 0 intervals"),
            "{text}"
        );
        assert!(text.contains("import it again with other shares"), "{text}");
    }
    std::fs::remove_dir_all(dir.join("data")).unwrap();
    write_anna(dir, &[(Split::Train, sample("a-00000000-000000", 20, 0.0)), held_out(64)]);
    for (network, name, frames) in [("gan", "window", 32), ("seq2seq", "segment", 23)] {
        let text = error_of(network);
        let expected =
            format!("the only interval of the train split has 20 frames (1.3 s), but a {name} needs {frames} frames");
        assert!(text.contains(&expected) && text.contains("add footage with longer speech"), "{text}");
    }
    std::fs::remove_dir_all(dir.join("data")).unwrap();
    write_anna(dir, &[(Split::Train, sample("a-00000000-000000", 50, 0.0)), held_out(64)]);
    let output = train(dir, "gan", "out").args(["--set", "gan.window_frames=64"]).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("use `--set gan.window_frames=32` for shorter ones"), "{text}");
}

#[test]
fn seq2seq_without_a_held_out_split_reports_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    write_anna(folder.path(), &[(Split::Train, sample("a-00000000-000000", 99, 0.0))]);
    let dataset = Dataset::open(folder.path().join("data/anna")).unwrap();
    let needed = orator_gesture::train::no_window::NeededFrames { name: "window", n_frames: 64, key: None };
    let cause = orator_gesture::train::no_window::cause(&dataset, Split::Validation, needed).unwrap();
    assert!(
        cause.starts_with("the validation split is empty (train has 1 interval, 6.6 s, test has 0 intervals"),
        "{cause}"
    );
    let settings =
        orator_dataset::config::Seq2seqConfig { steps: 0.into(), batch: 3.into(), hidden: 8, ..Default::default() };
    let out = folder.path().join("out");
    let result = crate::fixtures::models::training::train_seq2seq(
        TrainingSource::Dataset(&dataset),
        None,
        &settings,
        &out,
        &Silent,
    );
    assert!(format!("{:#}", result.unwrap_err()).contains("nothing to train"));
}
