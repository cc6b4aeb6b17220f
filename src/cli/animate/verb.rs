//! `orator animate`.

use super::body_args::{BodyArgs, SmoothingArgs};
use super::film_args::FilmArgs;
use super::input::{InputMotion, MotionInput, inputs};
use super::report_text;
use super::retarget_args::{OpenedRig, RetargetArgs};
use crate::cli::Outcome;
use crate::cli::config_args::split;
use crate::cli::figure_args::FigureArgs;
use crate::cli::motion::video::VisibleVideo;
use crate::cli::outputs::{OutputFiles, names, next_output, outputs};
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result, bail, ensure};
use clap::ArgAction;
use clap::builder::BoolishValueParser;
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::export::film::{SecondPanel, smooth_rate};
use orator_avatar::animate::export::film_source::SourceCamera;
use orator_avatar::animate::retarget::captured_body::CapturedBody;
use orator_avatar::animate::{AnimationOptions, Constraints, Legs, Performance};
use orator_base::motion::units;
use orator_base::stage::progress::Progress as _;
use orator_base::text::{counted, length};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_dataset::Split;
use orator_formats::mocap::facing::LengthUnit;
use orator_formats::mocap::motion_file::{self, DEFAULT_FPS};
use orator_media::ffmpeg::audio;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Animate a video, or convert motion to BVH, FBX, glTF, VRM and video.
///
/// Joint positions become rotations of a full body, smoothed and limited to possible joint angles.
///
/// IN is a video: everything in which the speaker is visible is lifted as by `orator lift`, fit for training or not,
/// and an .mp4 shows the avatar beside the video and marks the limbs that are not visible.
///
/// Or IN is a motion: .npy (joints [frames, 49, 3], metres; the frame rate is in .npy.json), .txt (layout of Rebol et
/// al. 2021), .bvh, .npz of SMPL-X or SMPL-H (BEAT2, EMAGE, AMASS, Seamless Interaction), joints.npz or the folder of a
/// lifted video (work/lift/SPEAKER/VIDEO), or a dataset (work/dataset/SPEAKER) with --sample. With --format, IN may
/// also be a folder of motions, the folder of lifted videos of a speaker or an entire dataset; --out is then a folder.
///
/// The extension of each output selects its format: .bvh (cm, y up, facing +z, T-pose at rest), .fbx (binary 7.4) and
/// .glb (skinned avatar with the motion), .vrm (avatar only, VRM 1.0), .vrma (motion for VRM avatars), .smplx.npz
/// (SMPL-X rotations as in BEAT2), .json, .npz, .npy and .txt (joints of the figure), .mp4 (video).
///
/// Head and trunk follow the detected face, shoulders and hips where 2D keypoints are available: those of the dataset
/// or run, or of --keypoints. A .bvh or SMPL-X file keeps its captured head, trunk and legs, with the lengths of the
/// legs and the positions of the hips. Otherwise they stay at rest. Bone lengths and palm shapes are medians over the
/// motion; a palm that does not point along its hand is replaced by that of the other hand, or else by a standard one.
///
/// Smoothing removes noise that is estimated for each bone; motion without noise changes by a few millimetres at
/// most. The limits of elbow, forearm, wrist and finger joints were measured in motion capture; the report counts
/// every clamped angle. Above 25 % of the finger angles, the fingers are reported as unusable.
#[derive(clap::Args)]
pub struct Args {
    /// Video or motion to convert, or a folder of motions.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write; may be repeated. With --format: a single output folder.
    #[arg(long, value_name = "FILE|DIR", required = true, num_args = 1..)]
    out: Vec<PathBuf>,
    /// Write every motion of IN into the folder --out in these formats, separated by commas:
    /// bvh,fbx,glb,json,mp4,npy,npz,smplx.npz,txt,vrm,vrma
    #[arg(long, value_name = "EXTENSION", value_delimiter = ',')]
    format: Vec<String>,
    /// Key of the sample, if IN is a dataset.
    #[arg(long, value_name = "KEY")]
    sample: Option<String>,
    /// Convert only this split, if IN is a dataset.
    #[arg(long, value_name = "train|validation|test", value_parser = split, conflicts_with = "sample")]
    split: Option<Split>,
    #[command(flatten)]
    figure: FigureArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
    /// 2D keypoints of the same frames (`body` [T, 17, 3], COCO) from which the rotations of head and trunk are
    /// derived.
    #[arg(long, value_name = "FILE.npz", conflicts_with = "format")]
    keypoints: Option<PathBuf>,
    /// Audio of an .mp4 output; defaults to that of the dataset or run that contains the motion.
    #[arg(long, value_name = "FILE", conflicts_with = "format")]
    audio: Option<PathBuf>,
    /// Second panel of an .mp4 output: the source video, whose audio is used if there is no other, or another motion
    /// (.npy, .txt, .npz, .bvh), which is converted in the same way.
    #[arg(long, value_name = "FILE", conflicts_with = "format")]
    compare: Option<PathBuf>,
    /// Time in the video of --compare at which the motion begins, seconds.
    #[arg(long, value_name = "SECS", default_value_t = 0.0, requires = "compare")]
    compare_start: f64,
    /// Labels of the two motions with --compare, such as `prediction truth`; default to the file names.
    #[arg(long, value_names = ["FIRST", "SECOND"], num_args = 2, requires = "compare")]
    labels: Option<Vec<String>>,
    #[command(flatten)]
    film: FilmArgs,
    /// Unit of length of a .bvh input; detected from the length of the arms by default.
    #[arg(long, value_name = "m|cm|mm|inch")]
    units: Option<LengthUnit>,
    /// Frame rate of a .npy or .txt input that does not state one; defaults to 15. It is an error if the file states
    /// another rate.
    #[arg(long, value_name = "RATE")]
    input_fps: Option<FrameRate>,
    #[command(flatten)]
    body: BodyArgs,
    #[command(flatten)]
    smoothing: SmoothingArgs,
    /// Do not limit joint angles.
    #[arg(long)]
    no_constraints: bool,
    /// Limit the curl of each of the four fingers to within 10 degrees of their mean, as in Rebol et al. (2021); this
    /// also bends a pointing finger.
    #[arg(long, value_name = "on|off", default_value = "off", conflicts_with = "no_constraints", action = ArgAction::Set,
          value_parser = BoolishValueParser::new(), hide_possible_values = true)]
    curl_coherence: bool,
}

pub fn run(mut args: Args, ui: &Ui) -> Result<Outcome> {
    let video = VisibleVideo::find(&args.input, ui)?;
    let is_film = |path: &PathBuf| ExportFormat::from_path(path).is_ok_and(|format| format == ExportFormat::Mp4);
    if video.is_some() && args.compare.is_none() && (args.out.iter().any(is_film) || !args.format.is_empty()) {
        args.compare = Some(args.input.clone());
    }
    let written = args.out.iter().map(PathBuf::as_path).chain(args.retarget.writes());
    enter_sandbox(written, [args.input.as_path()].into_iter().chain(args.retarget.reads()));
    let options = options(&args)?;
    let rig = args.retarget.open()?;
    let inputs = match video {
        Some(video) => vec![MotionInput::of_video(video)],
        None => inputs(&args.input, args.sample.as_deref(), args.split)?,
    };
    if !args.format.is_empty() {
        return animate_folder(&args, &inputs, rig.as_ref(), &options, ui);
    }
    let [input] = inputs.as_slice() else {
        bail!(
            "{} contains {}: select one (--sample KEY in a dataset), or use --format bvh with a folder as --out",
            args.input.display(),
            counted(inputs.len(), "motion")
        );
    };
    let is_read = |path: &Path| {
        input.is_at(path)
            || [&args.audio, &args.compare]
                .into_iter()
                .flatten()
                .map(PathBuf::as_path)
                .chain(args.retarget.reads())
                .any(|read| read == path)
    };
    let outputs = outputs(&args.out, is_read, "an input", "; for a folder, add --format bvh")?;
    check_effect(&args, &outputs)?;
    let sound = args.audio.as_deref().map(audio::read_sound).transpose()?;
    let done = animate(&args, input, (sound, rig.as_ref()), &outputs, &options, ui)?;
    let next = next_output(&outputs, is_read).map(|out| {
        let sample = args.sample.as_ref().map(|key| format!(" --sample {key}")).unwrap_or_default();
        format!("orator animate {}{sample} --out {}", args.input.display(), out.display())
    });
    let text = format!("{}wrote {}", done.text, names(&outputs).join(", "));
    let mut facts = done.facts;
    facts["next"] = json!(next);
    ui.summary(&text, next.as_deref(), facts);
    Ok(Outcome::Done)
}

/// Animates every motion of a folder or dataset; a failure does not stop the others.
fn animate_folder(
    args: &Args,
    inputs: &[MotionInput],
    rig: Option<&OpenedRig>,
    options: &AnimationOptions,
    ui: &Ui,
) -> Result<Outcome> {
    let [folder] = args.out.as_slice() else { bail!("--format: expected exactly one --out, a folder") };
    ensure!(!folder.is_file(), "output {} is a file; --format expects a folder as --out", folder.display());
    let endings: Vec<&str> = args.format.iter().map(|ending| ending.trim_start_matches('.')).collect();
    for ending in &endings {
        ExportFormat::from_path(Path::new(&format!("--format .{ending}")))?;
    }
    let task = ui.begin("animating", inputs.len() as u64);
    let (mut text, mut facts, mut n_failed, mut n_files) = (String::new(), Vec::new(), 0, 0);
    for input in inputs {
        task.detail(&input.name);
        let named = |ending: &&str| {
            let path = folder.join(format!("{}.{ending}", input.name));
            ensure!(!input.is_at(&path), "output {} is the input motion; choose another folder", path.display());
            Ok((path.clone(), ExportFormat::from_path(&path)?))
        };
        let outputs: Result<Vec<_>> = endings.iter().map(named).collect();
        match outputs.and_then(|outputs| animate(args, input, (None, rig), &outputs, options, ui)) {
            Ok(done) => {
                n_files += endings.len();
                text += &format!("{}\n{}", input.name, done.text);
                facts.push(done.facts);
            }
            Err(error) => {
                n_failed += 1;
                ui.say(&format!("failed  {}: {error:#}", input.name));
                facts.push(json!({ "name": input.name, "error": format!("{error:#}") }));
            }
        }
        task.advance(1);
    }
    drop(task);
    text += &format!("wrote {} into {}", counted(n_files, "file"), folder.display());
    if n_failed > 0 {
        text += &format!("\n{n_failed} of {} failed", counted(inputs.len(), "motion"));
    }
    ui.summary(&text, None, json!({ "motions": facts, "failed": n_failed, "out": folder }));
    Ok(if n_failed > 0 { Outcome::SomeFailed } else { Outcome::Done })
}

/// Rejects options that have no effect on these outputs.
fn check_effect(args: &Args, outputs: &OutputFiles) -> Result<()> {
    let is_film = outputs.iter().any(|&(_, format)| format == ExportFormat::Mp4);
    let (beside, audio) = (args.compare.is_some(), args.audio.is_some());
    for (option, is_given) in [("--compare", beside), ("--audio", audio), ("--camera", args.film.is_given())] {
        ensure!(is_film || !is_given, "{option} applies to .mp4 outputs only: add an .mp4 to --out, or omit {option}");
    }
    args.figure.check(outputs)
}

/// Report on one animation, as text and as JSON.
struct AnimationSummary {
    text: String,
    facts: Value,
}

fn animate(
    args: &Args,
    input: &MotionInput,
    (sound, rig): (Option<Sound>, Option<&OpenedRig>),
    outputs: &OutputFiles,
    options: &AnimationOptions,
    ui: &Ui,
) -> Result<AnimationSummary> {
    let loaded = input.read((args.input_fps, args.units), args.keypoints.as_deref())?;
    let options = &args.body.of(&loaded, options);
    let InputMotion { motion, posture, body, sound: own, has_rate, mut notes, .. } = loaded;
    let (sound, posture) = (sound.or(own), args.body.posture(posture));
    let started = Instant::now();
    let performance = args.body.perform(&motion, posture.as_ref(), body, options);
    let secs = started.elapsed().as_secs_f64();
    let source = source(args, input, &motion)?;
    let film_fps = options.fps.unwrap_or_else(|| smooth_rate(motion.fps));
    let other = match &args.compare {
        Some(path) if motion_file::has_ending(path) => {
            let other = motion_file::read(path, Some(args.input_fps.unwrap_or(DEFAULT_FPS)))?;
            units::check(&other.motion).with_context(|| path.display().to_string())?;
            notes.extend(other.notes);
            if !other.has_rate && args.input_fps.is_none() {
                notes.push(format!("{} does not state its frame rate: {DEFAULT_FPS} is assumed", path.display()));
            }
            let options = AnimationOptions { fps: Some(film_fps), ..*options };
            Some(args.body.perform(&other.motion, None, CapturedBody::read(path, None)?, &options))
        }
        _ => None,
    };
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let labels = match args.labels.as_deref() {
        Some([ours, other]) => [ours.clone(), other.clone()],
        _ => [input.name.clone(), args.compare.as_deref().map(stem).unwrap_or_default()],
    };
    let beside = match (&args.compare, &other) {
        (None, _) => SecondPanel::Itself,
        (Some(_), Some(performance)) => {
            SecondPanel::Motion { performance, labels: labels.each_ref().map(String::as_str) }
        }
        (Some(path), None) => SecondPanel::Video { path, from_secs: args.compare_start, camera: source.as_ref() },
    };
    let is_film = outputs.iter().any(|&(_, format)| format == ExportFormat::Mp4);
    let motion_secs = motion.fps.secs(motion.n_frames());
    let read_part = |path: &Path, from_secs: f64| -> Result<Option<Sound>> {
        Ok(audio::read_mono(path, SAMPLE_RATE)?.map(|sound| part(&sound, from_secs, motion_secs)))
    };
    let sound = match (sound, beside) {
        (None, SecondPanel::Video { path, from_secs, .. }) if is_film => read_part(path, from_secs)?,
        (sound, _) => sound,
    };
    let sound = match (sound, input.sound_of_run()) {
        (None, Some(path)) if is_film => read_part(&path, 0.0)?,
        (sound, _) => sound,
    };
    let silence = match (is_film && sound.is_none(), args.format.is_empty()) {
        (false, _) => "",
        (true, true) => "the video has no audio: add it with --audio FILE\n",
        (true, false) => "the video has no audio\n",
    };
    let sources = ExportContent {
        sound: sound.as_ref(),
        names: args.figure.options().names,
        second_panel: beside,
        camera: args.film.camera(),
        film_fps: Some(film_fps),
        posture: None,
    };
    if let Some(rig) = rig {
        notes.extend(rig.write(&performance, outputs, ui)?);
    }
    for (path, format) in outputs.iter().filter(|_| rig.is_none()) {
        format.write(path, &performance, &sources, ui).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let Performance { report, clip, .. } = &performance;
    let assumed = if has_rate { "" } else { " (assumed: not stated in the file; set it with --input-fps)" };
    let noted: String = notes.iter().map(|note| format!("note: {note}\n")).collect();
    let text = format!(
        "{} at {}{assumed}, {}; written: {} at {}\n{}{noted}{silence}",
        counted(motion.n_frames(), "frame"),
        motion.fps,
        length(motion_secs),
        counted(clip.n_frames(), "frame"),
        clip.fps,
        report_text::text(report)
    );
    let facts = json!({
        "name": input.name,
        "n_frames": motion.n_frames(),
        "fps": motion.fps,
        "fps_assumed": !has_rate,
        "notes": notes,
        "written_frames": clip.n_frames(),
        "written_fps": clip.fps,
        "times_real_time": motion_secs / secs.max(1e-9),
        "report": report,
        "film_has_sound": is_film.then_some(sound.is_some()),
        "outputs": names(outputs),
    });
    Ok(AnimationSummary { text, facts })
}

/// Camera of the video from which the motion was lifted, if the film is to be rendered from there.
fn source(args: &Args, input: &MotionInput, motion: &Motion) -> Result<Option<SourceCamera>> {
    if !args.film.is_over_video() {
        return Ok(None);
    }
    let is_video = args.compare.as_ref().is_some_and(|path| !motion_file::has_ending(path));
    ensure!(is_video, "--camera source needs the video that the motion was lifted from: give --compare VIDEO");
    let keypoints = input.keypoints(args.keypoints.as_deref(), motion)?.with_context(|| {
        format!("{} has no keypoints, which --camera source needs: give --keypoints FILE.npz", input.name)
    })?;
    SourceCamera::fit(motion, &keypoints).map(Some).with_context(|| format!("cannot fit the camera of {}", input.name))
}

fn options(args: &Args) -> Result<AnimationOptions> {
    let smoothing = args.smoothing.smoothing()?;
    let constraints = match args.no_constraints {
        true => Constraints::NONE,
        false => Constraints { limits: true, curl_coherence: args.curl_coherence },
    };
    let (yaw, breath) = (args.body.yaw(), args.body.has_breath());
    let fps = args.figure.options().fps;
    Ok(AnimationOptions { smoothing, constraints, yaw, legs: Legs::default(), breath, fps })
}

/// Up to `secs` seconds of a sound from second `from_secs` on.
fn part(sound: &Sound, from_secs: f64, secs: f64) -> Sound {
    let at = |secs: f64| ((secs * f64::from(sound.rate)).round() as usize).min(sound.samples.len());
    Sound { rate: sound.rate, samples: sound.samples[at(from_secs)..at(from_secs + secs)].to_vec() }
}
