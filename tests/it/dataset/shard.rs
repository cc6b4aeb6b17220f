//! The dataset stage on a generated work folder: content of the dataset, and inputs that do not affect its bytes.

use crate::fixtures::footage::{FPS, good};
use crate::fixtures::media::lifted_videos::{settings, shard, shard_as, shard_with, unit, video, video_with};
use ndarray::s;
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::progress::Silent;
use orator_base::types::skeleton::{L_HAND, parent};
use orator_base::types::sound::samples_of;
use orator_dataset::config::SplitUnit;
use orator_dataset::split::SplitBy;
use orator_dataset::verify::verify::{read_ledgers, verify};
use orator_dataset::{Dataset, Split};
use orator_test_support::project::files_under;
use std::fs;
use std::path::Path;

fn bytes(dir: &Path) -> Vec<(String, Vec<u8>)> {
    files_under(dir).into_iter().map(|(name, file)| (name, fs::read(file).unwrap())).collect()
}

fn assert_valid(dir: &Path) {
    let found = verify(dir, true, &Silent).unwrap();
    assert!(found.problems.is_empty() && found.n_samples > 0, "{found:?}");
}

#[test]
fn bytes_do_not_depend_on_the_order_or_folder_of_videos() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let names = ["b-roll", "a_Talk", "c"];
    let videos = |root: &Path| -> Vec<Unit> {
        names.iter().enumerate().map(|(seed, name)| video(root, name, 150 + seed, seed as u64)).collect()
    };
    let mut units = videos(one.path());
    let (report, first) = shard(one.path(), &units, "first");
    assert_eq!(report.unwrap().line.matches(" in 2 intervals").count(), 3);
    units.reverse();
    let (_, second) = shard(one.path(), &units, "second");
    let (_, third) = shard(two.path(), &videos(two.path()), "third");
    assert_eq!(bytes(&first), bytes(&second));
    // The record of the first run has no effect, either.
    fs::remove_file(one.path().join("work/splits/host.json")).unwrap();
    assert_eq!(bytes(&first), bytes(&shard(one.path(), &units, "anew").1));
    assert_eq!(bytes(&first), bytes(&third));
    let text: String = bytes(&first).iter().map(|(_, bytes)| String::from_utf8_lossy(bytes).into_owned()).collect();
    assert!(!text.contains(&*one.path().to_string_lossy()));
}

#[test]
fn samples_contain_the_frames_and_audio_of_their_interval() {
    let dir = tempfile::tempdir().unwrap();
    let units = [video(dir.path(), "long", 200, 3), video(dir.path(), "short", 140, 9)];
    let (report, out) = shard(dir.path(), &units, "out");
    let dataset = Dataset::open(&out).unwrap();
    assert_valid(&out);
    // The weighted median of bone lengths is that of the longer video.
    let lengths = &dataset.info().bone_lengths_metres;
    assert!(!out.join("videos/none.json").exists());
    assert!((lengths[0] - 0.13).abs() < 1e-6 && lengths[L_HAND - 1] == 0.0, "{lengths:?}");
    let refs: Vec<_> = Split::ALL.iter().flat_map(|&split| dataset.samples(split)).collect();
    assert_eq!(refs.len(), 4);
    for sample_ref in &refs {
        let sample = dataset.read(sample_ref).unwrap();
        let (name, unit) = if sample.key.starts_with("long") { ("long", &units[0]) } else { ("short", &units[1]) };
        let source = blake3::hash(&fs::read(&unit.source).unwrap()).to_hex();
        let start = sample.meta["first_frame"].as_u64().unwrap() as usize;
        assert_eq!(sample.key, format!("{name}-{}-{start:06}", &source[..8]));
        let audio = Artifact::Sound.path(&dir.path().join("work"), unit);
        let recorded: Vec<i16> = hound::WavReader::open(audio).unwrap().samples().map(Result::unwrap).collect();
        let range = samples_of(FPS, 16_000, start..start + sample.n_frames());
        let mut expected: Vec<f32> =
            recorded[range.start..range.end.min(recorded.len())].iter().map(|&s| f32::from(s) / 32_768.0).collect();
        expected.resize(range.len(), 0.0);
        assert_eq!(sample.sound.samples, expected);
        let keypoints = good(start + sample.n_frames()).keypoints;
        assert_eq!(sample.pose2d.slice(s![.., 17..38, ..]), keypoints.left_hand.slice(s![start.., .., ..]));
        for joint in 1..49 {
            let (a, b) = (parent(joint).unwrap(), joint);
            let bone = &sample.motion.joints.slice(s![0, b, ..]) - &sample.motion.joints.slice(s![0, a, ..]);
            let own = if name == "long" { 0.13 } else { 0.19 };
            let length = if lengths[joint - 1] == 0.0 { 0.0 } else { own };
            assert!((f64::from(bone.mapv(|v| v * v).sum().sqrt()) - length).abs() < 1e-5);
        }
    }
    let footage = &dataset.stats().footage;
    assert_eq!((footage.n_videos, footage.n_intervals, footage.secs), (2, 4, 340.0 / 15.0));
    // Each wav lacks its last sample, and frames are rounded to samples.
    assert!(footage.padded_sound_secs > 0.0 && footage.padded_sound_secs < 5.0 / 16_000.0);
    assert_eq!(dataset.stats().n_visible[5], dataset.info().splits["train"].frames as u64);
    assert_eq!((footage.accepted_secs, footage.failed_secs), (340.0 / 15.0, 0.0));
    assert!(report.unwrap().facts.contains_key("windows"));
}

#[test]
fn a_new_video_changes_no_split_of_other_videos() {
    let dir = tempfile::tempdir().unwrap();
    let units: Vec<Unit> = (0..14).map(|n| video(dir.path(), &format!("talk{n}"), 130, n)).collect();
    let split_of = |out: &Path| {
        let info = Dataset::open(out).unwrap().info().clone();
        info.splits
            .into_iter()
            .flat_map(|(split, info)| info.videos.into_iter().map(move |v| (v, split.clone())))
            .collect()
    };
    let few: std::collections::BTreeMap<String, String> = split_of(&shard(dir.path(), &units[..8], "few").1);
    let many: std::collections::BTreeMap<String, String> = split_of(&shard(dir.path(), &units, "many").1);
    assert_eq!((few.len(), many.len()), (8, 14));
    assert!(few.iter().all(|(video, split)| many[video] == *split));
    assert!(many.values().collect::<std::collections::BTreeSet<_>>().len() > 1);
}

#[test]
fn a_new_video_changes_no_existing_shard() {
    let dir = tempfile::tempdir().unwrap();
    let mut units: Vec<Unit> = (0..3).map(|n| video(dir.path(), &format!("talk{n}"), 130, n)).collect();
    let (_, first) = shard(dir.path(), &units, "first");
    let target = dir.path().join("work/dataset/host");
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    fs::rename(&first, &target).unwrap();
    let before = bytes(&target);
    units.push(video(dir.path(), "another", 140, 77));
    let (report, grown) = shard(dir.path(), &units, "grown");
    let line = report.unwrap().line;
    assert!(line.contains("3 videos reused unchanged"), "{line}");
    assert_valid(&grown);
    let after = bytes(&grown);
    let of_video = |name: &str| name.ends_with(".tar") || name.starts_with("videos/");
    let same = before.iter().filter(|(name, _)| of_video(name)).filter(|file| after.contains(file)).count();
    assert_eq!(same, before.iter().filter(|(name, _)| of_video(name)).count());
    // A damaged shard is not reused.
    let tar = fs::read_dir(&target)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| path.extension().is_some_and(|e| e == "tar"));
    let tar = tar.unwrap();
    let mut damaged = fs::read(&tar).unwrap();
    damaged[5_000] ^= 1;
    fs::remove_file(&tar).unwrap();
    fs::write(&tar, damaged).unwrap();
    let (report, repaired) = shard(dir.path(), &units, "mended");
    assert!(report.unwrap().line.contains("2 videos reused unchanged"));
    assert_eq!(bytes(&repaired), after);
    // The record remains without the dataset.
    fs::remove_dir_all(&target).unwrap();
    assert_eq!(bytes(&shard(dir.path(), &units, "at-once").1), after);
}

#[test]
fn videos_with_shared_audio_are_in_one_split() {
    let dir = tempfile::tempdir().unwrap();
    let mut settings = settings(dir.path());
    settings.dataset.split_by = SplitUnit::Video;
    let old = video(dir.path(), "old", 150, 1);
    let single = video(dir.path(), "lone", 160, 2);
    let (_, first) = shard_as(&settings, &[single.clone(), old.clone()], &[], "first");
    let target = dir.path().join("work/dataset/host");
    fs::create_dir_all(target.parent().unwrap()).unwrap();
    fs::rename(&first, &target).unwrap();
    let copy = video_with(dir.path(), "copy", 140, 3, 1);
    let videos = [old.clone(), single.clone(), copy.clone()];
    let (_, out) = shard_as(&settings, &videos, &[], "second");
    let info = Dataset::open(&out).unwrap().info().clone();
    let of = |name: &str| info.videos.iter().find(|video| video.file == format!("{name}.mp4")).unwrap();
    assert_eq!((of("old").split, of("lone").split), (Some(Split::Validation), Some(Split::Train)));
    assert_eq!(
        (of("copy").split, &of("copy").split_by),
        (Some(Split::Validation), &SplitBy::SoundOf(of("old").name.clone()))
    );
    assert_valid(&out);
    // A split named in the configuration has precedence, and the leak is reported.
    let (report, out) = shard_as(&settings, &videos, &[(&copy, Split::Train)], "named");
    let line = report.unwrap().line;
    assert!(line.contains("s of audio: assign both to one split"), "{line}");
    let leakage = fs::read_to_string(out.join("leakage.json")).unwrap();
    let leakage: serde_json::Value = serde_json::from_str(&leakage).unwrap();
    assert_eq!(leakage["leaks"].as_array().unwrap().len(), 1, "{leakage}");
    assert!(leakage["shared"][0]["secs"].as_f64().unwrap() > 8.0);
    assert_valid(&out);
}

#[test]
fn missing_and_duplicate_videos_are_reported() {
    let dir = tempfile::tempdir().unwrap();
    let good = video(dir.path(), "good", 150, 1);
    let twin = video(dir.path(), "twin", 150, 2);
    fs::write(&twin.source, "film 1").unwrap();
    let named = [(&good, Split::Train), (&twin, Split::Train)];
    let (report, out) = shard_with(dir.path(), &[twin.clone(), unit(dir.path(), "never"), good.clone()], &named, "out");
    let line = report.unwrap().line;
    for expected in ["no video in the validation split: add videos, or remove", ", or set `validation = [\""] {
        assert!(line.contains(expected), "{line}");
    }
    assert!(line.contains("1 video left out because an earlier stage failed"), "{line}");
    assert!(line.contains("1 video left out as duplicates of other videos"), "{line}");
    assert_eq!(Dataset::open(&out).unwrap().info().splits["train"].videos.len(), 1);
    let ledgers = read_ledgers(&out).unwrap();
    let of = |name: &str| ledgers.iter().find(|ledger| ledger.file == format!("{name}.mp4")).unwrap();
    assert_eq!(of("never").failure.as_deref(), Some("run: not every stage is done"));
    let duplicate = if of("twin").split.is_none() { of("twin") } else { of("good") };
    assert_eq!(duplicate.ledger.rejected_secs()["duplicate"], 10.0);
    assert_valid(&out);

    let short = video(dir.path(), "short", 100, 5);
    let error = shard(dir.path(), &[short], "none").0.unwrap_err().to_string();
    assert!(error.starts_with("no dataset of host: no interval was accepted in 1 video (6.7 s)"), "{error}");
    assert!(error.contains("rejected: close to a cut 6.7 s"), "{error}");
    let error = shard(dir.path(), &[], "nothing").0.unwrap_err().to_string();
    assert!(error.starts_with("no dataset of host: none of the videos passed"), "{error}");
}
