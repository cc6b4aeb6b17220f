//! Workers on one plan are killed, stopped and restarted: the datasets are those of one undisturbed run. `ORATOR_KILLS`
//! sets the number of kills (`make prove`: 200, with eight workers). The clocks of workers differ by minutes and jump.

use crate::fixtures::faults::plan_workers::{WorkerClocks, epochs, worker, written};
use crate::fixtures::media::recogniser::project_with_words;
use orator_test_support::project::{Project, files_under};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::{Pid, Signal, kill_process};
use std::process::Child;
use std::time::{Duration, Instant};

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

/// Child processes of a process.
fn children(of: u32) -> Vec<Pid> {
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let numbers = processes.filter_map(|entry| entry.file_name().to_string_lossy().parse::<i32>().ok());
    let is_child = |process: &i32| {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        // After the name, which may contain any character: state, parent.
        let parent = stat.rsplit_once(')').and_then(|(_, rest)| rest.split_whitespace().nth(1)?.parse().ok());
        parent == Some(of)
    };
    numbers.filter(is_child).filter_map(Pid::from_raw).collect()
}

/// Whether a process has installed a handler of SIGTERM, which it does as its first step.
fn handles_term(process: Pid) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok());
    caught.is_some_and(|signals| signals & (1 << (Signal::TERM.as_raw() - 1)) != 0)
}

#[test]
fn killed_and_stopped_workers_give_the_bytes_of_one_run() {
    let n_kills: usize = std::env::var("ORATOR_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let (n_clips, n_workers) = (6, if n_kills > 20 { 8 } else { 4 });
    let undisturbed = project_with_words("calm", n_clips, 4.6);
    assert_eq!(undisturbed.run(&[]).code, 0);
    let expected = written(&undisturbed.work());
    assert!(expected.keys().any(|name| name.ends_with(".tar")));
    let (mut rng, mut clocks) = (ChaCha8Rng::seed_from_u64(7), WorkerClocks::new());
    let (mut n_killed, mut n_stopped, mut n_reclaimed, mut n_plans) = (0, 0, 0, 0);
    while n_killed + n_stopped < n_kills {
        n_plans += 1;
        let project = project_with_words("crowd", n_clips, 4.6);
        let plan = project.answer(&["plan"]);
        assert_eq!((plan.code, &plan.json["units"]), (0, &serde_json::json!(n_clips)), "{}", plan.errors);
        let mut workers: Vec<Child> = (0..n_workers).map(|_| clocks.start(&project, &mut rng)).collect();
        let mut stopped: Vec<Child> = Vec::new();
        let begin = Instant::now();
        while epochs(&project.work(), "end").len() < n_clips {
            assert!(
                begin.elapsed() < Duration::from_secs(240),
                "{} of {n_clips}",
                epochs(&project.work(), "end").len()
            );
            std::thread::sleep(Duration::from_millis(rng.random_range(50..400)));
            clocks.jump(&mut rng);
            let at = rng.random_range(0..workers.len());
            if n_killed + n_stopped < n_kills && workers[at].try_wait().unwrap().is_none() {
                let next = clocks.start(&project, &mut rng);
                let mut old = std::mem::replace(&mut workers[at], next);
                // The unit processes of a killed worker end with it.
                if rng.random_bool(0.7) {
                    old.kill().unwrap();
                    old.wait().unwrap();
                    n_killed += 1;
                } else {
                    signal(&old, Signal::STOP);
                    stopped.push(old);
                    n_stopped += 1;
                }
            }
        }
        // Stopped workers continue late, find their units claimed by others, and exit successfully.
        for mut late in stopped {
            signal(&late, Signal::CONT);
            assert!(late.wait().unwrap().success());
        }
        for mut worker in workers {
            assert!(worker.wait().unwrap().success());
        }
        let run = project.run(&["--only", "dataset"]);
        assert_eq!(run.code, 0, "{}", run.errors);
        let (output, claims) = (written(&project.work()), epochs(&project.work(), "claim"));
        assert_eq!(output.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        let differing: Vec<&String> =
            output.iter().filter(|(name, bytes)| expected[*name] != **bytes).map(|(name, _)| name).collect();
        assert!(differing.is_empty(), "{differing:?}");
        n_reclaimed += claims.values().map(|epoch| *epoch as usize - 1).sum::<usize>();
    }
    assert!(n_reclaimed <= n_killed + n_stopped, "{n_reclaimed} reclaimed: {n_killed} killed, {n_stopped} stopped");
    eprintln!(
        "{n_plans} plans of {n_clips} units, {n_workers} workers at a time, clocks {}: {n_killed} workers killed, \
         {n_stopped} stopped, {n_reclaimed} units reclaimed; the bytes are those of one run",
        clocks.describe()
    );
}

#[test]
fn an_invalid_video_fails_alone_and_changed_plans_are_rejected() {
    let project = Project::with_clips("cluster", 2, 4.6);
    std::fs::write(project.video("broken.mp4"), b"no video").unwrap();
    assert_eq!(project.answer(&["plan"]).code, 0);
    // Two workers process a shard each.
    let first = project.answer(&["work", "--plan", "work/plan.json", "--shard", "0/2"]);
    let second = project.answer(&["work", "--plan", "work/plan.json", "--shard", "1/2"]);
    assert_eq!(first.json["done"].as_u64().unwrap() + second.json["done"].as_u64().unwrap(), 2, "{}", first.errors);
    assert_eq!(first.code + second.code, 2, "one of the shards has the invalid video");
    let status = project.answer(&["status", "--plan", "work/plan.json"]);
    assert_eq!((status.json["n_done"].as_u64(), status.json["n_failed"].as_u64()), (Some(2), Some(1)));
    assert_eq!(status.json["failures"].as_object().unwrap().len(), 1);
    // No unit is left; `--retry` processes the failed one again, but only with the planned content.
    let again = project.answer(&["work", "--plan", "work/plan.json"]);
    assert_eq!((again.code, again.json["done"].as_u64()), (2, Some(0)));
    assert_eq!(again.json["failed_before"].as_array().unwrap().len(), 1);
    std::fs::copy(project.clips().pop().unwrap(), project.video("broken.mp4")).unwrap();
    let retried = project.answer(&["work", "--plan", "work/plan.json", "--retry"]);
    assert_eq!((retried.code, retried.json["done"].as_u64()), (2, Some(0)), "another video: {}", retried.errors);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let planned = project.answer(&["work", "--plan", "work/plan.json"]);
    let counts = ["done", "up_to_date"].map(|key| planned.json[key].as_u64());
    assert_eq!((planned.code, counts), (0, [Some(3), Some(2)]), "{}", planned.errors);
    assert_eq!(project.answer(&["status", "--plan", "work/plan.json"]).json["n_failed"].as_u64(), Some(0));

    let plan = project.work().join("plan.json");
    let text = std::fs::read_to_string(&plan).unwrap();
    std::fs::write(&plan, text.replace("clip-1", "clip-7")).unwrap();
    let changed = project.answer(&["work", "--plan", "work/plan.json"]);
    assert!(changed.code == 1 && changed.errors.contains("was edited after"), "{}", changed.errors);
    std::fs::write(&plan, &text).unwrap();
    let file = project.dir().join("pipeline.toml");
    let settings = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, settings.replace("steps = 800", "steps = 900")).unwrap();
    assert_eq!(project.answer(&["work", "--plan", "work/plan.json"]).code, 0, "training settings are not planned");
    std::fs::write(&file, settings.replace("[pose2d]", "[pose2d]\nperson_every = 7")).unwrap();
    let other = project.answer(&["work", "--plan", "work/plan.json"]);
    assert!(other.code == 1 && other.errors.contains("changed since the plan was written"), "{}", other.errors);
}

#[test]
fn a_terminated_worker_finishes_its_unit_before_it_exits() {
    let project = Project::with_clips("asked", 2, 4.6);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let worker = worker(&project);
    while epochs(&project.work(), "claim").is_empty() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let started = loop {
        let started = children(worker.id());
        if !started.is_empty() && started.iter().all(|process| handles_term(*process)) {
            break started;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    // As a scheduler does: a signal to the worker and to all its processes.
    signal(&worker, Signal::TERM);
    for child in started {
        // The process may have ended meanwhile.
        let _ = kill_process(child, Signal::TERM);
    }
    assert_eq!(worker.wait_with_output().unwrap().status.code(), Some(143));
    let status = project.answer(&["status", "--plan", "work/plan.json"]).json;
    assert_eq!((status["n_done"].as_u64(), status["n_failed"].as_u64()), (Some(1), Some(0)), "{status}");
}

#[test]
fn eight_concurrent_workers_process_every_unit_once() {
    let n_clips = 8;
    let project = Project::with_clips("eight", n_clips, 4.6);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let workers: Vec<Child> = (0..8).map(|_| worker(&project)).collect();
    for mut worker in workers {
        assert!(worker.wait().unwrap().success());
    }
    for kind in ["claim", "end"] {
        let epochs = epochs(&project.work(), kind);
        assert!(epochs.len() == n_clips && epochs.values().all(|epoch| *epoch == 1), "{kind}: {epochs:?}");
    }
    let status = project.answer(&["status", "--plan", "work/plan.json"]).json;
    assert_eq!((status["n_done"].as_u64(), status["n_reclaimed"].as_u64()), (Some(8), Some(0)), "{status}");
    let extracted = files_under(&project.work().join("extract"));
    let records = extracted.iter().filter(|(name, _)| name.ends_with(".record.json")).count();
    assert_eq!(records, n_clips);
}
