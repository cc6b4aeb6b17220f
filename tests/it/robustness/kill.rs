//! A run that is killed at any time and resumed writes identical bytes and repeats no work. `ORATOR_KILLS` sets the
//! number of kills (`make prove`: 20).

use crate::fixtures::media::recogniser::project_with_words;
use orator_test_support::project::{Project, files_under};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

/// Modification times of the records under `work`, one per finished unit.
fn records(work: &Path) -> BTreeMap<String, SystemTime> {
    let files = files_under(work).into_iter().filter(|(name, _)| name.ends_with(".record.json"));
    files.filter_map(|(name, path)| Some((name, path.metadata().ok()?.modified().ok()?))).collect()
}

fn dataset(work: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = files_under(&work.join("dataset")).into_iter();
    files
        .filter(|(name, _)| !name.contains("attempt") && !name.ends_with(".lock"))
        .map(|(name, path)| (name, std::fs::read(path).unwrap()))
        .collect()
}

#[test]
fn a_run_killed_at_any_time_resumes_to_identical_bytes() {
    let n_kills: u32 = std::env::var("ORATOR_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let undisturbed = project_with_words("calm", 2, 4.6);
    let started = Instant::now();
    assert_eq!(undisturbed.run(&[]).code, 0);
    let duration = started.elapsed();
    let expected = dataset(&undisturbed.work());
    assert!(expected.keys().any(|name| name.ends_with(".tar")));

    let killed = project_with_words("killed", 2, 4.6);
    let (mut before, mut n_killed, mut random) = (BTreeMap::new(), 0, 0x9e37_79b9_7f4a_7c15_u64);
    // A run that ends before its kill does not count: its dataset is checked and removed, and another run starts.
    for _ in 0..20 * n_kills {
        if n_killed == n_kills {
            break;
        }
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let share = (random >> 33) as f64 / f64::from(1u32 << 31);
        let mut child = killed.start(&["run"]);
        std::thread::sleep(Duration::from_secs_f64(0.02 + share * duration.as_secs_f64()));
        n_killed += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        let now = records(&killed.work());
        for (name, time) in &before {
            assert_eq!(now.get(name), Some(time), "{name} was repeated");
        }
        before = now;
        if before.keys().any(|name| name.starts_with("dataset")) {
            assert!(dataset(&killed.work()) == expected, "the dataset differs after {n_killed} kills");
            std::fs::remove_dir_all(killed.work()).unwrap();
            before.clear();
        }
    }
    assert_eq!(n_killed, n_kills, "runs killed while they worked");
    assert_eq!(killed.run(&[]).code, 0);
    let after = records(&killed.work());
    for (name, time) in &before {
        assert_eq!(after.get(name), Some(time), "{name} was repeated by the last run");
    }
    assert!(dataset(&killed.work()) == expected, "the dataset differs after {n_killed} kills");
    eprintln!("killed {n_killed} runs; the dataset is identical");
}

#[test]
fn output_is_independent_of_the_number_of_workers() {
    let one = project_with_words("one-worker", 2, 4.6);
    let two = project_with_words("two-workers", 2, 4.6);
    assert_eq!(one.run(&["--jobs", "1"]).code, 0);
    assert_eq!(two.run(&["--jobs", "2"]).code, 0);
    assert!(dataset(&one.work()) == dataset(&two.work()));
}

#[test]
fn a_run_removes_attempts_of_ended_processes() {
    let project = Project::with_clips("swept", 1, 1.0);
    assert_eq!(project.run(&["--to", "extract"]).code, 0);
    // A zombie: an ended process that has not been waited for.
    let mut zombie = Command::new("true").spawn().unwrap();
    let stat = format!("/proc/{}/stat", zombie.id());
    while !std::fs::read_to_string(&stat).unwrap().contains(") Z ") {
        std::thread::sleep(Duration::from_millis(5));
    }
    let (host, process) = (project.work().join("extract/host"), zombie.id());
    let folder = host.join(format!(".gone-00000000.attempt-{process}-1"));
    let file = host.join(format!(".gone-00000000.record.attempt-{process}-1.json"));
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(&file, "half").unwrap();
    for path in [&folder, &file] {
        let old = SystemTime::now() - Duration::from_secs(2 * 24 * 60 * 60);
        std::fs::File::open(path).unwrap().set_modified(old).unwrap();
    }
    assert_eq!(project.run(&["--to", "extract"]).code, 0);
    assert!(!folder.exists() && !file.exists());
    zombie.wait().unwrap();
}
