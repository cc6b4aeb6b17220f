//! `cargo bench -- pose2d`.

use super::child::own_cpu_secs;
use super::report::{Report, median};
use anyhow::{Context, Result, bail, ensure};
use ndarray::{ArrayView1, Axis};
use orator_base::math::order::Ordered;
use orator_base::stage::progress::Progress;
use orator_base::types::image::Image;
use orator_base::types::pose2d::{VISIBLE_SCORE, coco};
use orator_base::types::time::FrameRate;
use orator_dataset::config::Settings;
use orator_formats::keypoints_npz;
use orator_media::ffmpeg::frames::FrameReader;
use orator_onnx::{ModelStore, PICTURES_ON_GPU, Runtime};
use orator_pipeline::pose2d::Chain;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Keypoint detection: time per frame, the part spent in ONNX Runtime, model runs per frame, one worker compared with
/// two, and (with `--python`) with a Python reference of the same chain. Every worker is one thread.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A video of a speaker; with `--beside`, its `keypoints.npz`.
    video: PathBuf,
    /// Keypoints of the same video from another version or with other settings: reports the differences instead of the
    /// speed.
    #[arg(long, value_name = "KEYPOINTS")]
    beside: Option<PathBuf>,
    /// Folder with the models.
    #[arg(long, default_value = "models", value_name = "DIR")]
    models_dir: PathBuf,
    /// Number of frames from the start of the video, at the dataset rate.
    #[arg(long, default_value_t = 90, value_name = "N")]
    frames: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// ID of the person detector, instead of the default.
    #[arg(long, value_name = "ID")]
    person: Option<String>,
    /// Number of an NVIDIA GPU: measures only four workers per core that share their models on it.
    #[arg(long, value_name = "N")]
    gpu: Option<usize>,
    /// Pictures per run on the GPU.
    #[arg(long, default_value_t = PICTURES_ON_GPU, value_name = "N")]
    batch: usize,
    /// Python reference script, run on the complete video in each round: `REFERENCE.py VIDEO OUT.npz`.
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
}

/// Inputs of all variants.
struct Bench<'a> {
    video: &'a Path,
    runtime: Runtime,
    store: ModelStore,
    settings: Settings,
    images: Vec<Image>,
}

/// Time of one round of one variant, seconds.
#[derive(Clone, Copy)]
struct Run {
    total: f64,
    /// Time in ONNX Runtime.
    inference: f64,
    /// Processor time.
    cpu: f64,
}

impl Bench<'_> {
    fn chain(&self) -> Result<Chain> {
        Chain::new(&self.runtime, &self.store, &self.settings.pose2d)
    }

    /// One chain on frames in memory.
    fn decoded(&self, chain: &mut Chain) -> Result<Run> {
        chain.begin_shot(None);
        let (start, before, cpu) = (Instant::now(), chain.secs_inside(), own_cpu_secs());
        for image in &self.images {
            chain.frame(image)?;
        }
        let (total, inference) = (start.elapsed().as_secs_f64(), chain.secs_inside() - before);
        Ok(Run { total, inference, cpu: own_cpu_secs() - cpu })
    }

    /// One chain on frames decoded from the file.
    fn streamed(&self, chain: &mut Chain) -> Result<Run> {
        chain.begin_shot(None);
        let (start, before, cpu) = (Instant::now(), chain.secs_inside(), own_cpu_secs());
        for frame in FrameReader::open(self.video, rate(&self.settings))?.take(self.images.len()) {
            chain.frame(&frame?.image)?;
        }
        let (total, inference) = (start.elapsed().as_secs_f64(), chain.secs_inside() - before);
        Ok(Run { total, inference, cpu: own_cpu_secs() - cpu })
    }

    /// Four workers per core, each of which decodes and processes the video with models in batches of `n` on the GPU.
    fn on_gpu(mut self, gpu: usize, n: usize) -> Result<Report> {
        self.runtime = self.runtime.on_gpu(gpu, n)?;
        let n_workers = 4 * std::thread::available_parallelism()?.get();
        let mut chains = (0..n_workers).map(|_| self.chain()).collect::<Result<Vec<_>>>()?;
        // The first run of each model loads and chooses the kernels.
        self.streamed(&mut chains[0])?;
        let start = Instant::now();
        let runs: Result<Vec<Run>> = std::thread::scope(|scope| {
            let workers = chains.iter_mut().map(|chain| scope.spawn(|| self.streamed(chain)));
            let workers: Vec<_> = workers.collect();
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| bail!("a worker panicked"))).collect()
        });
        runs?;
        let rate = (n_workers * self.images.len()) as f64 / start.elapsed().as_secs_f64();
        let text = format!("{n_workers} workers, runs of {n} pictures on the GPU: {rate:.0} frames/s");
        Ok(Report { text, facts: json!({ "n_workers": n_workers, "batch": n, "frames_a_sec": rate }) })
    }

    /// Two workers that each perform all of `work`; time until both have finished.
    fn side_by_side(chains: &mut [Chain; 2], work: impl Fn(&mut Chain) -> Result<Run> + Sync) -> Result<Run> {
        let (start, cpu) = (Instant::now(), own_cpu_secs());
        let runs = std::thread::scope(|scope| {
            let workers = chains.each_mut().map(|chain| scope.spawn(|| work(chain)));
            workers.map(|worker| worker.join().unwrap_or_else(|_| bail!("a worker panicked")))
        });
        let (total, cpu) = (start.elapsed().as_secs_f64(), own_cpu_secs() - cpu);
        let [a, b] = runs;
        Ok(Run { total, inference: a?.inference + b?.inference, cpu })
    }
}

fn rate(settings: &Settings) -> FrameRate {
    settings.extract.rate()
}

/// Distances between the keypoints of two files, in % of the shoulder width: of each visible arm point, and the mean
/// over each hand that both files have.
fn compare(one: &Path, other: &Path) -> Result<Report> {
    let [one, other] = [keypoints_npz::read(one)?, keypoints_npz::read(other)?];
    let n_frames = one.n_frames();
    ensure!(other.n_frames() == n_frames, "the files have {n_frames} and {} frames", other.n_frames());
    let distance = |a: ArrayView1<f32>, b: ArrayView1<f32>| f64::from((a[0] - b[0]).hypot(a[1] - b[1]));
    let (mut arms, mut hands, mut pixels) = (Vec::new(), Vec::new(), Vec::new());
    // Numbers of hands in the first file, in the second, in both.
    let mut n_hands = [0_usize; 3];
    for t in 0..n_frames {
        let [body, other_body] = [&one.body, &other.body].map(|body| body.index_axis(Axis(0), t));
        let width = distance(body.row(coco::L_SHOULDER), body.row(coco::R_SHOULDER)).max(1.0);
        for joint in coco::L_SHOULDER..=coco::R_WRIST {
            let [a, b] = [body.row(joint), other_body.row(joint)];
            if a[2].min(b[2]) >= VISIBLE_SCORE {
                pixels.push(distance(a, b));
                arms.push(100.0 * distance(a, b) / width);
            }
        }
        for [a, b] in [[&one.left_hand, &other.left_hand], [&one.right_hand, &other.right_hand]] {
            let [a, b] = [a, b].map(|hand| hand.index_axis(Axis(0), t));
            let found = [a[[0, 2]] > 0.0, b[[0, 2]] > 0.0];
            let both = found[0] && found[1];
            n_hands = [0, 1, 2].map(|at| n_hands[at] + usize::from(*found.get(at).unwrap_or(&both)));
            if both {
                let distances = a.outer_iter().zip(b.outer_iter()).map(|(a, b)| distance(a, b)).collect::<Vec<_>>();
                hands.push(100.0 * distances.iter().sum::<f64>() / a.nrows() as f64 / width);
                pixels.extend(distances);
            }
        }
    }
    let quantiles = |distances: Vec<f64>| {
        let ordered = Ordered::new(distances);
        [ordered.median(), ordered.quantile(0.95)].map(|value| value.unwrap_or(f64::NAN))
    };
    let [[arm, arm_95], [hand, hand_95], [pixel, pixel_95]] = [arms, hands, pixels].map(quantiles);
    let [first, second, both] = n_hands;
    let text = format!(
        "{n_frames} frames, distances in % of the shoulder width\n\
         arms   median {arm:.2}, 95 % below {arm_95:.2}\n\
         hands  median {hand:.2}, 95 % below {hand_95:.2}\n\
         all    median {pixel:.3} px, 95 % below {pixel_95:.3} px\n\
         found  {first} hands in the first, {second} in the second, {both} in both",
    );
    let facts = json!({
        "n_frames": n_frames, "arm_median": arm, "arm_95": arm_95, "hand_median": hand, "hand_95": hand_95, "px_median": pixel, "px_95": pixel_95,
        "n_hands": [first, second], "n_both": both,
    });
    Ok(Report { text, facts })
}

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    if let Some(other) = &args.beside {
        return compare(&args.video, other);
    }
    let mut settings = Settings::default();
    if let Some(person) = &args.person {
        settings.pose2d.person.clone_from(person);
    }
    let models_dir = std::path::absolute(&args.models_dir)?;
    let reader = FrameReader::open(&args.video, rate(&settings))?;
    let images = reader.take(args.frames).map(|frame| Ok(frame?.image)).collect::<Result<Vec<_>>>()?;
    ensure!(!images.is_empty() && args.rounds > 0, "nothing to measure: there must be frames and rounds");
    let bench = Bench {
        video: &args.video,
        runtime: Runtime::load(&settings.models.onnxruntime, &models_dir)?,
        store: ModelStore::open(&models_dir)?,
        settings,
        images,
    };
    if let Some(gpu) = args.gpu {
        return bench.on_gpu(gpu, args.batch);
    }
    let mut chains = [bench.chain()?, bench.chain()?];
    let n_frames = bench.images.len() as f64;
    let task = progress.begin("pose2d", args.rounds as u64);
    bench.decoded(&mut chains[0])?;
    let runs_per_frame = chains[0].n_runs().map(|n| n as f64 / n_frames);
    let (mut one, mut streamed, mut two, mut two_streamed, mut python) = (vec![], vec![], vec![], vec![], vec![]);
    for _ in 0..args.rounds {
        one.push(bench.decoded(&mut chains[0])?);
        two.push(Bench::side_by_side(&mut chains, |chain| bench.decoded(chain))?);
        streamed.push(bench.streamed(&mut chains[0])?);
        two_streamed.push(Bench::side_by_side(&mut chains, |chain| bench.streamed(chain))?);
        if let Some(script) = &args.python {
            python.push(reference(script, &args.video, bench.store.dir())?);
        }
        task.advance(1);
    }
    drop(task);

    let per_frame = |secs: f64| 1e3 * secs / n_frames;
    let total = |runs: &[Run]| median(runs.iter().map(|run| run.total).collect());
    let ratio = median(one.iter().map(|run| run.total / run.inference).collect());
    let inference = median(one.iter().map(|run| run.inference).collect());
    let speed_up = median(one.iter().zip(&two).map(|(one, two)| 2.0 * one.total / two.total).collect());
    // On a busy machine, processor time is more reliable than elapsed time.
    let cpu = |runs: &[Run]| median(runs.iter().map(|run| run.cpu).collect());
    let cpu_speed_up = 4.0 * cpu(&one) / cpu(&two);
    let fps = rate(&bench.settings).per_sec();
    let real_time = |frames: f64, secs: f64| frames / fps / secs;
    let one_real_time = real_time(n_frames, total(&streamed));
    let two_real_time = real_time(2.0 * n_frames, total(&two_streamed));
    let [person, body, hand, palm, face] = runs_per_frame;
    let mut text = format!(
        "{n_frames} frames, median of {} rounds, {}\n\
         models asked a frame           person {person:.2}, body {body:.2}, hand {hand:.2}, palm {palm:.2}, face {face:.2}\n\
         one worker, frames in memory   {:6.1} ms a frame, {:.1} of it inside ONNX Runtime: ratio {ratio:.3}\n\
         one worker, decoding           {:6.1} ms a frame: {one_real_time:.1} x real time at {fps} fps\n\
         two workers, frames in memory  {speed_up:.2} x one worker\n\
         two workers, decoding          {two_real_time:.1} x real time at {fps} fps\n\
         processor time                 {:6.1} ms a frame in memory, {:.1} decoding; two workers {cpu_speed_up:.2} x one",
        args.rounds,
        bench.runtime.version(),
        per_frame(total(&one)),
        per_frame(inference),
        per_frame(total(&streamed)),
        per_frame(cpu(&one)),
        per_frame(cpu(&streamed)),
    );
    let mut facts = json!({
        "n_frames": n_frames, "ms_a_frame": per_frame(total(&one)), "ms_inside": per_frame(inference), "ratio": ratio,
        "ms_a_frame_decoding": per_frame(total(&streamed)), "speed_up_of_two": speed_up,
        "cpu_ms_a_frame": per_frame(cpu(&one)), "cpu_ms_a_frame_decoding": per_frame(cpu(&streamed)),
        "cpu_speed_up_of_two": cpu_speed_up, "real_time_one": one_real_time, "real_time_two": two_real_time,
        "asked": { "person": person, "body": body, "hand": hand, "palm": palm, "face": face },
    });
    if !python.is_empty() {
        let theirs = median(python.clone());
        let against = median(python.iter().zip(&streamed).map(|(ms, run)| per_frame(run.total) / ms).collect());
        text += &format!(
            "\nPython reference, decoding      {theirs:6.1} ms a frame: this program takes {against:.2} of it"
        );
        facts["python_ms_a_frame"] = json!(theirs);
        facts["against_python"] = json!(against);
    }
    Ok(Report { text, facts })
}

/// Milliseconds per frame that the Python reference prints. It is pinned to one processor core, because its decoder and
/// OpenCV start additional threads.
fn reference(script: &Path, video: &Path, models_dir: &Path) -> Result<f64> {
    let python = std::env::var("ORATOR_REFERENCE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let out = std::env::temp_dir().join(format!("orator-bench-{}.npz", std::process::id()));
    let has_taskset = Command::new("taskset").arg("--version").output().is_ok_and(|output| output.status.success());
    let mut command = Command::new(if has_taskset { "taskset" } else { &python });
    if has_taskset {
        command.args(["--cpu-list", "0", &python]);
    }
    command.arg(script).arg(video).arg(&out);
    if std::env::var_os("MODELS").is_none() {
        command.env("MODELS", models_dir);
    }
    for (variable, one) in
        [("OMP_NUM_THREADS", "1"), ("OPENCV_FOR_THREADS_NUM", "1"), ("OPENCV_FFMPEG_CAPTURE_OPTIONS", "threads;1")]
    {
        command.env(variable, one);
    }
    let output = command.output().with_context(|| {
        format!("{python} cannot be run; ORATOR_REFERENCE_PYTHON names a Python with onnxruntime, cv2 and numpy")
    })?;
    let _ = std::fs::remove_file(&out);
    let printed = String::from_utf8_lossy(&output.stdout);
    let milliseconds = printed.split(" ms a frame").next().and_then(|text| text.split_whitespace().last());
    let error = String::from_utf8_lossy(&output.stderr);
    milliseconds.and_then(|text| text.parse().ok()).with_context(|| {
        format!("{} printed no time: {}", script.display(), error.lines().last().unwrap_or("no error output"))
    })
}
