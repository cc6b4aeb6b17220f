//! Splits by time: a long video has samples in all three splits, and no split depends on frames or audio of another.

use crate::fixtures::footage::FPS;
use crate::fixtures::media::lifted_videos::{made_video, settings, shard, shard_with, unit, video, video_with};
use ndarray::{Array3, s};
use orator_base::audio::mel;
use orator_base::stage::Unit;
use orator_base::stage::progress::Silent;
use orator_base::types::sound::samples_of;
use orator_dataset::config::{LiftConfig, SplitUnit};
use orator_dataset::verify::verify::verify;
use orator_dataset::write::entry::VideoEntry;
use orator_dataset::{Dataset, Split};
use orator_gesture::train::gan::speakers::normalisation;
use orator_gesture::train::gan::windows::WindowLoader;
use orator_pipeline::lift::lifter::context_secs;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::ops::Range;
use std::path::Path;

/// Ten minutes with a cut every 40 s.
const TALK: usize = 9_000;
const WINDOW: usize = 64;

fn talk(root: &Path) -> Unit {
    made_video(root, "talk", TALK, (1, 1), 600, |_, _| ())
}

fn problems(dir: &Path) -> Vec<String> {
    verify(dir, true, &Silent).unwrap().problems.into_iter().map(|problem| problem.message).collect()
}

/// Frames of every sample with its split, in order.
fn frames(dataset: &Dataset) -> Vec<(Range<usize>, Split)> {
    let samples = Split::ALL.into_iter().flat_map(|split| dataset.samples(split));
    let of = |key: &str| key.rsplit('-').next().unwrap().parse::<usize>().unwrap();
    let mut frames: Vec<_> = samples.map(|s| (of(&s.key)..of(&s.key) + s.n_frames, s.split)).collect();
    frames.sort_by_key(|(frames, _)| frames.start);
    frames
}

#[test]
fn one_long_video_gives_all_three_splits_without_a_leak() {
    let dir = tempfile::tempdir().unwrap();
    let (report, out) = shard(dir.path(), &[talk(dir.path())], "out");
    let report = report.unwrap();
    assert!(report.line.contains("(chosen for 1 video, fewer than 8)"), "{}", report.line);
    assert!(!report.line.contains("warning"), "{}", report.line);
    assert_eq!(problems(&out), [""; 0]);
    let dataset = Dataset::open(&out).unwrap();
    let rule = dataset.info().split_rule.clone().unwrap();
    assert_eq!(rule.unit, SplitUnit::Time);
    let secs = |split: Split| dataset.info().splits[split.name()].secs;
    let total: f64 = Split::ALL.map(secs).iter().sum();
    assert!(total > 560.0, "{total} s of 600 are used");
    for (split, share) in [(Split::Train, 0.7), (Split::Validation, 0.15), (Split::Test, 0.15)] {
        assert!((secs(split) / total - share).abs() < 0.03, "{split:?}: {} of {total}", secs(split));
    }
    // The video is counted in each split, its seconds once.
    assert_eq!(Split::ALL.map(|split| dataset.info().splits[split.name()].videos.len()), [1; 3]);
    let footage = &dataset.stats().footage;
    assert!((footage.accepted_secs - total).abs() < 1e-6 && footage.rejected_secs["between splits"] > 10.0);
    assert_eq!(dataset.stats().n_visible[5], dataset.info().splits["train"].frames as u64);

    // Frames that influence a window of a split influence no frame of another.
    let margin = (context_secs(&LiftConfig::default()) * FPS.per_sec()).ceil() as usize;
    assert!(rule.guard_secs > FPS.secs(WINDOW) + FPS.secs(margin));
    let extended = |frames: &Range<usize>| frames.start.saturating_sub(margin)..frames.end + margin;
    let disjoint = |a: &Range<usize>, b: &Range<usize>| a.end <= b.start || b.end <= a.start;
    let frames = frames(&dataset);
    for (own, split) in &frames {
        for (other, _) in frames.iter().filter(|(_, of)| of != split) {
            assert!(disjoint(&extended(own), other), "{own:?} and {other:?}");
            assert!(disjoint(&extended(own), &extended(other)), "{own:?} and {other:?} depend on a common frame");
            // A window shifted out of its sample by its length does not overlap the other sample, either.
            assert!(disjoint(&(own.start.saturating_sub(WINDOW)..own.end + WINDOW), other));
            let sound = |frames: &Range<usize>| samples_of(FPS, 16_000, frames.clone());
            let context = sound(own).start.saturating_sub(mel::FFT)..sound(own).end + mel::FFT;
            assert!(disjoint(&context, &sound(other)));
        }
    }
}

/// All windows of the training split as loaded by the trainer.
fn windows(out: &Path) -> Vec<f32> {
    let dataset = Dataset::open(out).unwrap();
    let normal = normalisation(&dataset).unwrap();
    let loader = WindowLoader::load(&dataset, Split::Train, &normal, WINDOW, WINDOW).unwrap();
    let batch = loader.batch(&(0..loader.len()).collect::<Vec<_>>()).unwrap();
    let values = |tensor: &candle_core::Tensor| tensor.flatten_all().unwrap().to_vec1::<f32>().unwrap();
    [&batch.mels, &batch.poses, &batch.mask].into_iter().flat_map(values).collect()
}

#[test]
fn training_windows_do_not_depend_on_other_splits() {
    let dir = tempfile::tempdir().unwrap();
    let (_, out) = shard(dir.path(), &[talk(dir.path())], "out");
    let frames = frames(&Dataset::open(&out).unwrap());
    let train: Vec<Range<usize>> =
        frames.into_iter().filter(|(_, split)| *split == Split::Train).map(|(frames, _)| frames).collect();
    let other = tempfile::tempdir().unwrap();
    let changed = made_video(other.path(), "talk", TALK, (1, 1), 600, |joints: &mut Array3<f32>, sound| {
        let mut rng = ChaCha8Rng::seed_from_u64(99);
        for t in (0..TALK).filter(|t| !train.iter().any(|frames| frames.contains(t))) {
            joints.slice_mut(s![t, 1.., ..]).mapv_inplace(|_| rng.random_range(-0.5f32..0.5));
            let range = samples_of(FPS, 16_000, t..t + 1);
            let end = range.end.min(sound.len());
            sound[range.start.min(end)..end].iter_mut().for_each(|sample| *sample = rng.random());
        }
    });
    let (_, changed) = shard(other.path(), &[changed], "out");
    assert_eq!(problems(&changed), [""; 0]);
    let windows = [windows(&out), windows(&changed)];
    assert!(windows[0].len() > 100_000 && windows[0] == windows[1]);
    let bytes = |dir: &Path, split: &str| -> Vec<Vec<u8>> {
        let mut files: Vec<_> = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let is_own = |file: &std::path::PathBuf| file.file_name().unwrap().to_str().unwrap().starts_with(split);
        files.into_iter().filter(is_own).map(|file| fs::read(file).unwrap()).collect()
    };
    assert_eq!(bytes(&out, "train-"), bytes(&changed, "train-"));
    assert_ne!(bytes(&out, "test-"), bytes(&changed, "test-"));
}

#[test]
fn inconsistent_splits_are_detected() {
    let dir = tempfile::tempdir().unwrap();
    let (_, out) = shard(dir.path(), &[talk(dir.path())], "out");
    let info = fs::read_to_string(out.join("info.json")).unwrap();
    let mut entry = fs::read_dir(out.join("videos")).unwrap().map(|entry| entry.unwrap().path());
    let entry = entry.find(|path| path.extension().is_some_and(|end| end == "json")).unwrap();
    let original = fs::read_to_string(&entry).unwrap();
    let found = |expected: &str| {
        let problems = problems(&out);
        assert!(problems.iter().any(|problem| problem.contains(expected)), "{expected}: {problems:?}");
    };
    // A video in two splits is valid only with splits by time.
    fs::write(out.join("info.json"), info.replace("\"unit\": \"time\"", "\"unit\": \"video\"")).unwrap();
    found("it has samples in several splits, but the dataset is not divided by time");
    // A gap shorter than `guard_secs`.
    let mut wide: serde_json::Value = serde_json::from_str(&info).unwrap();
    wide["split_rule"]["guard_secs"] = 9.0.into();
    fs::write(out.join("info.json"), wide.to_string()).unwrap();
    found("expected at least 9.00 s between splits");
    fs::write(out.join("info.json"), &info).unwrap();
    // A sample outside its block.
    let mut moved: serde_json::Value = serde_json::from_str(&original).unwrap();
    moved["blocks"][0]["split"] = "test".into();
    fs::write(&entry, moved.to_string()).unwrap();
    found("is not in a block of the train split");
    assert!(VideoEntry::read(&entry).is_ok());
    fs::write(&entry, original).unwrap();
    assert_eq!(problems(&out), [""; 0]);
}

#[test]
fn a_new_video_changes_no_block_and_short_clips_fill_splits() {
    let dir = tempfile::tempdir().unwrap();
    let talk = talk(dir.path());
    let (_, first) = shard(dir.path(), std::slice::from_ref(&talk), "first");
    let target = dir.path().join("work/dataset/host");
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    fs::rename(&first, &target).unwrap();
    let clips: Vec<Unit> = (0..2).map(|n| video(dir.path(), &format!("clip{n}"), 300, 10 + n)).collect();
    let (report, out) = shard(dir.path(), &[talk, clips[0].clone(), clips[1].clone()], "second");
    assert!(report.unwrap().line.contains("1 video reused unchanged"));
    assert_eq!(problems(&out), [""; 0]);
    let info = Dataset::open(&out).unwrap().info().clone();
    let of = |file: &str| info.videos.iter().find(|video| video.file == file).unwrap().clone();
    assert!(of("talk.mp4").split.is_none() && of("talk.mp4").blocks.len() == 3);
    assert!(of("clip0.mp4").split.is_some() && of("clip1.mp4").split.is_some());

    // A single short video is divided as far as possible; a shorter one is used for training.
    let single = tempfile::tempdir().unwrap();
    let (report, out) = shard(single.path(), &[video(single.path(), "minute", 900, 5)], "minute");
    assert!(!report.unwrap().line.contains("warning"));
    assert_eq!(Dataset::open(&out).unwrap().info().splits.values().filter(|split| split.samples > 0).count(), 3);
    let single = tempfile::tempdir().unwrap();
    let (report, out) = shard(single.path(), &[video(single.path(), "short", 150, 5)], "short");
    assert!(report.unwrap().line.contains("no sample in the test split: too little footage was accepted"));
    assert_eq!(Dataset::open(&out).unwrap().info().splits["train"].samples, 2);
}

#[test]
fn audio_shared_by_two_videos_is_never_in_two_splits() {
    let dir = tempfile::tempdir().unwrap();
    // A shorter re-upload: the same audio from the beginning, with other block boundaries.
    let (talk, copy) = (talk(dir.path()), video_with(dir.path(), "copy", 6_000, 2, 1));
    let (report, out) = shard(dir.path(), &[talk.clone(), copy.clone()], "out");
    let line = report.unwrap().line;
    assert!(!line.contains("share"), "{line}");
    assert_eq!(problems(&out), [""; 0]);
    let leakage: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("leakage.json")).unwrap()).unwrap();
    assert_eq!((leakage["shared"].as_array().unwrap().len(), leakage["leaks"].as_array().unwrap().len()), (1, 0));
    let dataset = Dataset::open(&out).unwrap();
    assert!(dataset.stats().footage.rejected_secs["duplicate"] > 5.0);
    assert!(dataset.info().videos.iter().all(|video| video.samples > 0));
    // A split named in the configuration applies to the complete video.
    let named = tempfile::tempdir().unwrap();
    assert_eq!(settings(named.path()).dataset.split_by, SplitUnit::Auto);
    let talk = made_video(named.path(), "talk", TALK, (1, 1), 600, |_, _| ());
    let copy = video_with(named.path(), "copy", 6_000, 2, 1);
    let (report, _) = shard_with(named.path(), &[talk, copy.clone()], &[(&copy, Split::Test)], "out");
    let line = report.unwrap().line;
    assert!(line.contains("split by video (the configuration names the split of videos)"), "{line}");
    assert!(unit(named.path(), "copy") == copy);
}
