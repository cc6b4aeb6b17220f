//! Training by the program: killed or terminated at any time and resumed, it ends with the weights of an uninterrupted
//! training; each of two speakers has a separate model, whose file is enough to generate. `ORATOR_KILLS` sets the
//! number of kills (`make prove`: 20).

use crate::fixtures::clips;
use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::workdir;
use orator_dataset::Split;
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const CONFIG: &str = r#"
[[speaker]]
name = "anna"
videos = ["videos/anna/*.mp4"]
[[speaker]]
name = "ben"
videos = ["videos/ben/*.mp4"]
[gan]
batch = 2
window_frames = 32
epoch_steps = 4
checkpoint_every = 3
"#;

/// A project of two speakers, each with a small dataset.
fn project(dir: &Path) {
    std::fs::write(dir.join("pipeline.toml"), CONFIG).unwrap();
    for (speaker, phase) in [("anna", 0.0), ("ben", 1.5)] {
        let samples = [
            (Split::Train, sample("a-00000000-000000", 99, phase)),
            (Split::Validation, sample("c-00000000-000000", 64, phase + 4.0)),
        ];
        write_dataset(&dir.join("work/dataset").join(speaker), speaker, FPS, &samples).unwrap();
    }
}

fn orator(dir: &Path, args: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(args.split_whitespace()).current_dir(dir).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn train(dir: &Path, out: &str, steps: usize) -> Child {
    orator(dir, &format!("train gan --speaker anna --out {out} --steps {steps}")).spawn().unwrap()
}

#[test]
fn a_training_killed_at_any_time_resumes_to_identical_weights() {
    let n_kills: u32 = std::env::var("ORATOR_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(3);
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let steps = 12;
    let started = Instant::now();
    assert!(train(dir, "calm", steps).wait().unwrap().success());
    let duration = started.elapsed();
    let read = |out: &str, file: &str| std::fs::read(dir.join(out).join(file)).unwrap();
    let last = "step-0000012.safetensors";
    let (mut n_killed, mut random, mut round) = (0, 0x9e37_79b9_7f4a_7c15_u64, 0);
    while n_killed < n_kills {
        let out = format!("killed-{round}");
        loop {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let share = (random >> 33) as f64 / f64::from(1u32 << 31);
            let mut child = train(dir, &out, steps);
            std::thread::sleep(Duration::from_secs_f64(0.1 + share * duration.as_secs_f64()));
            let ended = n_killed == n_kills || child.try_wait().unwrap().is_some();
            if ended {
                assert!(child.wait().unwrap().success());
                break;
            }
            // SIGKILL and SIGTERM in turn.
            match n_killed % 2 {
                0 => child.kill().unwrap(),
                _ => kill_process(Pid::from_child(&child), Signal::TERM).unwrap(),
            }
            child.wait().unwrap();
            n_killed += 1;
        }
        for file in [last, "best.safetensors", "metrics.jsonl"] {
            assert!(read(&out, file) == read("calm", file), "{file} differs after {n_killed} kills");
        }
        round += 1;
    }
    eprintln!("killed {n_killed} trainings; weights, best checkpoint and log are identical");
}

#[test]
fn each_speaker_gets_a_model_whose_file_is_enough_to_generate() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let run = |args: &str| orator(dir, args).status().unwrap().success();
    assert!(!run("train gan --steps 2"), "no speaker was given");
    assert!(!run("train gan --steps 2 --speaker carl"));
    for speaker in ["anna", "ben"] {
        assert!(run(&format!("train gan --steps 2 --speaker {speaker}")));
    }
    let models = ["anna", "ben"]
        .map(|speaker| std::fs::read(dir.join("work/gan").join(speaker).join("best.safetensors")).unwrap());
    assert!(models[0] != models[1]);
    // The file generates without its project.
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::write(elsewhere.path().join("ben.safetensors"), &models[1]).unwrap();
    orator_formats::wav::write(&elsewhere.path().join("speech.wav"), &clips::tone(16_000, 2.0, 220.0)).unwrap();
    drop(folder);
    let generate = "generate --checkpoint ben.safetensors --audio speech.wav --out motion.npy";
    assert!(orator(elsewhere.path(), generate).status().unwrap().success());
    assert!(elsewhere.path().join("motion.npy").is_file());
}

#[test]
fn a_training_continues_with_another_choice_of_device() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let run = |args: &str| {
        let output = orator(dir, args).stderr(Stdio::piped()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let train = |out: &str, steps: usize, device: &str| {
        let constant_rate = "--set gan.epoch_steps=3 --set gan.warmup_steps=0 --set gan.final_lr_ratio=1";
        run(&format!("train gan --speaker anna --out {out} --steps {steps} {constant_rate} {device}"))
    };
    let last = |out: &str| std::fs::read(orator_formats::checkpoint::path(&dir.join(out), 6)).unwrap();
    assert_eq!(train("calm", 6, "").0, Some(0));
    let (code, said) = train("parts", 3, "--set gan.device=cpu");
    assert!(code == Some(1) && said.contains("gan.device: unknown key: renamed to work.device"), "{said}");
    assert_eq!(train("parts", 3, "--set work.device=cpu").0, Some(0));
    assert_eq!(train("parts", 6, "--device cpu --set work.device=cuda:7").0, Some(0));
    assert!(last("calm") == last("parts"));
    // Without a GPU, `auto` is the CPU and prints why.
    #[cfg(not(feature = "cuda"))]
    {
        assert_eq!(train("auto", 3, "--device cpu").0, Some(0));
        let (code, said) = train("auto", 6, "--device auto");
        assert!(code == Some(0) && said.contains("device: CPU (this program has no CUDA"), "{said}");
        assert!(last("calm") == last("auto"));
        let generate = "generate --checkpoint calm --audio speech.wav --out motion.bvh";
        let failing = [
            "train gan --speaker anna --device cuda",
            "run --train --set work.device=cuda",
            &format!("{generate} --device cuda"),
            "evaluate --dataset work/dataset/anna --checkpoint calm --device cuda",
        ];
        for args in failing {
            let (code, said) = run(args);
            assert!(code == Some(1) && said.contains("cannot use the device cuda: this program has no CUDA"), "{said}");
        }
        let (_, said) = run(&format!("{generate} --device cuda:x"));
        assert!(said.contains("expected \"auto\", \"cpu\", \"cuda\" or \"cuda:N\""), "{said}");
    }
}

#[test]
fn an_unwritable_training_page_sets_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    std::fs::create_dir_all(dir.join("out/training.html/in the way")).unwrap();
    let train = |steps| train(dir, "out", steps).wait().unwrap().code();
    assert_eq!(train(2), Some(2), "the model was written, its page was not");
    assert!(dir.join("out/best.safetensors").exists());
    std::fs::remove_dir_all(dir.join("out/training.html")).unwrap();
    assert_eq!(train(2), Some(0));
    assert!(dir.join("out/training.html").is_file());
}

#[test]
fn training_all_speakers_skips_those_locked_by_another_process() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let all = || orator(dir, "train gan --all --steps 4").status().unwrap().code();
    let model = |speaker: &str| std::fs::read(dir.join("work/gan").join(speaker).join("step-0000004.safetensors")).ok();
    let busy = workdir::lock(&dir.join("work/gan/ben")).unwrap();
    assert_eq!(all(), Some(0));
    let anna = model("anna");
    assert!(anna.is_some() && model("ben").is_none());
    drop(busy);
    assert_eq!(all(), Some(0));
    assert!(model("ben").is_some() && model("anna") == anna);
    std::fs::remove_dir_all(dir.join("work/gan")).unwrap();
    std::fs::remove_file(dir.join("work/dataset/anna/info.json")).unwrap();
    assert_eq!(all(), Some(2));
    assert!(model("ben").is_some(), "a failing speaker does not stop the others");
}
