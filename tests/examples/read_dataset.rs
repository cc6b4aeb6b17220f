//! Reads a dataset: its splits, and of each the joints and the sound of the first sample.
//!
//! ```text
//! cargo run --release --example read_dataset -- work/dataset/host
//! ```

#![allow(clippy::print_stdout)] // a program

use anyhow::{Result, bail};
use orator::{Dataset, Split};
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [dir] = paths.as_slice() else { bail!("expected DATASET") };
    read(dir)?.iter().for_each(|line| println!("{line}"));
    Ok(())
}

/// Lines on the splits of the dataset in `dir`.
pub(crate) fn read(dir: &Path) -> Result<Vec<String>> {
    let dataset = Dataset::open(dir)?;
    let mut lines = Vec::new();
    for split in Split::ALL {
        let samples = dataset.samples(split);
        let secs: f64 = samples.iter().map(|sample| dataset.info().fps.secs(sample.n_frames)).sum();
        lines.push(format!("{}: {} samples, {secs:.1} s", split.name(), samples.len()));

        // Every sample is one continuous interval: joints [T, 49, 3] in metres, and the sound of the same seconds.
        let Some(first) = samples.first() else { continue };
        let sample = dataset.read(first)?;
        let (shape, n_samples) = (sample.motion.joints.shape(), sample.sound.samples.len());
        lines.push(format!("  {}: joints {shape:?}, {n_samples} sound samples", sample.key));
    }
    Ok(lines)
}
