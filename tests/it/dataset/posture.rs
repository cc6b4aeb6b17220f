//! Head and trunk in datasets: written, read, verified, imported and forgotten; without them no trace.

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

/// Angles of all samples as bits, so that what is missing compares.
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

/// The sample with its angles, its one joint without an x missing as a whole.
fn posed_sample(mut sample: Sample, phase: f64) -> Sample {
    let middle = sample.n_frames() / 2;
    sample.motion.joints.slice_mut(s![middle, 5, ..]).fill(f32::NAN);
    sample.meta = serde_json::json!({ "first_frame": 0, "fps": FPS, "start_secs": 0.0 });
    with_posture(sample, phase)
}

#[test]
fn angles_are_kept_to_the_bit_and_go_with_their_video() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("dataset");
    let dataset = posed(&place);
    let written = angles(&dataset);
    assert!(written.iter().all(|(_, angles)| angles.is_some()) && written.len() == 3);
    let stats = dataset.stats().posture.clone().unwrap();
    let [head, trunk] = [PostureChannel::Head, PostureChannel::Trunk].map(|channel| &stats[&channel]);
    // Every ninth frame of 99 and 64 hides the head; validation does not count.
    assert_eq!((head.n_seen, trunk.n_seen), ([163 - 11 - 8; 3], [163; 3]));
    assert!((0.3..0.35).contains(&trunk.mean[1]) || (0.25..0.3).contains(&trunk.mean[1]), "{:?}", trunk.mean);
    let card = fs::read_to_string(place.join("README.md")).unwrap();
    assert!(card.contains("the head in 88.3 %, the trunk in 100.0 % of the frames"), "{card}");
    assert!(["head.npy", "trunk.npy"].iter().all(|name| dataset.info().members.contains_key(*name)));
    drop(dataset);
    assert_eq!(verify(&place, true, &Silent).unwrap().problems, []);

    // The shards by themselves give the same angles.
    let is_tar = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "tar");
    let fps = FrameRate::new(15, 1);
    let plan = ImportPlan {
        sources: files_under(&place).into_iter().map(|(_, path)| path).filter(is_tar).collect(),
        kind: None,
        about: About::new("host", fps),
        limits: TakeLimits { fps, min_frames: 64, max_difference_secs: 0.5, no_sound: false },
        dataset: DatasetConfig::default(),
    };
    let imported = folder.path().join("imported");
    fs::create_dir(&imported).unwrap();
    import(&plan, &imported, &Silent).unwrap();
    assert_eq!(verify(&imported, true, &Silent).unwrap().problems, []);
    let again = angles(&Dataset::open(&imported).unwrap());
    assert!(again == written, "other angles behind an import");

    without(&place, &BTreeSet::from(["a-00000000".to_owned()])).unwrap();
    assert_eq!(verify(&place, true, &Silent).unwrap().problems, []);
    let left = Dataset::open(&place).unwrap();
    assert_eq!(left.stats().posture.as_ref().unwrap()[&PostureChannel::Trunk].n_seen, [64; 3]);
    assert!(angles(&left) == written[1..], "other angles behind a forgotten video");
    assert!(files_under(&place).iter().all(|(name, _)| !name.contains("a-00000000")));
}

#[test]
fn a_damaged_angle_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("dataset");
    let dataset = posed(&place);
    let sample = dataset.samples(Split::Train).remove(0);
    let at = sample.head.unwrap();
    let path = place.join(&sample.shard);
    drop(dataset);
    let whole = fs::read(&path).unwrap();
    let mut damaged = whole.clone();
    damaged[(at.offset + at.size - 2) as usize] ^= 0x40;
    fs::write(&path, &damaged).unwrap();
    let found = verify(&place, true, &Silent).unwrap().problems;
    assert!(
        found.iter().any(|problem| problem.message.contains("is damaged") && problem.message.contains(&*sample.key)),
        "{found:?}"
    );
    // A header that promises other rows.
    let mut damaged = whole;
    let text = &mut damaged[at.offset as usize..][..128];
    let shape = text.windows(4).position(|bytes| bytes == b"(99,").unwrap();
    text[shape + 1] = b'8';
    fs::write(&path, &damaged).unwrap();
    assert!(!verify(&place, true, &Silent).unwrap().problems.is_empty());

    // Angles beyond half a turn were never angles; each may be missing alone.
    for (value, n_wrong) in [(4.0, 3), (f32::INFINITY, 3), (f32::NAN, 0)] {
        let place = folder.path().join(format!("{value}"));
        dataset_of(&place, |sample, phase| {
            let mut sample = posed_sample(sample, phase);
            sample.posture.as_mut().unwrap().trunk[[5, 1]] = value;
            sample
        });
        let found = verify(&place, true, &Silent).unwrap().problems;
        assert!(found.iter().all(|problem| problem.message.contains("frame 5: an angle of the trunk")), "{found:?}");
        assert_eq!(found.len(), n_wrong);
    }
}

#[test]
fn a_dataset_without_angles_has_no_trace_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    assert!(angles(&dataset).iter().all(|(_, angles)| angles.is_none()));
    for file in ["info.json", "stats.json", "index.jsonl", "ledger.jsonl", "README.md", "videos/a-00000000.json"] {
        let text = fs::read_to_string(dataset.dir().join(file)).unwrap();
        assert!(!["head", "trunk", "posture"].iter().any(|word| text.contains(word)), "{file}: {text}");
    }
}

#[test]
fn a_run_writes_angles_where_they_are_asked_for() {
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
    assert!(stats[&PostureChannel::Trunk].n_seen[0] > 0, "{stats:?}");
    assert!(shards(&with_angles) != shards(&without_angles));
}
