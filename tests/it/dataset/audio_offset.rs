//! `[extract] fix_offset`: the audio of samples is shifted by the offset measured from the lips, if that is confident.

use crate::fixtures::media::lifted_videos::{settings, shard_as, video};
use orator_base::stage::artifacts::Artifact;
use orator_base::types::sound::SoundOffset;
use orator_dataset::config::Settings;
use orator_dataset::{Dataset, Split};
use std::path::Path;

/// Audio of the samples of the only video, in order of time.
fn audio_of_samples(dir: &Path) -> Vec<Vec<f32>> {
    let dataset = Dataset::open(dir).unwrap();
    let mut refs: Vec<_> = Split::ALL.iter().flat_map(|&split| dataset.samples(split)).collect();
    refs.sort_by(|a, b| a.key.cmp(&b.key));
    refs.into_iter().map(|sample| dataset.read(&sample).unwrap().sound.samples).collect()
}

#[test]
fn late_and_early_audio_is_shifted_if_confident_and_enabled() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    let unit = video(root, "talk", 300, 3);
    let mut settings = settings(root);
    let work = settings.work.dir.clone();
    let written = |settings: &Settings, name: &str| {
        let (report, out) = shard_as(settings, std::slice::from_ref(&unit), &[(&unit, Split::Train)], name);
        report.unwrap();
        audio_of_samples(&out)
    };
    let plain = written(&settings, "plain");
    let offset = |secs: f64, confidence: f64| {
        let offset = SoundOffset { secs, correlation: 0.5, confidence, compared_secs: 20.0 };
        let path = Artifact::SoundOffset.path(&work, &unit);
        std::fs::write(path, serde_json::to_vec(&offset).unwrap()).unwrap();
    };
    offset(0.1, 1.0);
    assert_eq!(written(&settings, "not asked for"), plain);
    settings.extract.fix_offset = true;
    let late = written(&settings, "late");
    let n = plain[0].len();
    assert_eq!((late.len(), late[0].len()), (plain.len(), n));
    assert_eq!(late[0][..n - 1600], plain[0][1600..]);
    assert_eq!(late[0][n - 1600..], plain[1][..1600], "the second interval follows the first");
    offset(-0.1, 1.0);
    let early = written(&settings, "early");
    assert!(early[0][..1600].iter().all(|sample| *sample == 0.0), "no audio precedes the first interval");
    assert_eq!((&early[0][1600..], early[0].len()), (&plain[0][..n - 1600], n));
    offset(0.1, 0.5);
    assert_eq!(written(&settings, "not sure"), plain);
}
