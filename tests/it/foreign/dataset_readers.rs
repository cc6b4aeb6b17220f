//! A dataset read by the Python package `webdataset` and by Hugging Face `datasets` has the values that were written.
//! Both packages come from PyPI (`make readers`) and lie in the folder ORATOR_READERS.

use crate::fixtures::gesture_dataset::with_posture;
use crate::fixtures::samples::constant_sample;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::types::time::FrameRate;
use orator_dataset::{Sample, Split};
use orator_test_support::skip::readers;
use std::path::Path;
use std::process::Command;

fn write_samples(dir: &Path, has_posture: bool) -> Vec<(Split, Sample)> {
    let mut samples = vec![
        (Split::Train, constant_sample("my-talk-0a1b2c3d-000000", 20, 1)),
        (Split::Train, constant_sample("my-talk-0a1b2c3d-000102", 15, 2)),
        (Split::Train, constant_sample("b_2-77777777-000000", 12, 5)),
        (Split::Test, constant_sample("walk-99999999-000007", 18, 3)),
    ];
    if has_posture {
        samples = samples.into_iter().map(|(split, sample)| (split, with_posture(sample, 0.4))).collect();
    }
    write_dataset(dir, "host", FrameRate::new(15, 1), &samples).unwrap();
    samples
}

/// Key, shapes and sums of a sample's arrays, as the Python script prints them.
fn line(sample: &Sample) -> String {
    let n = sample.n_frames();
    let pcm: i64 = sample.sound.samples.iter().map(|s| (s * 32_768.0) as i64).sum();
    let n_observed = sample.motion.mask.iter().filter(|m| **m).count();
    let sum = |values: &mut dyn Iterator<Item = f64>| values.filter(|v| v.is_finite()).sum::<f64>();
    let pose3d = sum(&mut sample.motion.joints.iter().map(|v| f64::from(*v)));
    let pose2d = sum(&mut sample.pose2d.iter().map(|v| f64::from(*v)));
    let first = sample.meta["first_frame"].as_i64().unwrap();
    let angles = sample.posture.as_ref().map_or(String::new(), |posture| {
        let [head, trunk] = [&posture.head, &posture.trunk].map(|of| sum(&mut of.iter().map(|v| f64::from(*v))));
        format!(" {n} 3 {head:.4} {n} 3 {trunk:.4}")
    });
    format!(
        "{} {n} 49 3 {n} 59 3 {n} 49 {n_observed} {} {pcm} {first} {pose3d:.4} {pose2d:.4}{angles}",
        sample.key,
        sample.sound.samples.len()
    )
}

const SUMS: &str = r#"
import glob, io, json, os, sys, wave
import numpy as np
def line(key, pose3d, pose2d, mask, wav, meta, angles):
    assert (pose3d.dtype, pose2d.dtype, mask.dtype) == (np.float32, np.float32, np.bool_)
    sound = wave.open(io.BytesIO(wav)); assert sound.getframerate() == 16000
    pcm = np.frombuffer(sound.readframes(sound.getnframes()), '<i2').astype(np.int64)
    total = lambda a: float(np.nansum(a.astype(np.float64)))
    print(key, *pose3d.shape, *pose2d.shape, *mask.shape, mask.sum(), len(pcm), pcm.sum(), meta['first_frame'],
          f"{total(pose3d):.4f} {total(pose2d):.4f}", *[f"{a.shape[0]} {a.shape[1]} {total(a):.4f}" for a in angles])
"#;

const WEBDATASET: &str = r"
import webdataset as wds
for sample in wds.WebDataset(sorted(glob.glob('train-*.tar')), shardshuffle=False):
    array = lambda name: np.load(io.BytesIO(sample[name]))
    line(sample['__key__'], array('pose3d.npy'), array('pose2d.npy'), array('mask.npy'), sample['wav'], json.loads(sample['json']),
         [array(name) for name in ('head.npy', 'trunk.npy') if name in sample])
";

const DATASETS: &str = r"
example = open('README.md').read().split('```python')[1].split('```')[0]
exec(example)
for row in rows:
    wav = row['wav']['bytes'] if isinstance(row['wav'], dict) else row['wav']
    def array(name, dtype):
        value = row[name]
        return np.load(io.BytesIO(value)) if isinstance(value, bytes) else np.array(value, dtype=dtype)
    line(row['__key__'], array('pose3d.npy', np.float32), array('pose2d.npy', np.float32), array('mask.npy', bool), wav, row['json'],
         [array(name, np.float32) for name in ('head.npy', 'trunk.npy') if name in row])
assert load_dataset(os.getcwd(), split='test', cache_dir=sys.argv[1]).num_rows == 1
";

fn read_with(package: &str, program: &str) {
    let Some(packages) = readers(package) else { return };
    for has_posture in [false, true] {
        read_dataset(&packages, program, has_posture);
    }
}

fn read_dataset(packages: &Path, program: &str, has_posture: bool) {
    let dir = tempfile::tempdir().unwrap();
    let cache = tempfile::tempdir().unwrap();
    let samples = write_samples(dir.path(), has_posture);
    let output = Command::new("python3")
        .args(["-c", &format!("{SUMS}{program}")])
        .arg(cache.path())
        .current_dir(dir.path())
        .env("PYTHONPATH", packages)
        .env("HF_HOME", cache.path())
        .env("HF_HUB_OFFLINE", "1")
        .env("HF_DATASETS_OFFLINE", "1")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut read: Vec<String> = String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
    let train = samples.iter().filter(|(split, _)| *split == Split::Train);
    let mut expected: Vec<String> = train.map(|(_, sample)| line(sample)).collect();
    read.sort();
    expected.sort();
    assert_eq!(read, expected);
}

#[test]
fn webdataset_reads_the_written_values() {
    read_with("webdataset", WEBDATASET);
}

#[test]
fn hugging_face_datasets_reads_the_written_values() {
    read_with("datasets", DATASETS);
}
