//! `[extract] fix_offset`: the sound of samples is taken as much later, or earlier, as the lips surely show.

use crate::fixtures::media::lifted_videos::{settings, shard_as, video};
use orator_base::stage::artifacts::Artifact;
use orator_base::types::sound::SoundOffset;
use orator_dataset::config::Settings;
use orator_dataset::{Dataset, Split};
use std::path::Path;

/// The sound of the only video's samples, in the order of time.
fn sounds(dir: &Path) -> Vec<Vec<f32>> {
    let dataset = Dataset::open(dir).unwrap();
    let mut refs: Vec<_> = Split::ALL.iter().flat_map(|&split| dataset.samples(split)).collect();
    refs.sort_by(|a, b| a.key.cmp(&b.key));
    refs.into_iter().map(|sample| dataset.read(&sample).unwrap().sound.samples).collect()
}

#[test]
fn late_and_early_sound_is_shifted_where_that_is_sure_and_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    let unit = video(root, "talk", 300, 3);
    let mut settings = settings(root);
    let work = settings.work.dir.clone();
    let made = |settings: &Settings, name: &str| {
        let (report, out) = shard_as(settings, std::slice::from_ref(&unit), &[(&unit, Split::Train)], name);
        report.unwrap();
        sounds(&out)
    };
    let plain = made(&settings, "plain");
    let offset = |secs: f64, confidence: f64| {
        let offset = SoundOffset { secs, correlation: 0.5, confidence, compared_secs: 20.0 };
        let path = Artifact::SoundOffset.path(&work, &unit);
        std::fs::write(path, serde_json::to_vec(&offset).unwrap()).unwrap();
    };
    offset(0.1, 1.0);
    assert_eq!(made(&settings, "not asked for"), plain);
    settings.extract.fix_offset = true;
    let late = made(&settings, "late");
    let n = plain[0].len();
    assert_eq!((late.len(), late[0].len()), (plain.len(), n));
    assert_eq!(late[0][..n - 1600], plain[0][1600..]);
    assert_eq!(late[0][n - 1600..], plain[1][..1600], "the second interval follows the first");
    offset(-0.1, 1.0);
    let early = made(&settings, "early");
    assert!(early[0][..1600].iter().all(|sample| *sample == 0.0), "there is no sound before the first");
    assert_eq!((&early[0][1600..], early[0].len()), (&plain[0][..n - 1600], n));
    offset(0.1, 0.5);
    assert_eq!(made(&settings, "not sure"), plain);
}
