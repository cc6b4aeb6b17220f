//! Head and trunk angles in datasets: written, read, verified, imported and forgotten; absent unless enabled.

use crate::fixtures::gesture_dataset::{FPS, dataset, dataset_of, with_posture};
use crate::fixtures::media::lifted_videos::{settings, shard_as, video};
use ndarray::s;
use orator_base::stage::progress::Silent;
use orator_base::types::posture::PostureChannel;
use orator_base::types::time::FrameRate;
use orator_dataset::config::DatasetConfig;
use orator_dataset::forget::dataset::without;
use orator_dataset::import::import;
use orator_dataset::import::take::TakeLimits;
use orator_dataset::import::write::ImportPlan;
use orator_dataset::info::About;
use orator_dataset::verify::verify::verify;
use orator_dataset::{Dataset, Sample, Split};
use orator_test_support::project::files_under;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Angles of all samples as bits, so that NaN equals NaN.
fn angles(dataset: &Dataset) -> Vec<(String, Option<Vec<u32>>)> {
    let samples = Split::ALL.iter().flat_map(|split| dataset.samples(*split));
    let bits = |sample: Sample| {
        let posture = sample.posture?;
        Some(posture.head.iter().chain(&posture.trunk).map(|v| v.to_bits()).collect())
    };
    samples.map(|sample| (sample.key.to_string(), bits(dataset.read(&sample).unwrap()))).collect()
}

fn posed(folder: &Path) -> Dataset {
    dataset_of(folder, posed_sample)
}

/// The sample with angles, and with all coordinates of its incomplete joint missing.
fn posed_sample(mut sample: Sample, phase: f64) -> Sample {
    let middle = sample.n_frames() / 2;
    sample.motion.joints.slice_mut(s![middle, 5, ..]).fill(f32::NAN);
    sample.meta = serde_json::json!({ "first_frame": 0, "fps": FPS, "start_secs": 0.0 });
    with_posture(sample, phase)
}

#[test]
fn angles_are_stored_exactly_and_removed_with_their_video() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("dataset");
    let dataset = posed(&target);
    let written = angles(&dataset);
    assert!(written.iter().all(|(_, angles)| angles.is_some()) && written.len() == 3);
    let stats = dataset.stats().posture.clone().unwrap();
    let [head, trunk] = [PostureChannel::Head, PostureChannel::Trunk].map(|channel| &stats[&channel]);
    // Every ninth frame of 99 and 64 hides the head; validation does not count.
    assert_eq!((head.n_visible, trunk.n_visible), ([163 - 11 - 8; 3], [163; 3]));
    assert!((0.3..0.35).contains(&trunk.mean[1]) || (0.25..0.3).contains(&trunk.mean[1]), "{:?}", trunk.mean);
    let card = fs::read_to_string(target.join("README.md")).unwrap();
    assert!(card.contains("the head in 88.3 %, the trunk in 100.0 % of the frames"), "{card}");
    assert!(["head.npy", "trunk.npy"].iter().all(|name| dataset.info().members.contains_key(*name)));
    drop(dataset);
    assert_eq!(verify(&target, true, &Silent).unwrap().problems, []);

    // Importing only the shards gives the same angles.
    let is_tar = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "tar");
    let fps = FrameRate::new(15, 1);
    let plan = ImportPlan {
        sources: files_under(&target).into_iter().map(|(_, path)| path).filter(is_tar).collect(),
        kind: None,
        speaker_id: None,
        about: About::new("host", fps),
        limits: TakeLimits { fps, min_frames: 64, max_difference_secs: 0.5, no_sound: false, units: None },
        dataset: DatasetConfig::default(),
    };
    let imported = folder.path().join("imported");
    fs::create_dir(&imported).unwrap();
    import(&plan, &imported, &Silent).unwrap();
    assert_eq!(verify(&imported, true, &Silent).unwrap().problems, []);
    let again = angles(&Dataset::open(&imported).unwrap());
    assert!(again == written, "the import changed angles");

    without(&target, &BTreeSet::from(["a-00000000".to_owned()])).unwrap();
    assert_eq!(verify(&target, true, &Silent).unwrap().problems, []);
    let remaining = Dataset::open(&target).unwrap();
    assert_eq!(remaining.stats().posture.as_ref().unwrap()[&PostureChannel::Trunk].n_visible, [64; 3]);
    assert!(angles(&remaining) == written[1..], "other angles changed");
    assert!(files_under(&target).iter().all(|(name, _)| !name.contains("a-00000000")));
}

#[test]
fn a_damaged_angle_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("dataset");
    let dataset = posed(&target);
    let sample = dataset.samples(Split::Train).remove(0);
    let at = sample.head.unwrap();
    let path = target.join(&sample.shard);
    drop(dataset);
    let original = fs::read(&path).unwrap();
    let mut damaged = original.clone();
    damaged[(at.offset + at.size - 2) as usize] ^= 0x40;
    fs::write(&path, &damaged).unwrap();
    let found = verify(&target, true, &Silent).unwrap().problems;
    assert!(
        found.iter().any(|problem| problem.message.contains("is damaged") && problem.message.contains(&*sample.key)),
        "{found:?}"
    );
    // A header with another number of rows.
    let mut damaged = original;
    let text = &mut damaged[at.offset as usize..][..128];
    let shape = text.windows(4).position(|bytes| bytes == b"(99,").unwrap();
    text[shape + 1] = b'8';
    fs::write(&path, &damaged).unwrap();
    assert!(!verify(&target, true, &Silent).unwrap().problems.is_empty());

    // Angles beyond half a turn are invalid; a single angle may be missing.
    for (value, n_problems) in [(4.0, 3), (f32::INFINITY, 3), (f32::NAN, 0)] {
        let target = folder.path().join(format!("{value}"));
        dataset_of(&target, |sample, phase| {
            let mut sample = posed_sample(sample, phase);
            sample.posture.as_mut().unwrap().trunk[[5, 1]] = value;
            sample
        });
        let found = verify(&target, true, &Silent).unwrap().problems;
        assert!(found.iter().all(|problem| problem.message.contains("frame 5: an angle of the trunk")), "{found:?}");
        assert_eq!(found.len(), n_problems);
    }
}

#[test]
fn a_dataset_without_angles_does_not_mention_them() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    assert!(angles(&dataset).iter().all(|(_, angles)| angles.is_none()));
    for file in ["info.json", "stats.json", "index.jsonl", "ledger.jsonl", "README.md", "videos/a-00000000.json"] {
        let text = fs::read_to_string(dataset.dir().join(file)).unwrap();
        assert!(!["head", "trunk", "posture"].iter().any(|word| text.contains(word)), "{file}: {text}");
    }
}

#[test]
fn a_run_writes_angles_if_enabled() {
    let folder = tempfile::tempdir().unwrap();
    let videos = [video(folder.path(), "talk", 300, 1)];
    let named = [(&videos[0], Split::Train)];
    let plain = settings(folder.path());
    let mut posed = plain.clone();
    posed.dataset.posture = true;
    let shards = |dir: &Path| -> Vec<(String, u64)> {
        let tars = files_under(dir).into_iter().filter(|(name, _)| name.ends_with(".tar"));
        tars.map(|(name, path)| (name, fs::metadata(path).unwrap().len())).collect()
    };
    let (report, without_angles) = shard_as(&plain, &videos, &named, "plain");
    report.unwrap();
    let (report, with_angles) = shard_as(&posed, &videos, &named, "posed");
    report.unwrap();
    assert_eq!(verify(&with_angles, true, &Silent).unwrap().problems, []);
    assert!(angles(&Dataset::open(&without_angles).unwrap()).iter().all(|(_, angles)| angles.is_none()));
    let dataset = Dataset::open(&with_angles).unwrap();
    assert!(angles(&dataset).iter().all(|(_, angles)| angles.is_some()));
    let stats = dataset.stats().posture.clone().unwrap();
    assert!(stats[&PostureChannel::Trunk].n_visible[0] > 0, "{stats:?}");
    assert!(shards(&with_angles) != shards(&without_angles));
}
