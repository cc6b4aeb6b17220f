//! Unit tests of `orator_cluster::plan`.

use orator_cluster::plan::{ClusterPlan, PART_SECS, PlannedUnit, UnitShare, settings_hash, split_and_sort};
use orator_dataset::config::load;

pub(super) fn example(speaker: &str, video: &str) -> PlannedUnit {
    PlannedUnit {
        speaker: speaker.to_owned(),
        video: video.to_owned(),
        source: video.into(),
        inputs: Vec::new(),
        secs: None,
        share: UnitShare::AllStages,
        needs: Vec::new(),
    }
}

fn video(name: &str, secs: f64) -> PlannedUnit {
    PlannedUnit { secs: Some(secs), ..example("host", name) }
}

#[test]
fn long_videos_are_split_and_prerequisites_come_first() {
    let units = split_and_sort(vec![video("short", 300.0), video("long", 1700.0), video("middle", 899.0)], PART_SECS);
    let names: Vec<String> = units.iter().map(PlannedUnit::to_string).collect();
    let parts = ["host/long (part 1 of 3)", "host/long (part 2 of 3)", "host/long (part 3 of 3)"];
    assert_eq!(names[..2], ["host/long (extract)", "host/middle"]);
    assert_eq!(
        (&names[2..5], &names[5..]),
        (&parts.map(str::to_owned)[..], &["host/short", "host/long"].map(str::to_owned)[..])
    );
    assert_eq!((&units[0].needs[..], &units[3].needs[..], &units[6].needs[..]), (&[][..], &[0][..], &[2, 3, 4][..]));
    let media: f64 = units.iter().filter_map(PlannedUnit::media_secs).sum();
    assert!((media - 2899.0).abs() < 1e-9);
}

#[test]
fn a_plan_of_another_version_is_rejected_with_advice() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("plan.json");
    std::fs::write(&file, "{\"version\": 2, \"units\": [{\"bytes\": 1}]}").unwrap();
    let error = ClusterPlan::read(&file).unwrap_err().to_string();
    assert!(error.contains("version 2, expected 3: create it again with `orator plan`"), "{error}");
}

#[test]
fn training_settings_do_not_change_the_hash() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("pipeline.toml");
    std::fs::write(&file, "[[speaker]]\nname = \"host\"\nvideos = [\"host/*.mp4\"]\n").unwrap();
    let hash = |set: &str| settings_hash(&load(&file, &[set.to_owned()]).unwrap()).unwrap();
    let plain = hash("work.jobs=2");
    for set in ["work.jobs=3", "gan.steps=7", "seq2seq.steps=7"] {
        assert_eq!(hash(set), plain, "{set}");
    }
    assert_ne!(hash("lift.smooth_arms=0.5"), plain);
}
