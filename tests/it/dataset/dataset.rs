//! The dataset folder: round trip, deterministic bytes, errors for damage, and a reader in Python.

use crate::fixtures::samples::random_sample;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Sample, Split};
use orator_test_support::skip::python;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;

const FPS: FrameRate = FrameRate::new(15, 1);

fn three_samples() -> Vec<(Split, Sample)> {
    vec![
        (Split::Train, random_sample("talk-0a1b2c3d-000000", 70, 1)),
        (Split::Train, random_sample("talk-0a1b2c3d-000102", 64, 2)),
        (Split::Test, random_sample("walk-99999999-000007", 81, 3)),
    ]
}

fn same_motion(a: &Motion, b: &Motion) -> bool {
    let bits = |m: &Motion| m.joints.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    a.fps == b.fps && a.mask == b.mask && bits(a) == bits(b)
}

#[test]
fn a_written_dataset_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let written = three_samples();
    write_dataset(dir.path(), "host", FPS, &written).unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    assert_eq!((dataset.info().speaker.as_str(), dataset.info().splits["train"].frames), ("host", 134));
    assert!(dataset.samples(Split::Validation).is_empty());
    let refs: Vec<_> = Split::ALL.iter().flat_map(|&split| dataset.samples(split)).collect();
    assert_eq!(refs.len(), written.len());
    for (sample_ref, (split, sample)) in refs.iter().zip(&written) {
        let read = dataset.read(sample_ref).unwrap();
        assert_eq!(sample_ref.split, *split);
        assert_eq!((&read.key, &read.meta), (&sample.key, &sample.meta));
        assert_eq!((&read.pose2d, &read.sound), (&sample.pose2d, &sample.sound));
        assert!(same_motion(&read.motion, &sample.motion));
    }
    assert_eq!((dataset.stats().mean().shape(), dataset.stats().std()[[0, 0]]), (&[49, 3][..], 0.0));
    assert!(dataset.stats().n_visible[30] < 134);
}

fn folder_bytes(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| (f.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(f).unwrap())).collect()
}

#[test]
fn shards_are_ustar_files_of_bounded_size_and_deterministic() {
    use orator_dataset::write::tar::ShardWriter;
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let samples: Vec<_> = (0..5).map(|n| random_sample(&format!("talk-0a1b2c3d-{n:06}"), 64, n)).collect();
    for dir in [&one, &two] {
        let mut writer = ShardWriter::new(dir.path(), "talk-0a1b2c3d", Split::Train, 512 << 10);
        samples.iter().for_each(|sample| writer.push_members(sample, &sample.members().unwrap()).unwrap());
        let (shards, refs) = writer.finish().unwrap();
        assert_eq!((shards.len(), refs.len()), (3, 5));
        assert!(shards.iter().all(|shard| shard.bytes <= 512 << 10));
    }
    let files = folder_bytes(one.path());
    assert_eq!(files, folder_bytes(two.path()));
    let mut names = Vec::new();
    for (_, bytes) in &files {
        for entry in tar::Archive::new(&bytes[..]).entries().unwrap() {
            let entry = entry.unwrap();
            let header = entry.header();
            assert_eq!((header.mtime().unwrap(), header.uid().unwrap(), header.mode().unwrap()), (0, 0, 0o644));
            assert!(header.as_ustar().is_some());
            names.push(entry.path().unwrap().to_string_lossy().into_owned());
        }
    }
    assert_eq!(names.len(), 25);
    assert!(names.is_sorted(), "{names:?}");
}

#[test]
fn damage_is_an_error_and_never_a_panic() {
    let dir = tempfile::tempdir().unwrap();
    let samples = [(Split::Train, random_sample("talk-0a1b2c3d-000000", 6, 1))];
    write_dataset(dir.path(), "host", FPS, &samples).unwrap();
    let shard = dir.path().join("train-talk-0a1b2c3d-0000.tar");
    let original = std::fs::read(&shard).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..300 {
        let mut bytes = original.clone();
        let at = rng.random_range(0..bytes.len());
        bytes[at] ^= 1 << rng.random_range(0..8);
        std::fs::write(&shard, &bytes).unwrap();
        let dataset = Dataset::open(dir.path()).unwrap();
        let sample = &dataset.samples(Split::Train)[0];
        assert!(dataset.read(sample).is_err() || at >= (sample.offset + sample.size) as usize);
    }
    for length in [0, 511, 512, original.len() / 2, original.len() - 1] {
        std::fs::write(&shard, &original[..length]).unwrap();
        let message = Dataset::open(dir.path()).err().unwrap().to_string();
        assert!(message.contains("train-talk-0a1b2c3d-0000.tar"), "{message}");
    }
    std::fs::remove_file(&shard).unwrap();
    assert!(Dataset::open(dir.path()).is_err());
    std::fs::write(&shard, &original).unwrap();
    for name in ["info.json", "stats.json", "index.jsonl"] {
        let path = dir.path().join(name);
        let text = std::fs::read(&path).unwrap();
        for length in [0, text.len() / 3, text.len() - 3] {
            std::fs::write(&path, &text[..length]).unwrap();
            let message = format!("{:#}", Dataset::open(dir.path()).err().unwrap());
            assert!(message.contains(name), "{message}");
        }
        for _ in 0..200 {
            let mut damaged = text.clone();
            let at = rng.random_range(0..damaged.len());
            damaged[at] = rng.random_range(b'0'..=b'9');
            std::fs::write(&path, &damaged).unwrap();
            let Ok(dataset) = Dataset::open(dir.path()) else { continue };
            for sample in dataset.samples(Split::Train) {
                let _ = dataset.read(&sample);
            }
        }
        std::fs::write(&path, &text).unwrap();
    }
    Dataset::open(dir.path()).unwrap();
}

/// Reads a shard with NumPy only and prints sums.
const PYTHON: &str = r"
import io, json, sys, tarfile, wave
import numpy as np
samples = {}
for member in (tar := tarfile.open(sys.argv[1])):
    key, extension = member.name.split('.', 1)
    samples.setdefault(key, {})[extension] = tar.extractfile(member).read()
for key, members in samples.items():
    pose3d, pose2d, mask = (np.load(io.BytesIO(members[name + '.npy'])) for name in ('pose3d', 'pose2d', 'mask'))
    sound = wave.open(io.BytesIO(members['wav']))
    pcm = np.frombuffer(sound.readframes(sound.getnframes()), '<i2').astype(np.int64)
    assert (pose3d.dtype, pose2d.dtype, mask.dtype) == (np.float32, np.float32, np.bool_)
    print(key, *pose3d.shape, *pose2d.shape, *mask.shape, sound.getframerate(), len(pcm), pcm.sum(), mask.sum(),
          repr(float(np.nansum(pose3d.astype(np.float64)))), json.loads(members['json'])['n_frames'])
";

#[test]
fn python_reads_the_same_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let written = three_samples();
    write_dataset(dir.path(), "host", FPS, &written).unwrap();
    let Some(python) = python("numpy") else { return };
    let output = Command::new(python)
        .args(["-c", PYTHON])
        .arg(dir.path().join("train-talk-0a1b2c3d-0000.tar"))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(' ').collect()).collect();
    assert_eq!(lines.len(), 2);
    for (line, (_, sample)) in lines.iter().zip(&written) {
        let n = sample.n_frames().to_string();
        let pcm: i64 = sample.sound.samples.iter().map(|s| (s * 32_768.0) as i64).sum();
        let n_visible = sample.motion.mask.iter().filter(|&&m| m).count();
        let expected =
            format!("{} {n} 49 3 {n} 59 3 {n} 49 16000 {} {pcm} {n_visible}", sample.key, sample.sound.samples.len());
        assert_eq!(line[..13].join(" "), expected);
        let sum: f64 = sample.motion.joints.iter().filter(|v| !v.is_nan()).map(|&v| f64::from(v)).sum();
        assert!((line[13].parse::<f64>().unwrap() - sum).abs() < 1e-6);
        assert_eq!(line[14], n);
    }
}
