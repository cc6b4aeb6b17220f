//! Splits by video: filled up to their shares, recorded, and never changed.

use crate::fixtures::media::lifted_videos::{settings, shard, shard_as, video};
use orator_base::stage::Unit;
use orator_dataset::config::{Settings, SplitUnit};
use orator_dataset::split::{Assignment, SplitBy, SplitPlan, SplitRecord, Unassigned, assign};
use orator_dataset::{Dataset, Split};
use orator_test_support::project::files_under;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const PLAN: SplitPlan =
    SplitPlan { unit: SplitUnit::Video, validation: 0.15, test: 0.1, guard_secs: 8.0, min_block_secs: 9.0 };

fn unassigned(name: &str, secs: f64) -> Unassigned<'_> {
    Unassigned { name, content: name, duration_secs: secs, accepted: vec![(0.0, secs)], named: None, recorded: None }
}

#[test]
fn split_sizes_approach_their_shares_in_any_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for n in [3, 8, 20, 200] {
        let names: Vec<String> = (0..n).map(|k| format!("v{k:03}")).collect();
        let secs: Vec<f64> = names.iter().map(|_| rng.random_range(20.0..900.0)).collect();
        let mut videos: Vec<Unassigned> = names.iter().zip(&secs).map(|(name, secs)| unassigned(name, *secs)).collect();
        let of = |videos: &[Unassigned]| -> BTreeMap<String, Split> {
            let split = |(video, answer): (&Unassigned, Assignment)| match answer {
                Assignment::In(split, SplitBy::Share) => (video.name.to_owned(), split),
                other => panic!("{other:?}"),
            };
            videos.iter().zip(assign(videos, &[], &PLAN)).map(split).collect()
        };
        let first = of(&videos);
        videos.shuffle(&mut rng);
        assert_eq!(first, of(&videos));
        let total: f64 = secs.iter().sum();
        let longest = secs.iter().copied().fold(0.0, f64::max);
        for (split, share) in [(Split::Train, 0.75), (Split::Validation, 0.15), (Split::Test, 0.1)] {
            let filled: f64 = videos.iter().filter(|video| first[video.name] == split).map(|v| v.duration_secs).sum();
            assert!(filled > 0.0, "{n} videos: {split:?} is empty");
            // Videos are not divided: a split is off by at most one video, and many videos meet the shares.
            assert!((filled - share * total).abs() <= longest, "{n} videos, {split:?}: {filled} of {total}");
            assert!(n < 200 || (filled / total - share).abs() < 0.01, "{split:?}: {filled} of {total}");
        }
    }
}

/// Split of each video, by its file.
fn splits(out: &Path) -> BTreeMap<String, Split> {
    let info = Dataset::open(out).unwrap().info().clone();
    info.videos.into_iter().filter_map(|video| Some((video.file, video.split?))).collect()
}

fn by_video(root: &Path) -> Settings {
    let mut settings = settings(root);
    settings.dataset.split_by = SplitUnit::Video;
    settings
}

#[test]
fn splits_are_restored_from_the_record_or_the_dataset() {
    let dir = tempfile::tempdir().unwrap();
    let settings = by_video(dir.path());
    let units: Vec<Unit> = (0..9).map(|n| video(dir.path(), &format!("v{n}"), 140 + 4 * n as usize, n)).collect();
    let record = dir.path().join("work/splits/host.json");
    // The run ends before its dataset is moved into place: the next run continues from the record.
    let few = splits(&shard_as(&settings, &units[..4], &[], "killed").1);
    assert!(record.is_file());
    let grown = splits(&shard_as(&settings, &units, &[], "grown").1);
    assert!(few.iter().all(|(file, split)| grown[file] == *split), "{few:?} {grown:?}");
    let at_once = {
        let other = tempfile::tempdir().unwrap();
        let settings = by_video(other.path());
        let units: Vec<Unit> = (0..9).map(|n| video(other.path(), &format!("v{n}"), 140 + 4 * n as usize, n)).collect();
        splits(&shard_as(&settings, &units, &[], "out").1)
    };
    assert_ne!(at_once, grown, "the record has no effect");
    // Without a dataset: from the record.
    assert_eq!(splits(&shard_as(&settings, &units, &[], "again").1), grown);
    // Without a record: from the existing dataset.
    let target = dir.path().join("work/dataset/host");
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    fs::rename(dir.path().join("again"), &target).unwrap();
    let before = fs::read(&record).unwrap();
    fs::remove_file(&record).unwrap();
    assert_eq!(splits(&shard_as(&settings, &units, &[], "taken-over").1), grown);
    assert_eq!(fs::read(&record).unwrap(), before);
    // A damaged record is an error that states what to do, not a new assignment.
    fs::write(&record, &before[..before.len() / 2]).unwrap();
    let error = format!("{:#}", shard_as(&settings, &units, &[], "damaged").0.unwrap_err());
    assert!(error.contains("host.json is damaged") && error.contains("delete it"), "{error}");
}

#[test]
fn the_split_unit_chosen_for_few_videos_is_used_for_more() {
    let dir = tempfile::tempdir().unwrap();
    let units: Vec<Unit> = (0..9).map(|n| video(dir.path(), &format!("v{n}"), 140 + 4 * n as usize, n)).collect();
    let record = |dir: &Path| SplitRecord::read(&dir.join("work/splits/host.json")).unwrap().unwrap();
    let (report, out) = shard(dir.path(), &units[..7], "seven");
    let line = report.unwrap().line;
    assert!(line.contains("split by time, 7.") && line.contains("chosen for 7 videos, fewer than 8"), "{line}");
    let (first, seven) = (record(dir.path()), splits(&out));
    let (report, out) = shard(dir.path(), &units, "nine");
    assert!(report.unwrap().line.contains("chosen for 7 videos, fewer than 8"));
    let nine = splits(&out);
    assert!(seven.iter().all(|(file, split)| nine[file] == *split));
    let second = record(dir.path());
    assert!(first.videos.iter().all(|(content, video)| second.videos[content] == *video));
    assert_eq!((second.unit, second.videos.len()), (SplitUnit::Time, 9));
    let card = fs::read_to_string(out.join("README.md")).unwrap();
    assert!(card.contains("divided by time") && card.contains("chosen for 7 videos"), "{card}");
    // An explicit `split_by` gives another division.
    let (report, _) = shard_as(&by_video(dir.path()), &units, &[], "by-video");
    assert!(report.unwrap().line.contains("split by video (the configuration says so)"));
    assert!(record(dir.path()).videos.values().all(|video| video.blocks.is_empty()));
    // Nine videos in the first run are split by video.
    let other = tempfile::tempdir().unwrap();
    let units: Vec<Unit> = (0..9).map(|n| video(other.path(), &format!("v{n}"), 140, n)).collect();
    let (report, out) = shard(other.path(), &units, "out");
    assert!(report.unwrap().line.contains("split by video (chosen for 9 videos, at least 8)"));
    assert!(fs::read_to_string(out.join("README.md")).unwrap().contains("Each video is in one split (chosen for 9"));
}

#[test]
fn a_dataset_of_an_earlier_version_retains_its_splits() {
    let dir = tempfile::tempdir().unwrap();
    let units: Vec<Unit> = (0..4).map(|n| video(dir.path(), &format!("v{n}"), 140, n)).collect();
    let (_, out) = shard_as(&by_video(dir.path()), &units[..3], &[], "old");
    // As an earlier version wrote it: no rule, and splits by a hash of the content.
    let info = fs::read_to_string(out.join("info.json")).unwrap();
    let mut info: serde_json::Value = serde_json::from_str(&info).unwrap();
    info.as_object_mut().unwrap().remove("split_rule");
    info["videos"].as_array_mut().unwrap().iter_mut().for_each(|video| video["split_by"] = "content".into());
    fs::write(out.join("info.json"), info.to_string()).unwrap();
    let before = splits(&out);
    let target = dir.path().join("work/dataset/host");
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    fs::rename(&out, &target).unwrap();
    fs::remove_dir_all(dir.path().join("work/splits")).unwrap();
    let (report, out) = shard(dir.path(), &units, "new");
    assert!(report.unwrap().line.contains("split by video (as it was before)"));
    let after = splits(&out);
    assert_eq!(after.len(), 4);
    assert!(before.iter().all(|(file, split)| after[file] == *split));
    assert!(files_under(&dir.path().join("work/splits")).len() == 1);
}
