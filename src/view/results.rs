//! Motion generated for the page: a queue of one worker that starts `generate` of this program for each request. Files
//! are in a folder that is removed when the server ends.

use anyhow::{Context, Result, bail, ensure};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::{Dataset, Split};
use orator_formats::wav;
use orator_web::files::{hex, random};
use serde::Serialize;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex};

/// Maximum duration of a validation clip, seconds.
const MAX_CLIP_SECS: f64 = 20.0;
/// Maximum length of the name of a sound.
const MAX_NAME: usize = 120;
/// Maximum number of results that are kept.
const MAX_RESULTS: usize = 200;
/// Sound of a clip of the dataset; an uploaded sound has its own extension.
const SPEECH: &str = "speech.wav";

#[derive(Clone, Debug, Serialize)]
pub struct GeneratedResult {
    pub id: String,
    /// Name of the training.
    pub checkpoint: String,
    pub seed: u64,
    /// Name of the sound.
    pub name: String,
    pub state: &'static str,
    /// Error of a failed result.
    pub message: String,
    /// Names of the finished files, the sound first.
    pub files: Vec<String>,
    #[serde(skip)]
    checkpoint_file: PathBuf,
}

/// Work of the queue.
enum ResultJob {
    /// Motion for an uploaded sound.
    Generate(String),
    /// Motion for a clip of the dataset beside the true motion.
    Pair(String, PathBuf),
    /// Video of a result.
    Film(String),
}

/// Results in the order of their requests.
#[derive(Clone)]
pub struct Results {
    folder: Arc<tempfile::TempDir>,
    all: Arc<Mutex<Vec<GeneratedResult>>>,
    queue: Sender<ResultJob>,
}

impl Results {
    /// Starts the worker; `program` is this program.
    ///
    /// # Errors
    /// No temporary folder can be created.
    pub fn start(program: PathBuf) -> Result<Self> {
        let folder = Arc::new(tempfile::tempdir().context("cannot create a temporary folder")?);
        let (queue, jobs) = mpsc::channel::<ResultJob>();
        let results = Self { folder, all: Arc::default(), queue };
        let (folder, all) = (results.folder.clone(), results.all.clone());
        std::thread::spawn(move || {
            let worker = ResultWorker { program, folder: folder.path().to_owned(), all };
            jobs.into_iter().for_each(|job| worker.work(&job));
        });
        Ok(results)
    }

    /// Registers a result and returns its identifier and the path of its sound, which is written before
    /// [`Self::generate`] or [`Self::pair`].
    ///
    /// # Errors
    /// Too many results, or the folder cannot be created.
    pub fn add(&self, checkpoint: &str, checkpoint_file: PathBuf, seed: u64, name: &str) -> Result<(String, PathBuf)> {
        let id = hex(&random::<8>()?);
        let folder = self.folder.path().join(&id);
        fs::create_dir(&folder)?;
        let name: String = name.chars().filter(|c| !c.is_control()).take(MAX_NAME).collect();
        let extension = Path::new(&name).extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let is_plain = (1..=5).contains(&extension.len()) && extension.bytes().all(|byte| byte.is_ascii_alphanumeric());
        let sound = if is_plain { format!("speech.{extension}") } else { SPEECH.to_owned() };
        let path = folder.join(&sound);
        let (checkpoint, files) = (checkpoint.to_owned(), vec![sound]);
        let (state, message) = ("queued", String::new());
        let mut all = self.all.lock().map_err(|_| anyhow::anyhow!("the results are not available"))?;
        ensure!(all.len() < MAX_RESULTS, "there are {MAX_RESULTS} results: restart `orator view`");
        all.push(GeneratedResult { id: id.clone(), checkpoint, seed, name, state, message, files, checkpoint_file });
        Ok((id, path))
    }

    /// Queues the generation of motion for the uploaded sound.
    pub fn generate(&self, id: &str) {
        let _ = self.queue.send(ResultJob::Generate(id.to_owned()));
    }

    /// Queues a clip of `dataset` for comparison.
    pub fn pair(&self, id: &str, dataset: PathBuf) {
        let _ = self.queue.send(ResultJob::Pair(id.to_owned(), dataset));
    }

    /// Queues the video of a result; `false`: there is no such result.
    pub fn film(&self, id: &str) -> bool {
        let is_known = self.all.lock().is_ok_and(|all| all.iter().any(|one| one.id == id && one.state == "done"));
        is_known && self.queue.send(ResultJob::Film(id.to_owned())).is_ok()
    }

    /// Removes a result whose upload failed.
    pub fn remove(&self, id: &str) {
        if let Ok(mut all) = self.all.lock() {
            all.retain(|one| one.id != id);
        }
        let _ = fs::remove_dir_all(self.folder.path().join(id));
    }

    pub fn facts(&self) -> Value {
        json!({ "results": self.all.lock().map(|all| all.clone()).unwrap_or_default() })
    }

    /// Path of a finished file of a result; only files that are listed can be requested.
    pub fn file(&self, id: &str, name: &str) -> Option<PathBuf> {
        let all = self.all.lock().ok()?;
        let result = all.iter().find(|one| one.id == id)?;
        result.files.iter().any(|file| file == name).then(|| self.folder.path().join(id).join(name))
    }
}

struct ResultWorker {
    program: PathBuf,
    folder: PathBuf,
    all: Arc<Mutex<Vec<GeneratedResult>>>,
}

impl ResultWorker {
    fn work(&self, job: &ResultJob) {
        let (ResultJob::Generate(id) | ResultJob::Pair(id, _) | ResultJob::Film(id)) = job;
        let Some(result) = self.update(id, |one| one.state = "running") else { return };
        let done = match job {
            ResultJob::Generate(_) => self.run_generate(&result, &["motion.bvh", "motion.glb", "motion.vrma"]),
            ResultJob::Pair(_, dataset) => self.pair(&result, dataset),
            ResultJob::Film(_) => self.run_generate(&result, &["motion.mp4"]),
        };
        self.update(id, |one| match done {
            Ok(()) => one.state = "done",
            Err(error) => (one.state, one.message) = ("failed", format!("{error:#}")),
        });
    }

    /// Changes a result and returns it.
    fn update(&self, id: &str, change: impl FnOnce(&mut GeneratedResult)) -> Option<GeneratedResult> {
        let mut all = self.all.lock().ok()?;
        let result = all.iter_mut().find(|one| one.id == id)?;
        change(result);
        Some(result.clone())
    }

    /// Longest sample of the first split that has samples, of validation, test and train.
    fn pair(&self, result: &GeneratedResult, dataset: &Path) -> Result<()> {
        let folder = self.folder.join(&result.id);
        let dataset = Dataset::open(dataset)?;
        let splits = [Split::Validation, Split::Test, Split::Train];
        let split = splits.into_iter().find(|split| !dataset.samples(*split).is_empty());
        let samples = dataset.samples(split.context("the dataset has no samples")?);
        let longest = samples.iter().max_by_key(|sample| sample.n_frames).context("the dataset has no samples")?;
        let mut sample = dataset.read(longest)?;
        let fps = sample.motion.fps;
        let n_frames = sample.n_frames().min((MAX_CLIP_SECS * fps.per_sec()) as usize);
        let secs = fps.secs(n_frames);
        sample.motion.joints = sample.motion.joints.slice(ndarray::s![..n_frames, .., ..]).to_owned();
        sample.motion.mask = sample.motion.mask.slice(ndarray::s![..n_frames, ..]).to_owned();
        sample.sound.samples.truncate((secs * f64::from(SAMPLE_RATE)) as usize);
        fs::write(folder.join("truth.glb"), crate::video::glb(&sample.motion, None)?)?;
        wav::write(&folder.join(SPEECH), &sample.sound)?;
        self.update(&result.id, |one| one.files.push("truth.glb".to_owned()));
        self.run_generate(result, &["generated.glb"])
    }

    fn run_generate(&self, result: &GeneratedResult, files: &[&str]) -> Result<()> {
        let folder = self.folder.join(&result.id);
        let mut command = Command::new(&self.program);
        let sound = folder.join(result.files.first().context("the sound is missing")?);
        command.arg("generate").arg("--checkpoint").arg(&result.checkpoint_file).arg("--audio").arg(sound);
        if result.seed > 0 {
            command.arg("--seed").arg(result.seed.to_string());
        }
        let output = command.arg("--out").args(files.iter().map(|file| folder.join(file))).output();
        let output = output.context("cannot start `orator generate`")?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it ended without a message");
            bail!("{}", last.trim_start_matches("error: "));
        }
        self.update(&result.id, |one| one.files.extend(files.iter().map(|file| (*file).to_owned())));
        Ok(())
    }
}
