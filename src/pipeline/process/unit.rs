//! Subprocess side: enters the sandbox, builds the stage, processes the unit and reports on standard output. The
//! process exits when the run that started it does.

use super::failure::SentFailure;
use super::limits::limit_memory;
use super::message::{MediaHeader, Message, Request, UnitRequest, receive, receive_floats, send, send_floats};
use crate::stages;
use anyhow::{Context, Result};
use orator_base::stage::progress::{Event, Progress, Task};
use orator_base::stage::{Report, Unit, attempt, workdir};
use orator_base::types::time::FrameRate;
use orator_dataset::config::Config;
use orator_dataset::config::videos::Videos;
use orator_media::ffmpeg::probe::probe;
use orator_media::sandbox::{FileAccess, restrict};
use orator_onnx::Inference;
use std::io::{Stdout, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Command-line argument that turns the program into a subprocess; not documented in the help.
pub const VERB: &str = "work-unit";

/// Least time between two progress messages of a task.
const MESSAGE_INTERVAL: Duration = Duration::from_millis(50);

/// Answers the request on standard input. Must be called before the process starts threads.
pub fn serve() -> Result<()> {
    rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    let out = Arc::new(Messages(Mutex::new(std::io::stdout())));
    // In a statement of its own, so that the lock is released before `receive_answers` needs it.
    let request = receive(&mut std::io::stdin().lock()).context("this command is used only by `orator run` itself")?;
    match request {
        Request::Restrict => {
            out.send(&Message::Restricted(restrict(&FileAccess { reads: Some(Vec::new()), writes: Vec::new() })))
        }
        Request::Unit(unit) => {
            limit_memory(unit.memory)?;
            let paths = |paths: &[std::ffi::OsString]| paths.iter().map(PathBuf::from).collect();
            restrict(&FileAccess { reads: Some(paths(&unit.reads)), writes: vec![(&unit.out).into()] });
            let done = |Report { line, facts }| Message::Done { line, facts };
            answer(&out, || work(*unit, &out).map(done))
        }
        Request::Media { source, memory } => {
            limit_memory(memory)?;
            restrict(&FileAccess { reads: Some(vec![source.clone()]), writes: Vec::new() });
            answer(&out, || answer_media(&source).map(Message::Media))
        }
    }
}

/// Sends the result of `work`. The process aborts if its parent exits first.
fn answer(out: &Arc<Messages>, work: impl FnOnce() -> Result<Message>) -> Result<()> {
    let (sender, answers) = channel();
    let (out_of_models, answers) = (Arc::clone(out), Mutex::new(answers));
    PARENT.get_or_init(|| {
        Arc::new(move |entry, _, input| {
            // Locked until the answer, so that answers are in the order of the questions.
            let answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
            out_of_models.ask(&entry.id, input)?;
            Ok(answers.recv()?)
        })
    });
    let parent_watch = std::thread::Builder::new().spawn(move || receive_answers(&sender));
    let work = || parent_watch.context("cannot allocate memory for a thread").and_then(|_| work());
    let failed = |error| Message::Failed(SentFailure::of(&workdir::full_disk(error)));
    out.send(&attempt::catch_panics(work).unwrap_or_else(failed))
}

/// Receives the values of shared models; aborts the process when the other end of standard input is closed.
fn receive_answers(answers: &Sender<Vec<f32>>) {
    let mut stdin = std::io::stdin().lock();
    while let Ok(values) = receive_floats(&mut stdin) {
        let _ = answers.send(values);
    }
    std::process::abort();
}

/// Runs shared models in the process of the run, whose GPU all workers use; `None` in other processes.
pub fn parent_inference() -> Option<Inference> {
    PARENT.get().cloned()
}

static PARENT: OnceLock<Inference> = OnceLock::new();

fn work(request: UnitRequest, messages: &Messages) -> Result<Report> {
    let UnitRequest { stage, speaker, video, source, part, settings, config_file, keypoints, decisions, out, .. } =
        request;
    let unit = Unit { speaker: speaker.clone(), video: video.clone(), source: source.into() };
    let keypoints = keypoints.map(|source| (video, source)).into_iter().collect();
    let videos = Videos { speaker, units: vec![unit.clone()], keypoints, decisions, ..Videos::default() };
    let config = Config { settings, file: config_file, notes: Vec::new() };
    let stage = stages::build(stage.parse()?, &config, &[videos], &[])?;
    let progress = SentProgress { out: messages, next: AtomicU32::new(0) };
    let folder = PathBuf::from(out);
    match part {
        Some(part) => stage.run_part(&unit, part, &folder, &progress).map(|()| Report::default()),
        None => stage.run(&unit, &folder, &progress),
    }
}

/// Reads the header of a video.
pub fn answer_media(source: &Path) -> Result<MediaHeader> {
    let media = probe(source)?;
    let image_size = media.video.as_ref().map_or([0; 2], |video| video.coded_size);
    let fps = media.video.and_then(|video| video.fps).map(FrameRate::per_sec);
    Ok(MediaHeader { secs: media.duration_secs, image_size, fps })
}

/// Locked standard output, for messages.
struct Messages(Mutex<Stdout>);

impl Messages {
    fn send(&self, message: &Message) -> Result<()> {
        let mut out = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        send(&mut *out, message)?;
        Ok(out.flush()?)
    }

    /// Asks the run for the outputs of a shared model.
    fn ask(&self, model: &str, input: &[f32]) -> Result<()> {
        let mut out = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        send(&mut *out, &Message::Inference { model: model.to_owned() })?;
        send_floats(&mut *out, input)
    }

    /// Sends a message that may be lost: if the run has exited, this process ends anyway.
    fn send_progress(&self, message: &Message) {
        let _ = self.send(message);
    }
}

/// Progress sink that sends messages to the run.
struct SentProgress<'a> {
    out: &'a Messages,
    next: AtomicU32,
}

impl Progress for SentProgress<'_> {
    fn begin(&self, _label: &str, total: u64) -> Box<dyn Task + '_> {
        let task = self.next.fetch_add(1, Ordering::Relaxed);
        self.out.send_progress(&Message::Begin { task, total });
        Box::new(SentTask { out: self.out, task, waiting: Mutex::new((0, Instant::now())) })
    }

    fn say(&self, line: &str) {
        self.out.send_progress(&Message::Line { line: line.to_owned() });
    }

    fn event(&self, event: &Event<'_>) {
        match event {
            Event::Estimate { line } => self.out.send_progress(&Message::Estimate { line: (*line).to_owned() }),
            event => event.message().iter().for_each(|line| self.say(line)),
        }
    }
}

struct SentTask<'a> {
    out: &'a Messages,
    task: u32,
    /// Steps not sent yet, and the time of the last message.
    waiting: Mutex<(u64, Instant)>,
}

impl Task for SentTask<'_> {
    fn advance(&self, steps: u64) {
        let Ok(mut waiting) = self.waiting.lock() else { return };
        waiting.0 += steps;
        if waiting.1.elapsed() >= MESSAGE_INTERVAL {
            self.out.send_progress(&Message::Advance { task: self.task, steps: waiting.0 });
            *waiting = (0, Instant::now());
        }
    }

    fn detail(&self, text: &str) {
        self.out.send_progress(&Message::Detail { task: self.task, text: text.to_owned() });
    }
}

impl Drop for SentTask<'_> {
    fn drop(&mut self) {
        self.out.send_progress(&Message::End { task: self.task });
    }
}
