//! A long video is processed in spans by one worker, by several of a run, and by several of a plan, some of them
//! killed: the bytes are identical. With `ORATOR_LONG=1` (`make prove`) it has 17 minutes and eight workers.

use crate::fixtures::clips;
use crate::fixtures::faults::plan_workers::{WorkerClocks, epochs, written};
use orator_formats::timeline_npz::Timeline;
use orator_test_support::project::{Project, files_under};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Child;
use std::time::Duration;

/// A project with one video, a clip of 10 s repeated `n_repeats` times, processed at 2 fps.
fn project(name: &str, n_repeats: usize) -> Option<Project> {
    let project = Project::with_clips(name, 1, 10.0);
    let file = project.dir().join("pipeline.toml");
    let settings = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, format!("{settings}\n[extract]\nfps = 2\n")).unwrap();
    let clip = project.clips().remove(0);
    let list = project.dir().join("list.txt");
    std::fs::write(&list, format!("file '{}'\n", clip.display()).repeat(n_repeats)).unwrap();
    if !clips::ffmpeg(project.dir(), "-f concat -safe 0 -i list.txt -c copy long.mp4") {
        return None;
    }
    std::fs::rename(project.dir().join("long.mp4"), clip).unwrap();
    Some(project)
}

fn spans(project: &Project) -> usize {
    let timeline = files_under(&project.work()).into_iter().find(|(name, _)| name.ends_with("timeline.npz")).unwrap().1;
    Timeline::read(&timeline).unwrap().spans().len()
}

/// Index of a worker with a unit in progress.
fn holder(project: &Project, workers: &[Child]) -> Option<usize> {
    let files: BTreeMap<String, PathBuf> = files_under(&project.work()).into_iter().collect();
    let open = files
        .iter()
        .filter(|(name, _)| name.contains(".claim.") && !files.contains_key(&name.replace("claim.", "end.")));
    let mut holders = open.filter_map(|(_, path)| {
        let claim: Value = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        // HOST-PROCESS-NUMBER-NONCE
        let process: u32 = claim["worker"].as_str()?.rsplit('-').nth(2)?.parse().ok()?;
        workers.iter().position(|worker| worker.id() == process)
    });
    holders.next()
}

#[test]
fn workers_share_a_long_video_and_give_the_bytes_of_one_worker() {
    let is_long = std::env::var_os("ORATOR_LONG").is_some();
    let (n_repeats, n_spans, n_workers) = if is_long { (102, 9, 8) } else { (19, 2, 2) };
    let Some(single) = project("alone", n_repeats) else { return };
    assert_eq!(single.run(&["--jobs", "1"]).code, 0);
    assert_eq!(spans(&single), n_spans);
    let expected = written(&single.work());
    let compare = |output: BTreeMap<String, Vec<u8>>| {
        assert_eq!(output.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        let differing: Vec<&String> =
            output.iter().filter(|(name, of)| expected[*name] != **of).map(|(n, _)| n).collect();
        assert!(differing.is_empty(), "{differing:?}");
    };
    let Some(shared) = project("shared", n_repeats) else { return };
    // A run killed within a span resumes after the completed spans.
    let mut killed = shared.start(&["run", "--jobs", "1"]);
    let done =
        |project: &Project| files_under(&project.work()).iter().any(|(name, _)| name.ends_with(".parts/0.record.json"));
    while !done(&shared) {
        assert!(killed.try_wait().unwrap().is_none(), "a process ended before it was killed");
        std::thread::sleep(Duration::from_millis(20));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert_eq!(shared.run(&["--jobs", &n_workers.to_string()]).code, 0);
    compare(written(&shared.work()));

    let Some(planned) = project("planned", n_repeats) else { return };
    let plan = planned.answer(&["plan", "--max-part", "2"]);
    let n_units = plan.json["units"].as_u64().unwrap();
    assert!(plan.code == 0 && (n_units == 4 || is_long), "{n_units}: {}", plan.errors);
    // Clocks differ by up to 15 minutes. Workers are killed with a unit in progress: one when spans are shared, the
    // others when a span is done.
    let (mut rng, mut clocks) = (ChaCha8Rng::seed_from_u64(5), WorkerClocks::new());
    let mut start = || clocks.start(&planned, &mut rng);
    let mut workers: Vec<Child> = (0..n_workers).map(|_| start()).collect();
    let n_killed = n_workers / 2 + 1;
    for kill in 0..n_killed {
        let is_reached = || match kill {
            0 => files_under(&planned.work()).iter().any(|(name, _)| name.contains(".parts/")),
            _ => done(&planned),
        };
        let at = loop {
            let are_running = workers.iter_mut().all(|worker| worker.try_wait().unwrap().is_none());
            assert!(are_running, "a process ended before it was killed");
            if let Some(at) = Some(()).filter(|()| is_reached()).and_then(|()| holder(&planned, &workers)) {
                break at;
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        workers[at].kill().unwrap();
        workers[at].wait().unwrap();
        workers[at] = start();
    }
    for mut worker in workers {
        assert!(worker.wait().unwrap().success());
    }
    let reclaimed = epochs(&planned.work(), "claim").values().filter(|epoch| **epoch > 1).count();
    assert!(reclaimed > 0, "no killed worker had a unit");
    assert_eq!(epochs(&planned.work(), "end").len() as u64, n_units);
    let status = planned.answer(&["status", "--plan", "work/plan.json"]).json;
    assert!((status["ended_media_secs"].as_f64().unwrap() - status["media_secs"].as_f64().unwrap()).abs() < 1e-6);
    assert_eq!(planned.run(&["--only", "dataset"]).code, 0);
    compare(written(&planned.work()));
    eprintln!("{n_spans} spans, {n_units} units, {n_workers} workers, {n_killed} killed: the bytes of one worker");
}
