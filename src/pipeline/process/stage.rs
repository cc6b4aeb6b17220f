//! A stage wrapper that processes each unit in a subprocess.

use super::failure::plain;
use super::limits::Limits;
use super::message::{MediaHeader, Message, Request, UnitRequest, receive, receive_floats, send_floats};
use super::subprocess::{Answers, UnitProcess};
use crate::pose2d::models;
use anyhow::{Context, Result, anyhow, bail, ensure};
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::progress::{Event, Progress, Task};
use orator_base::stage::{Report, Stage, StageWrapper, Unit};
use orator_base::types::device::DeviceChoice;
use orator_base::types::time::FrameRate;
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, KeypointSource};
use orator_formats::media_json::MediaInfo;
use orator_media::sandbox::Restriction;
use orator_onnx::{ModelStore, find_library};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::Path;
use std::process::ChildStdin;

/// Largest number of concurrent progress tasks accepted from a subprocess.
const MAX_TASKS: usize = 16;

/// A per-video stage, with the program that processes its units.
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
        let limits = self.limits(unit)?;
        let mut request = self.request(unit, part, out, limits.memory)?;
        // The sandboxed process has no access to the GPU: this process runs the models for it.
        let runtime = Some(&request.settings.models).filter(|models| models.provider != DeviceChoice::Cpu);
        let runtime = runtime.filter(|_| self.name() == StageName::Pose2d.as_str()).map(models::runtime).transpose()?;
        let shared = runtime.and_then(|(runtime, _)| runtime.inference);
        let store = shared.iter().map(|_| ModelStore::open(&request.settings.models.dir)).next().transpose()?;
        if shared.is_none() {
            request.settings.models.provider = DeviceChoice::Cpu;
        }
        let request = Request::Unit(Box::new(request));
        let infer = |id: &str, input: &[f32]| {
            let (shared, store) = shared.as_ref().zip(store.as_ref()).context("no model is shared")?;
            shared(store.manifest().get(id)?, store.dir(), input)
        };
        let read = |answers: &mut Answers<'_>, stdin: &mut Option<ChildStdin>| follow(answers, stdin, progress, infer);
        answer_from(self.program, &request, &unit.source, &limits, read)
    }

    /// Limits of the subprocess: from the header of the video, or from the output of `extract` once that has run.
    fn limits(&self, unit: &Unit) -> Result<Limits> {
        let settings = &self.config.settings;
        let header = if self.name() != StageName::Extract.as_str() {
            MediaInfo::read(&Artifact::MediaInfo.path(&settings.work.dir, unit)).ok().map(|media| MediaHeader {
                secs: Some(media.duration_secs.max(media.audio_secs.unwrap_or(0.0))),
                image_size: media.image_size,
                fps: media.source_fps.map(FrameRate::per_sec),
            })
        } else if self.keypoints(unit).is_none() {
            Some(ask_media(self.program, &unit.source, &Limits::of_header())?)
        } else {
            None
        };
        let other_inputs = self.stage.inputs(unit)?.into_iter().filter(|input| input.path != unit.source);
        let n_bytes = other_inputs.filter_map(|input| std::fs::metadata(input.path).ok()).map(|meta| meta.len()).sum();
        let rate = settings.extract.rate().per_sec();
        Ok(header.map_or_else(Limits::of_machine, |header| Limits::of_video(&header, rate, n_bytes)))
    }

    /// Configuration entry of a unit that consists of keypoints of another program.
    fn keypoints(&self, unit: &Unit) -> Option<&KeypointSource> {
        let of_speaker = self.videos.iter().find(|videos| videos.speaker == unit.speaker);
        of_speaker.and_then(|videos| videos.keypoints.get(&unit.video))
    }

    fn request(&self, unit: &Unit, part: Option<usize>, out: &Path, memory: u64) -> Result<UnitRequest> {
        let mut settings = self.config.settings.clone();
        settings.speaker.retain(|speaker| speaker.name == unit.speaker);
        let decisions = self.videos.iter().flat_map(|videos| &videos.decisions);
        let decisions = decisions.filter(|one| one.speaker == unit.speaker && one.video == unit.video);
        let mut reads: Vec<_> = self.stage.inputs(unit)?.into_iter().map(|input| input.path.into()).collect();
        reads.push(settings.models.dir.as_os_str().to_owned());
        // The sandboxed process cannot list the folders of the library search, so the library is found here.
        if let Ok(library) = find_library(&settings.models.onnxruntime, &settings.models.dir) {
            reads.push(library.clone().into());
            settings.models.onnxruntime = library;
        }
        Ok(UnitRequest {
            stage: self.name().to_owned(),
            speaker: unit.speaker.clone(),
            video: unit.video.clone(),
            source: unit.source.clone().into(),
            part,
            settings,
            config_file: self.config.file.clone(),
            keypoints: self.keypoints(unit).cloned(),
            decisions: decisions.cloned().collect(),
            reads,
            out: out.into(),
            memory,
        })
    }
}

/// Reports how far a subprocess of `program` can be sandboxed on this machine.
pub fn probe(program: &Path) -> Result<Restriction> {
    let mut process = UnitProcess::start(program)?;
    process.ask(&Request::Restrict);
    let answer = process.follow(&Limits::of_header(), |answers, _| receive(answers));
    match answer.map_err(|death| anyhow!("{}: its subprocess {death}", program.display()))? {
        Message::Restricted(restriction) => Ok(restriction),
        other => bail!("unexpected answer {other:?}"),
    }
}

/// Lets a sandboxed subprocess of `program` run `answer_media`.
pub fn ask_media(program: &Path, source: &Path, limits: &Limits) -> Result<MediaHeader> {
    let request = Request::Media { source: source.to_owned(), memory: limits.memory };
    answer_from(program, &request, source, limits, |answers, _| match receive(answers)? {
        Message::Media(header) => Ok(Ok(header)),
        Message::Failed(failure) => Ok(Err(failure.into_error())),
        _ => bail!("unexpected answer to the request"),
    })
}

/// Starts `program`, sends the request concerning `source` and parses the answer with `read`.
fn answer_from<T>(
    program: &Path,
    request: &Request,
    source: &Path,
    limits: &Limits,
    read: impl FnOnce(&mut Answers<'_>, &mut Option<ChildStdin>) -> Result<Result<T>>,
) -> Result<T> {
    let mut process = UnitProcess::start(program)?;
    process.ask(request);
    let process_error = |death| Err(anyhow!("{}: the process reading it {death}", source.display()));
    process.follow(limits, read).unwrap_or_else(process_error).map_err(|error| limits.explain(source, error))
}

/// Forwards progress, and runs shared models with `infer`, until the subprocess sends its result. Fails if the stream
/// ends or contains an invalid message.
pub fn follow(
    from: &mut impl Read,
    to: &mut Option<impl Write>,
    progress: &dyn Progress,
    infer: impl Fn(&str, &[f32]) -> Result<Vec<f32>>,
) -> Result<Result<Report>> {
    let mut tasks: BTreeMap<u32, Box<dyn Task + '_>> = BTreeMap::new();
    loop {
        match receive(from)? {
            Message::Begin { task, total } => {
                ensure!(tasks.len() < MAX_TASKS, "more than {MAX_TASKS} progress tasks at a time");
                tasks.insert(task, progress.begin("", total));
            }
            Message::Advance { task, steps } => tasks.get(&task).into_iter().for_each(|task| task.advance(steps)),
            Message::Detail { task, text } => tasks.get(&task).into_iter().for_each(|task| task.detail(&plain(&text))),
            Message::End { task } => drop(tasks.remove(&task)),
            Message::Line { line } => progress.say(&plain(&line)),
            Message::Estimate { line } => progress.event(&Event::Estimate { line: &plain(&line) }),
            Message::Inference { model } => {
                match infer(&model, &receive_floats(from)?) {
                    // If the subprocess has ended, reading its next message fails.
                    Ok(values) => drop(to.as_mut().map(|to| send_floats(to, &values))),
                    Err(error) => return Ok(Err(error)),
                }
            }
            Message::Done { line, facts } => return Ok(Ok(Report { line: plain(&line), facts })),
            Message::Failed(failure) => return Ok(Err(failure.into_error())),
            Message::Restricted(_) | Message::Media(_) => bail!("unexpected answer to the request"),
        }
    }
}
