//! Motion generated for the page: a queue of one worker that starts `generate` of this program for each request. Files
//! are in a folder that is removed when the server ends.

use anyhow::{Context, Result, bail};
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::{Dataset, Split};
use orator_formats::{checkpoint, wav};
use orator_report::videos::gestures::part;
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
/// Maximum number of results; the oldest is removed for a new one.
const MAX_RESULTS: usize = 50;
/// Sound of a clip of the dataset; an uploaded sound has its own extension.
const SPEECH: &str = "speech.wav";

#[derive(Clone, Debug, Serialize)]
pub struct GeneratedResult {
    pub id: String,
    /// Name of the training.
    pub checkpoint: String,
    /// Seed of the variant; `None`: the network's own motion.
    pub seed: Option<u64>,
    /// Speaker, for a model of several.
    pub speaker: Option<String>,
    /// Step of the checkpoint.
    pub step: Value,
    /// Name of the sound.
    pub name: String,
    pub state: &'static str,
    /// Error of a failed result or of its video.
    pub message: String,
    /// State of the video: empty, `queued`, `done` or `failed`.
    pub film: &'static str,
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

/// What a result is generated from.
pub struct ResultRequest {
    /// Name of the training.
    pub checkpoint: String,
    pub checkpoint_file: PathBuf,
    pub seed: Option<u64>,
    pub speaker: Option<String>,
    /// Name of the sound.
    pub name: String,
}

/// Results in the order of their requests. Their folder is removed with the last clone.
#[derive(Clone)]
pub struct Results {
    folder: Arc<tempfile::TempDir>,
    all: Arc<Mutex<Vec<GeneratedResult>>>,
    queue: Sender<ResultJob>,
}

/// Registered result whose sound is not complete; removed on drop unless it is queued.
pub struct PendingResult {
    results: Results,
    id: String,
    /// Path at which the sound is expected.
    pub sound: PathBuf,
    is_queued: bool,
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
        let worker = ResultWorker { program, folder: results.folder.path().to_owned(), all: results.all.clone() };
        std::thread::spawn(move || jobs.into_iter().for_each(|job| worker.work(&job)));
        Ok(results)
    }

    /// Registers a result; above 50, the oldest that is not being generated is removed.
    ///
    /// # Errors
    /// An unreadable checkpoint, too many results in the queue, or a folder that cannot be created.
    pub fn add(&self, request: ResultRequest) -> Result<PendingResult> {
        let ResultRequest { checkpoint, checkpoint_file, seed, speaker, name } = request;
        let step = checkpoint::facts(&checkpoint_file)?["step"].clone();
        let id = hex(&random::<8>()?);
        let folder = self.folder.path().join(&id);
        let name: String = name.chars().filter(|c| !c.is_control()).take(MAX_NAME).collect();
        let extension = Path::new(&name).extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let is_plain = (1..=5).contains(&extension.len()) && extension.bytes().all(|byte| byte.is_ascii_alphanumeric());
        let sound = if is_plain { format!("speech.{extension}") } else { SPEECH.to_owned() };
        let path = folder.join(&sound);
        let mut all = self.all.lock().map_err(|_| anyhow::anyhow!("the results are not available"))?;
        if all.len() >= MAX_RESULTS {
            let is_idle = |one: &GeneratedResult| ["done", "failed"].contains(&one.state) && one.film != "queued";
            let oldest = all.iter().position(is_idle).context("too many results are in the queue: wait for one")?;
            let _ = fs::remove_dir_all(self.folder.path().join(all.remove(oldest).id));
        }
        fs::create_dir(&folder)?;
        let (files, state, film, message) = (vec![sound], "queued", "", String::new());
        let result = GeneratedResult {
            id: id.clone(),
            checkpoint,
            seed,
            speaker,
            step,
            name,
            state,
            message,
            film,
            files,
            checkpoint_file,
        };
        all.push(result);
        Ok(PendingResult { results: self.clone(), id, sound: path, is_queued: false })
    }

    /// Queues the video of a finished result that has none; `false`: there is no such result.
    pub fn film(&self, id: &str) -> bool {
        let Ok(mut all) = self.all.lock() else { return false };
        let without_film = |one: &&mut GeneratedResult| one.id == id && one.state == "done" && one.film != "done";
        let Some(result) = all.iter_mut().find(without_film) else { return false };
        let was_queued = std::mem::replace(&mut result.film, "queued") == "queued";
        was_queued || self.queue.send(ResultJob::Film(id.to_owned())).is_ok()
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

impl PendingResult {
    /// Queues the generation of motion for the sound, and returns the identifier of the result.
    pub fn generate(self) -> String {
        let job = ResultJob::Generate(self.id.clone());
        self.send(job)
    }

    /// Queues a clip of `dataset` for comparison, and returns the identifier of the result.
    pub fn pair(self, dataset: PathBuf) -> String {
        let job = ResultJob::Pair(self.id.clone(), dataset);
        self.send(job)
    }

    fn send(mut self, job: ResultJob) -> String {
        self.is_queued = self.results.queue.send(job).is_ok();
        self.id.clone()
    }
}

impl Drop for PendingResult {
    fn drop(&mut self) {
        if self.is_queued {
            return;
        }
        if let Ok(mut all) = self.results.all.lock() {
            all.retain(|one| one.id != self.id);
        }
        let _ = fs::remove_dir_all(self.results.folder.path().join(&self.id));
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
        let is_film = matches!(job, ResultJob::Film(_));
        let begin = |one: &mut GeneratedResult| {
            if !is_film {
                one.state = "running";
            }
        };
        let Some(result) = self.update(id, begin) else { return };
        let done = match job {
            ResultJob::Generate(_) => self.generate(&result, &["motion.bvh", "motion.glb", "motion.vrma"]),
            ResultJob::Pair(_, dataset) => self.pair(&result, dataset),
            ResultJob::Film(_) => self.film(&result),
        };
        self.update(id, |one| {
            let state = if done.is_ok() { "done" } else { "failed" };
            if is_film {
                one.film = state;
            } else {
                one.state = state;
            }
            one.message = done.err().map(|error| format!("{error:#}")).unwrap_or_default();
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
        let truth = part(&sample.motion, 0, n_frames);
        sample.sound.samples.truncate((secs * f64::from(SAMPLE_RATE)) as usize);
        fs::write(folder.join("truth.glb"), crate::video::glb(&truth, None)?)?;
        wav::write(&folder.join(SPEECH), &sample.sound)?;
        self.update(&result.id, |one| one.files.push("truth.glb".to_owned()));
        self.generate(result, &["generated.glb"])
    }

    fn generate(&self, result: &GeneratedResult, files: &[&str]) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg("generate").arg("--checkpoint").arg(&result.checkpoint_file);
        command.arg("--audio").arg(self.sound(result)?);
        if let Some(seed) = result.seed {
            command.arg("--seed").arg(seed.to_string());
        }
        if let Some(speaker) = &result.speaker {
            command.arg("--speaker").arg(speaker);
        }
        self.run(result, command, files)
    }

    /// Video of the motion that was generated, with its sound.
    fn film(&self, result: &GeneratedResult) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg("animate").arg(self.folder.join(&result.id).join("motion.bvh"));
        command.arg("--audio").arg(self.sound(result)?);
        self.run(result, command, &["motion.mp4"])
    }

    fn sound(&self, result: &GeneratedResult) -> Result<PathBuf> {
        let name = result.files.first().context("the sound is missing")?;
        Ok(self.folder.join(&result.id).join(name))
    }

    /// Runs `command` with the output `files`, which are then listed.
    fn run(&self, result: &GeneratedResult, mut command: Command, files: &[&str]) -> Result<()> {
        let folder = self.folder.join(&result.id);
        let output = command.arg("--out").args(files.iter().map(|file| folder.join(file))).output();
        let output = output.context("cannot start the program")?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it ended without a message");
            bail!("{}", last.trim_start_matches("error: "));
        }
        self.update(&result.id, |one| one.files.extend(files.iter().map(|file| (*file).to_owned())));
        Ok(())
    }
}
