//! `cargo bench -- dataset`.

use super::report::{Report, median};
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3};
use orator_base::stage::progress::{Progress, Silent, Task};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_dataset::info::About;
use orator_dataset::split::SplitBy;
use orator_dataset::write::assemble::DatasetWriter;
use orator_dataset::write::entry::VideoSource;
use orator_dataset::{Dataset, Sample, Split};
use orator_gesture::train::gan::train::{self, TrainingStart};
use orator_gesture::train::gan::windows::WindowLoader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Writing and reading of shards, compared with a plain copy of the same files on the same disk; and loading of
/// windows, compared with the rate of training. All written files are flushed to disk, all files read are in the page
/// cache.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seconds of motion in the dataset, in intervals of 20 s; about 52 kB each.
    #[arg(long, default_value_t = 5000, value_name = "SECS")]
    secs: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// Number of training steps to measure, with the preset `light`.
    #[arg(long, default_value_t = 8, value_name = "N")]
    steps: usize,
    /// A folder on the disk to measure; a temporary folder is created in it.
    #[arg(long, default_value = ".", value_name = "DIR")]
    dir: PathBuf,
}

const FPS: FrameRate = FrameRate::new(15, 1);
const INTERVAL_SECS: usize = 20;
/// Intervals per video.
const PER_VIDEO: usize = 15;

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    let n_intervals = args.secs / INTERVAL_SECS;
    ensure!(args.rounds > 0 && args.steps > 1, "nothing to measure: there must be rounds and at least 2 steps");
    ensure!(n_intervals > 2 * PER_VIDEO, "{} s are too few: the bench needs more than two videos of 300 s", args.secs);
    let folder = args.dir.join(format!("bench-{}", std::process::id()));
    fs::create_dir_all(&folder).with_context(|| format!("creating the folder {}", folder.display()))?;
    let measured = measure(args, n_intervals, &folder, progress);
    fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
    measured
}

fn measure(args: &Args, n_intervals: usize, folder: &Path, progress: &dyn Progress) -> Result<Report> {
    let mut samples: Vec<Sample> = (0..16).map(random_interval).collect();
    let (written, copied) = (folder.join("written"), folder.join("copied"));
    let (mut write, mut copy, mut read, mut plain) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut bytes = 0;
    let task = progress.begin("dataset", args.rounds as u64);
    for _ in 0..args.rounds {
        for output in [&written, &copied] {
            let _ = fs::remove_dir_all(output);
            fs::create_dir(output).with_context(|| format!("creating {}", output.display()))?;
        }
        write.push(secs_of(|| {
            write_all(&written, &mut samples, n_intervals)?;
            files(&written)?.iter().try_for_each(|path| Ok(File::open(path)?.sync_all()?))
        })?);
        let all = files(&written)?;
        bytes = all.iter().map(|path| Ok(path.metadata()?.len())).sum::<Result<u64>>()?;
        copy.push(secs_of(|| all.iter().try_for_each(|path| copy_file(path, &copied)))?);
        read.push(secs_of(|| read_all(&written))?);
        plain.push(secs_of(|| all.iter().try_for_each(|path| copy_bytes(path, &mut std::io::sink())))?);
        task.advance(1);
    }
    drop(task);
    let mb = bytes as f64 / 1e6;
    let ratio = |times: &[f64]| median(copy.iter().zip(times).map(|(copy, secs)| copy / secs).collect());
    let [write_ratio, read_ratio] = [ratio(&write), ratio(&read)];
    let [write, copy, read, plain] = [write, copy, read, plain].map(|secs| mb / median(secs));

    let loaded = loader(args, &written, &folder.join("gan"))?;
    let LoadingRates { n_windows, load_secs, windows_a_second, trained_a_second } = loaded;
    let hours = (n_intervals * INTERVAL_SECS) as f64 / 3600.0;
    let loader_ratio = windows_a_second / trained_a_second;
    // Ratio for the first epoch, which includes loading.
    let epoch = n_windows as f64 / (load_secs + n_windows as f64 / windows_a_second) / trained_a_second;
    let text = format!(
        "{mb:.0} MB, {n_intervals} intervals of {INTERVAL_SECS} s, median of {} rounds\n\
         plain copy      {copy:8.0} MB/s\n\
         shards written  {write:8.0} MB/s: {write_ratio:.2} of the copy\n\
         shards read     {read:8.0} MB/s: {read_ratio:.2} of the copy (plain reading: {plain:.0} MB/s)\n\
         windows loaded  {windows_a_second:8.0} a second, 64 frames, stride 5, drawn at random, with log-mel\n\
         windows trained {trained_a_second:8.1} a second, preset light: the loader is {loader_ratio:.0} x as fast, with the \
         reading of {hours:.1} h ({load_secs:.1} s) in a first epoch {epoch:.0} x",
        args.rounds
    );
    let facts = json!({
        "mb": mb, "copy_mb_a_second": copy, "write_mb_a_second": write, "read_mb_a_second": read,
        "plain_read_mb_a_second": plain, "write_ratio": write_ratio, "read_ratio": read_ratio,
        "windows_a_second": windows_a_second, "trained_windows_a_second": trained_a_second,
        "loader_ratio": loader_ratio, "loader_ratio_first_epoch": epoch, "load_secs": load_secs,
    });
    Ok(Report { text, facts })
}

/// An interval of noise, which cannot be compressed.
fn random_interval(seed: u64) -> Sample {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n_frames = FPS.frames_in(INTERVAL_SECS as f64);
    let n_samples = sample_at(FPS, SAMPLE_RATE, n_frames);
    Sample {
        key: String::new(),
        motion: Motion {
            fps: FPS,
            joints: Array3::from_shape_fn((n_frames, N_JOINTS, 3), |_| rng.random_range(-0.7f32..0.7)),
            mask: Array2::from_elem((n_frames, N_JOINTS), true),
        },
        pose2d: Array3::from_shape_fn((n_frames, 59, 3), |_| rng.random_range(0.0f32..1.0)),
        sound: Sound { rate: SAMPLE_RATE, samples: (0..n_samples).map(|_| rng.random_range(-0.5f32..0.5)).collect() },
        words: None,
        posture: None,
        interlocutor: None,
        meta: json!({ "n_frames": n_frames }),
    }
}

/// Writes a dataset of intervals that cycle through `samples`; the second video is the validation split.
fn write_all(dir: &Path, samples: &mut [Sample], n_intervals: usize) -> Result<()> {
    let writer = DatasetWriter::new(dir, About::new("bench", FPS), 256 << 20);
    for first in (0..n_intervals).step_by(PER_VIDEO) {
        let name = format!("video-{first:08x}");
        let split = if first == PER_VIDEO { Split::Validation } else { Split::Train };
        let source = VideoSource { name: name.clone(), ..VideoSource::default() };
        let mut video = writer.video(source, split, SplitBy::Name)?;
        for n in first..n_intervals.min(first + PER_VIDEO) {
            let at = n % samples.len();
            samples[at].key = format!("{name}-{n:06}");
            video.push(&samples[at], 0.0)?;
        }
        video.finish(None)?;
    }
    writer.finish()?;
    Ok(())
}

/// Reads every interval and checks its hash.
fn read_all(dir: &Path) -> Result<()> {
    let dataset = Dataset::open(dir)?;
    Split::ALL.iter().flat_map(|split| dataset.samples(*split)).try_for_each(|sample| dataset.read(&sample).map(drop))
}

fn secs_of(work: impl FnOnce() -> Result<()>) -> Result<f64> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_secs_f64())
}

fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { files.extend(self::files(&path)?) } else { files.push(path) }
    }
    files.sort();
    Ok(files)
}

/// Copies a file through memory, so that the file system cannot share its blocks.
fn copy_file(path: &Path, folder: &Path) -> Result<()> {
    let to = folder.join(path.file_name().unwrap_or_default());
    let mut file = File::create(&to).with_context(|| format!("writing {}", to.display()))?;
    copy_bytes(path, &mut file)?;
    Ok(file.sync_all()?)
}

/// Copies the bytes of a file to a writer.
fn copy_bytes(path: &Path, to: &mut dyn Write) -> Result<()> {
    let mut file = File::open(path).with_context(|| format!("reading {}", path.display()))?;
    let mut block = vec![0; 1 << 20];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(()),
            n => to.write_all(&block[..n])?,
        }
    }
}

/// Windows per training step.
const BATCH: usize = 32;

struct LoadingRates {
    n_windows: usize,
    load_secs: f64,
    windows_a_second: f64,
    trained_a_second: f64,
}

/// Loads random batches as training does, then trains on the same dataset.
fn loader(args: &Args, dir: &Path, out: &Path) -> Result<LoadingRates> {
    let settings = config::GanConfig {
        recipe: config::GanRecipe::Rebol2021,
        preset: config::NetworkPreset::Light,
        representation: config::MotionRepresentation::Bones,
        adversarial: config::AdversarialLoss::LeastSquares,
        window_frames: 64,
        stride_frames: 5,
        steps: args.steps.into(),
        checkpoint_every: args.steps,
        batch: BATCH.into(),
        ..Default::default()
    };
    let dataset = Dataset::open(dir)?;
    let start = Instant::now();
    let examples = WindowLoader::load(
        &dataset,
        Split::Train,
        &orator_gesture::train::gan::speakers::normalisation(&dataset)?,
        64,
        5,
    )?;
    let load_secs = start.elapsed().as_secs_f64();
    let mut rng = ChaCha8Rng::seed_from_u64(1337);
    let (mut n_loaded, start) = (0, Instant::now());
    while start.elapsed().as_secs_f64() < 2.0 {
        let indices: Vec<usize> = (0..BATCH).map(|_| rng.random_range(0..examples.len())).collect();
        n_loaded += examples.batch(&indices)?.poses.dim(0)?;
    }
    let windows_a_second = n_loaded as f64 / start.elapsed().as_secs_f64();
    let n_windows = examples.len();
    drop(examples);

    let steps = StepTimes::default();
    train::train(&[&dataset], &settings, &TrainingStart::default(), out, &steps, &mut |_| ())?;
    let ends = steps.ends.lock().map(|ends| ends.clone()).unwrap_or_default();
    let durations = ends.windows(2).map(|pair| (pair[1] - pair[0]).as_secs_f64()).collect();
    Ok(LoadingRates { n_windows, load_secs, windows_a_second, trained_a_second: BATCH as f64 / median(durations) })
}

/// Records the end time of each training step.
#[derive(Clone, Default)]
struct StepTimes {
    ends: Arc<Mutex<Vec<Instant>>>,
}

impl Progress for StepTimes {
    fn begin(&self, label: &str, _total: u64) -> Box<dyn Task> {
        if label.starts_with("train") { Box::new(self.clone()) } else { Box::new(Silent) }
    }

    fn say(&self, _line: &str) {}
}

impl Task for StepTimes {
    fn advance(&self, steps: u64) {
        if let (1, Ok(mut ends)) = (steps, self.ends.lock()) {
            ends.push(Instant::now());
        }
    }

    fn detail(&self, _text: &str) {}
}
