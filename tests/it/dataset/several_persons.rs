//! Several persons in the videos of one speaker give a warning, unless `same_person` is set.

use crate::fixtures::media::lifted_videos::{settings, shard_as, video};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{self, Artifact};
use orator_base::types::image::Image;
use orator_dataset::Split;
use orator_dataset::config::SpeakerConfig;
use orator_media::opencv::png;
use serde_json::json;
use std::path::Path;

/// Writes the portrait of a face, stretched vertically by `height`.
fn write_portrait(work: &Path, unit: &Unit, height: f64) {
    let point = |k: u32| [f64::from(k % 5), height * f64::from(k / 5), f64::from(k % 3)];
    let face: Vec<[f64; 3]> = (0..40).map(point).collect();
    let colours = vec![0.5; 48];
    let portrait = json!({ "face": face, "skin": colours, "hair": colours, "n_frames": 20 });
    std::fs::write(Artifact::Portrait.path(work, unit), portrait.to_string()).unwrap();
    png::write(&Artifact::FacePicture.path(work, unit), &Image::filled(128, 128, [200, 150, 120])).unwrap();
}

#[test]
fn a_second_person_gives_a_warning_unless_same_person_is_set() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    let units = [("one", 4), ("two", 5), ("other", 6)].map(|(name, seed)| video(root, name, 300, seed));
    let mut settings = settings(root);
    let work = settings.work.dir.clone();
    let splits = [(&units[0], Split::Train), (&units[1], Split::Validation), (&units[2], Split::Test)];
    let facts = |settings: &orator_dataset::config::Settings, name: &str| {
        let report = shard_as(settings, &units, &splits, name).0.unwrap();
        let several = report.facts["several_persons"].clone();
        assert_eq!(report.line.contains("appear to show 2 persons"), !several.is_null(), "{}", report.line);
        several
    };
    std::fs::create_dir_all(artifacts::dir(&work, Artifact::Portrait.stage(), &units[0])).unwrap();
    assert!(facts(&settings, "nothing is known").is_null());
    for (unit, height) in units.iter().zip([1.0, 1.001, 1.002]) {
        write_portrait(&work, unit, height);
    }
    assert!(facts(&settings, "one person").is_null());
    write_portrait(&work, &units[2], 2.0);
    let warning = facts(&settings, "two people");
    assert_eq!(warning["videos"][1], json!(["other.mp4"]), "{warning}");
    let speaker = SpeakerConfig { name: units[0].speaker.clone(), same_person: true, ..SpeakerConfig::default() };
    settings.speaker = vec![speaker];
    assert!(facts(&settings, "said to be one").is_null());
}
