//! A long video is worked on in spans, by one worker, by two of a run, and by two of a plan, which are killed: the same
//! bytes each time.

use crate::fixtures::clips;
use crate::fixtures::faults::plan_workers::{epochs, worker, written};
use orator_formats::timeline_npz::Timeline;
use orator_test_support::project::{Project, files_under};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Child;
use std::time::Duration;

/// A project with one video of 190 s at 2 pictures a second: a clip of 10 s over and over.
fn project(name: &str) -> Option<Project> {
    let project = Project::with_clips(name, 1, 10.0);
    let file = project.dir().join("pipeline.toml");
    let settings = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, format!("{settings}\n[extract]\nfps = 2\n")).unwrap();
    let clip = project.clips().remove(0);
    let list = project.dir().join("list.txt");
    std::fs::write(&list, format!("file '{}'\n", clip.display()).repeat(19)).unwrap();
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

/// The worker that has a unit in hand.
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
fn a_long_video_is_shared_and_its_bytes_are_those_of_one_worker() {
    let Some(alone) = project("alone") else { return };
    assert_eq!(alone.run(&["--jobs", "1"]).code, 0);
    assert_eq!(spans(&alone), 2);
    let expected = written(&alone.work());
    let compare = |made: BTreeMap<String, Vec<u8>>| {
        assert_eq!(made.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        let differing: Vec<&String> =
            made.iter().filter(|(name, of)| expected[*name] != **of).map(|(n, _)| n).collect();
        assert!(differing.is_empty(), "{differing:?}");
    };
    let Some(two) = project("two") else { return };
    // Killed in the middle of a span, the run goes on after those that are done.
    let mut killed = two.start(&["run", "--jobs", "1"]);
    let done =
        |project: &Project| files_under(&project.work()).iter().any(|(name, _)| name.ends_with(".parts/0.record.json"));
    while !done(&two) {
        assert!(killed.try_wait().unwrap().is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(20));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert_eq!(two.run(&["--jobs", "2"]).code, 0);
    compare(written(&two.work()));

    let Some(planned) = project("planned") else { return };
    let plan = planned.answer(&["plan", "--untimed", "--piece", "2"]);
    assert_eq!((plan.code, &plan.json["units"]), (0, &json!(4)), "{}", plan.errors);
    // Two workers are killed with a unit in hand: one when spans are shared, another when one of them is done.
    let mut workers = [worker(&planned), worker(&planned)];
    let begun = |project: &Project| files_under(&project.work()).iter().any(|(name, _)| name.contains(".parts/"));
    let steps: [&dyn Fn(&Project) -> bool; 2] = [&begun, &done];
    for is_reached in steps {
        let at = loop {
            assert!(
                workers.iter_mut().all(|worker| worker.try_wait().unwrap().is_none()),
                "it ended before it was killed"
            );
            if let Some(at) = Some(()).filter(|()| is_reached(&planned)).and_then(|()| holder(&planned, &workers)) {
                break at;
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        workers[at].kill().unwrap();
        workers[at].wait().unwrap();
        workers[at] = worker(&planned);
    }
    for mut worker in workers {
        assert!(worker.wait().unwrap().success());
    }
    let taken_over = epochs(&planned.work(), "claim").values().filter(|epoch| **epoch > 1).count();
    assert!(taken_over > 0, "no killed worker had a unit");
    assert_eq!(epochs(&planned.work(), "end").len(), 4);
    let status = planned.answer(&["status", "--plan", "work/plan.json"]).json;
    assert!((status["ended_media_secs"].as_f64().unwrap() - status["media_secs"].as_f64().unwrap()).abs() < 1e-6);
    assert_eq!(planned.run(&["--only", "dataset"]).code, 0);
    compare(written(&planned.work()));
}
