//! The process of a unit: it restricts itself, builds the stage, works, and says how that goes on standard output. It dies
//! with the run that started it.

use super::failure::SentFailure;
use super::limits::limit_memory;
use super::message::{MediaHeader, MediaRequest, Message, Request, UnitRequest, receive, send};
use crate::stages;
use anyhow::{Context, Result};
use orator_base::stage::progress::{Event, Progress, Task};
use orator_base::stage::{Report, Unit, attempt, workdir};
use orator_base::types::time::FrameRate;
use orator_dataset::config::Config;
use orator_dataset::config::videos::Videos;
use orator_media::ffmpeg::probe::probe;
use orator_media::ffmpeg::write::excerpt;
use orator_media::sandbox::{FileAccess, restrict};
use std::io::{Read, Stdout, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The argument by which the program becomes the process of a unit. It stands in no help text.
pub const VERB: &str = "work-unit";

/// Least time between two messages of a task's progress.
const PACE: Duration = Duration::from_millis(50);

/// Answers the request on standard input. It must come before the process starts threads.
///
/// # Errors
/// No request, or nobody who reads the answer.
pub fn serve() -> Result<()> {
    rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    let out = Messages(Mutex::new(std::io::stdout()));
    match receive(&mut std::io::stdin().lock()).context("this is started by `orator run` alone")? {
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
        Request::Media { wanted: media, memory } => {
            limit_memory(memory)?;
            let writes = media.excerpt.iter().filter_map(|excerpt| excerpt.to.parent().map(Into::into)).collect();
            restrict(&FileAccess { reads: Some(vec![media.source.clone()]), writes });
            answer(&out, || answer_media(&media).map(Message::Media))
        }
    }
}

/// Sends the message that `work` ends with, for as long as the process that asked is there.
fn answer(out: &Messages, work: impl FnOnce() -> Result<Message>) -> Result<()> {
    let watched = std::thread::Builder::new().spawn(end_with_parent);
    let work = || watched.context("cannot allocate memory for a thread").and_then(|_| work());
    let failed = |error| Message::Failed(SentFailure::of(&workdir::full_disk(error)));
    out.send(&attempt::catch_panics(work).unwrap_or_else(failed))
}

/// Ends the process when the other end of standard input is gone.
fn end_with_parent() {
    let mut byte = [0];
    while matches!(std::io::stdin().lock().read(&mut byte), Ok(1..)) {}
    std::process::abort();
}

fn work(request: UnitRequest, out: &Messages) -> Result<Report> {
    let UnitRequest { stage, speaker, video, source, part, settings, config_file, keypoints, out: folder, .. } =
        request;
    let unit = Unit { speaker: speaker.clone(), video: video.clone(), source: source.into() };
    let keypoints = keypoints.map(|source| (video, source)).into_iter().collect();
    let videos = Videos { speaker, units: vec![unit.clone()], keypoints, ..Videos::default() };
    let config = Config { settings, file: config_file, notes: Vec::new() };
    let stage = stages::build(stage.parse()?, &config, &[videos], &[])?;
    let progress = SentProgress { out, next: AtomicU32::new(0) };
    let folder = PathBuf::from(folder);
    match part {
        Some(part) => stage.run_part(&unit, part, &folder, &progress).map(|()| Report::default()),
        None => stage.run(&unit, &folder, &progress),
    }
}

/// The header of a video; the length of an excerpt that it copies.
///
/// # Errors
/// A video that cannot be read, an excerpt that cannot be copied.
pub fn answer_media(request: &MediaRequest) -> Result<MediaHeader> {
    if let Some(wanted) = &request.excerpt {
        let secs = excerpt::copy(&request.source, &wanted.to, wanted.start_secs, wanted.secs)?;
        return Ok(MediaHeader { secs: Some(secs), ..MediaHeader::default() });
    }
    let media = probe(&request.source)?;
    let image_size = media.video.as_ref().map_or([0; 2], |video| video.coded_size);
    let fps = media.video.and_then(|video| video.fps).map(FrameRate::per_sec);
    Ok(MediaHeader { secs: media.duration_secs, image_size, fps })
}

/// Standard output.
struct Messages(Mutex<Stdout>);

impl Messages {
    fn send(&self, message: &Message) -> Result<()> {
        let mut out = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        send(&mut *out, message)?;
        Ok(out.flush()?)
    }

    /// Sends what may be lost: a run that is gone ends this process anyway.
    fn tell(&self, message: &Message) {
        let _ = self.send(message);
    }
}

/// Progress that goes to the run.
struct SentProgress<'a> {
    out: &'a Messages,
    next: AtomicU32,
}

impl Progress for SentProgress<'_> {
    fn begin(&self, _label: &str, total: u64) -> Box<dyn Task + '_> {
        let task = self.next.fetch_add(1, Ordering::Relaxed);
        self.out.tell(&Message::Begin { task, total });
        Box::new(SentTask { out: self.out, task, waiting: Mutex::new((0, Instant::now())) })
    }

    fn say(&self, line: &str) {
        self.out.tell(&Message::Say { line: line.to_owned() });
    }

    fn event(&self, event: &Event<'_>) {
        match event {
            Event::Estimate { line } => self.out.tell(&Message::Estimate { line: (*line).to_owned() }),
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
        if waiting.1.elapsed() >= PACE {
            self.out.tell(&Message::Advance { task: self.task, steps: waiting.0 });
            *waiting = (0, Instant::now());
        }
    }

    fn detail(&self, text: &str) {
        self.out.tell(&Message::Detail { task: self.task, text: text.to_owned() });
    }
}

impl Drop for SentTask<'_> {
    fn drop(&mut self) {
        self.out.tell(&Message::End { task: self.task });
    }
}
