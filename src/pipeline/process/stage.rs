//! A stage that works on each unit in a subprocess. To a run it is the stage itself.

use super::failure::plain;
use super::message::{MediaRequest, Message, Request, UnitRequest, receive, send};
use super::unit::VERB;
use anyhow::{Context, Result, anyhow, bail, ensure};
use orator_base::stage::progress::{Event, Progress, Task};
use orator_base::stage::{Report, Stage, StageWrapper, Unit};
use orator_dataset::config::Config;
use orator_dataset::config::videos::Videos;
use orator_media::sandbox::Restriction;
use orator_onnx::find_library;
use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};

/// Most tasks under way at a time that a process is believed.
const MAX_TASKS: usize = 16;
/// Bytes of what a process complained of that are kept: the last ones.
const MAX_COMPLAINT: usize = 2000;

/// A stage of videos, with the program that works on its units.
pub struct SubprocessStage<'a> {
    pub stage: Box<dyn Stage>,
    pub program: &'a Path,
    pub config: &'a Config,
    pub videos: &'a [Videos],
}

impl StageWrapper for SubprocessStage<'_> {
    fn inner(&self, _unit: Option<&Unit>) -> &dyn Stage {
        &*self.stage
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        self.work(unit, None, out, progress)
    }

    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        self.work(unit, Some(part), out, progress).map(drop)
    }
}

impl SubprocessStage<'_> {
    fn work(&self, unit: &Unit, part: Option<usize>, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let mut process = UnitProcess::start(self.program)?;
        process.ask(&Request::Unit(Box::new(self.request(unit, part, out)?)));
        match process.follow(progress) {
            Ok(ended) => ended,
            Err(death) => Err(anyhow!("{}: the process that read it {death}", unit.source.display())),
        }
    }

    fn request(&self, unit: &Unit, part: Option<usize>, out: &Path) -> Result<UnitRequest> {
        let mut settings = self.config.settings.clone();
        settings.speaker.retain(|speaker| speaker.name == unit.speaker);
        let mut reads: Vec<_> = self.stage.inputs(unit)?.into_iter().map(|input| input.path.into()).collect();
        reads.push(settings.models.dir.as_os_str().to_owned());
        // The search for the library leads to folders that the process cannot list.
        if let Ok(library) = find_library(&settings.models.onnxruntime, &settings.models.dir) {
            reads.push(library.clone().into());
            settings.models.onnxruntime = library;
        }
        let of_speaker = self.videos.iter().find(|videos| videos.speaker == unit.speaker);
        Ok(UnitRequest {
            stage: self.name().to_owned(),
            speaker: unit.speaker.clone(),
            video: unit.video.clone(),
            source: unit.source.clone().into(),
            part,
            settings,
            config_file: self.config.file.clone(),
            keypoints: of_speaker.and_then(|videos| videos.keypoints.get(&unit.video)).cloned(),
            reads,
            out: out.into(),
        })
    }
}

/// How far a process that `program` starts is restricted here.
///
/// # Errors
/// The program cannot be started, or does not answer.
pub fn probe(program: &Path) -> Result<Restriction> {
    match UnitProcess::start(program)?.answer(&Request::Restrict)? {
        Message::Restricted(restriction) => Ok(restriction),
        other => bail!("{other:?} is no answer"),
    }
}

/// What a restricted process that `program` starts finds of a video: see `answer_media`.
///
/// # Errors
/// Those of `answer_media`; a process that is lost.
pub fn ask_media(program: &Path, request: &MediaRequest) -> Result<Option<f64>> {
    match UnitProcess::start(program)?.answer(&Request::Media(request.clone())) {
        Ok(Message::Secs(secs)) => Ok(secs),
        Ok(Message::Failed(failure)) => Err(failure.into_error()),
        _ => bail!("{}: the process that read it gave no answer", request.source.display()),
    }
}

/// A process at work, which ends with this value. It may have been taken over by what it read.
struct UnitProcess {
    child: Child,
    /// Open while the process may live.
    stdin: Option<ChildStdin>,
}

impl UnitProcess {
    fn start(program: &Path) -> Result<Self> {
        let mut command = Command::new(program);
        command.arg(VERB).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is for the run alone, which ends its processes.
        command.process_group(0);
        let mut child = command.spawn().with_context(|| format!("cannot start {}", program.display()))?;
        let stdin = child.stdin.take();
        Ok(Self { child, stdin })
    }

    /// Sends the request. A process that is gone already is noticed by its silence.
    fn ask(&mut self, request: &Request) {
        let _ = self.stdin.as_mut().map(|stdin| send(stdin, request));
    }

    /// The one message that the process sends in answer to a request.
    fn answer(mut self, request: &Request) -> Result<Message> {
        self.ask(request);
        receive(&mut self.child.stdout.take().context("no pipe")?)
    }

    /// Follows the process to the stage's result and ends it, so that nothing is written after; or says how it was lost.
    fn follow(&mut self, progress: &dyn Progress) -> Result<Result<Report>, String> {
        let (Some(out), Some(complaints)) = (self.child.stdout.take(), self.child.stderr.take()) else {
            return Err("has no pipes".to_owned());
        };
        let (result, complaint) = std::thread::scope(|scope| {
            let complaint = scope.spawn(|| last_bytes(complaints));
            let result = relay(&mut BufReader::new(out), progress);
            let _ = self.child.kill();
            (result, complaint.join().unwrap_or_default())
        });
        let status = self.child.wait();
        result.map_err(|error| {
            let is_end = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::UnexpectedEof;
            let death = match status {
                Ok(status) if error.chain().filter_map(|cause| cause.downcast_ref()).any(is_end) => death(status),
                _ => "sent what makes no sense".to_owned(),
            };
            match plain(String::from_utf8_lossy(&complaint).trim()) {
                said if said.is_empty() => death,
                said => format!("{death}; it said: {said}"),
            }
        })
    }
}

impl Drop for UnitProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Hands the progress on until the process has a result. Errors: its end, or what is no message.
fn relay(from: &mut impl Read, progress: &dyn Progress) -> Result<Result<Report>> {
    let mut tasks: BTreeMap<u32, Box<dyn Task + '_>> = BTreeMap::new();
    loop {
        match receive(from)? {
            Message::Begin { task, total } => {
                ensure!(tasks.len() < MAX_TASKS, "{MAX_TASKS} tasks at a time");
                tasks.insert(task, progress.begin("", total));
            }
            Message::Advance { task, steps } => tasks.get(&task).into_iter().for_each(|task| task.advance(steps)),
            Message::Detail { task, text } => tasks.get(&task).into_iter().for_each(|task| task.detail(&plain(&text))),
            Message::End { task } => drop(tasks.remove(&task)),
            Message::Say { line } => progress.say(&plain(&line)),
            Message::Estimate { line } => progress.event(&Event::Estimate { line: &plain(&line) }),
            Message::Done { line, facts } => return Ok(Ok(Report { line: plain(&line), facts })),
            Message::Failed(failure) => return Ok(Err(failure.into_error())),
            Message::Restricted(_) | Message::Secs(_) => bail!("no answer to the request"),
        }
    }
}

/// The last bytes that the process writes before it ends.
fn last_bytes(mut from: impl Read) -> Vec<u8> {
    let (mut last, mut piece) = (Vec::new(), [0; 4096]);
    while let Ok(n @ 1..) = from.read(&mut piece) {
        last.extend_from_slice(&piece[..n]);
        last.drain(..last.len().saturating_sub(MAX_COMPLAINT));
    }
    last
}

/// How a process ended before it had a result.
fn death(status: ExitStatus) -> String {
    if let Some(signal) = status.signal() {
        let why = match signal {
            6 => " (it gave up)",
            7 | 11 => " (it reached for memory that is not its own): the file may be damaged, or made to do harm",
            9 => " (killed: memory ran out, or by hand)",
            _ => "",
        };
        return format!("was ended by signal {signal}{why}");
    }
    format!("ended before it was done ({status})")
}
