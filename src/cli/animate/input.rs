//! Input motions of `orator animate`, with their face keypoints and audio.

use crate::cli::motion::video::VisibleVideo;
use crate::cli::outputs::is_same_file;
use anyhow::{Context as _, Result, bail, ensure};
use ndarray::{Array3, ArrayView3};
use orator_avatar::animate::retarget::captured_body::CapturedBody;
use orator_base::motion::posture::{self, LiftedBody};
use orator_base::motion::units;
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::types::pose2d::{Keypoints, N_BODY};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Split};
use orator_formats::mocap::facing::LengthUnit;
use orator_formats::mocap::motion_file::{self, MotionFile};
use orator_formats::{joints_npz, keypoints_npz};
use orator_pipeline::lift;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A motion not yet read.
pub struct MotionInput {
    pub name: String,
    location: InputLocation,
}

enum InputLocation {
    File(PathBuf),
    Sample(Rc<Dataset>, Box<SampleRef>),
    Video(Box<VisibleVideo>),
}

/// A motion with its posture and audio.
pub struct InputMotion {
    pub motion: Motion,
    pub posture: Option<Posture>,
    /// Head, trunk and legs of a capture.
    pub body: Option<CapturedBody>,
    /// Whether the person sits; `None` if hips and knees were not detected.
    pub is_seated: Option<bool>,
    pub sound: Option<Sound>,
    /// Whether its frame rate is known from the file or given; otherwise it is assumed.
    pub has_rate: bool,
    /// Assumptions made when reading it, as sentences.
    pub notes: Vec<String>,
}

/// The motions denoted by a file, the folder of a lifted video or a speaker, a folder of motions, or a dataset.
pub fn inputs(path: &Path, sample: Option<&str>, split: Option<Split>) -> Result<Vec<MotionInput>> {
    ensure!(path.exists(), "{} does not exist", path.display());
    let is_dataset = path.join("info.json").is_file() && path.join("index.jsonl").is_file();
    ensure!(
        is_dataset || (sample.is_none() && split.is_none()),
        "{} is not a dataset (work/dataset/SPEAKER): --sample and --split apply to datasets only",
        path.display()
    );
    if is_dataset {
        return of_dataset(path, sample, split);
    }
    let file = |path: PathBuf, named: &Path| {
        let name = motion_file::stem(named).to_string_lossy().into_owned();
        MotionInput { name, location: InputLocation::File(path) }
    };
    if !path.is_dir() {
        return Ok(vec![file(path.to_owned(), path)]);
    }
    if Artifact::Joints.within(path).is_file() {
        let absolute = path.canonicalize().with_context(|| format!("cannot open {}", path.display()))?;
        return Ok(vec![file(Artifact::Joints.within(path), &absolute)]);
    }
    let (mut found, mut rotations) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(path).with_context(|| format!("cannot open {}", path.display()))? {
        let entry = entry.with_context(|| format!("cannot read {}", path.display()))?.path();
        if Artifact::Joints.within(&entry).is_file() {
            found.push(file(Artifact::Joints.within(&entry), &entry));
        } else if entry.is_file() && motion_file::has_ending(&entry) {
            let is_bvh = entry.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("bvh"));
            let has_rotations = is_bvh || motion_file::is_smplx_name(&entry);
            if has_rotations { &mut rotations } else { &mut found }.push(file(entry.clone(), &entry));
        }
    }
    // BVH and SMPL-X files next to joints were created from them.
    if found.is_empty() {
        found = rotations;
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    for pair in found.windows(2) {
        ensure!(
            pair[0].name != pair[1].name,
            "{}: two motions have the name {}, so their outputs would overwrite each other; rename one",
            path.display(),
            pair[0].name
        );
    }
    ensure!(
        !found.is_empty(),
        "{} contains no motion: expected .npy, .txt, .npz or .bvh files, or folders with {}",
        path.display(),
        Artifact::Joints.file()
    );
    Ok(found)
}

fn of_dataset(path: &Path, sample: Option<&str>, split: Option<Split>) -> Result<Vec<MotionInput>> {
    let dataset = Rc::new(Dataset::open(path)?);
    let splits = split.map_or(Split::ALL.to_vec(), |split| vec![split]);
    let samples: Vec<SampleRef> = splits.into_iter().flat_map(|split| dataset.samples(split)).collect();
    let keys = || samples.iter().take(5).map(|sample| sample.key.clone()).collect::<Vec<_>>().join(", ");
    let is_requested = |found: &&SampleRef| sample.is_none_or(|key| *found.key == *key);
    let inputs: Vec<MotionInput> = samples
        .iter()
        .filter(is_requested)
        .map(|found| MotionInput {
            name: found.key.to_string(),
            location: InputLocation::Sample(Rc::clone(&dataset), Box::new(found.clone())),
        })
        .collect();
    match (inputs.is_empty(), sample) {
        (true, Some(key)) => bail!("{} has no sample {key}; examples of its samples: {}", path.display(), keys()),
        (true, None) => bail!("{} has no sample in this split", path.display()),
        _ => Ok(inputs),
    }
}

impl MotionInput {
    /// Everything that is visible in a video.
    pub fn of_video(video: VisibleVideo) -> Self {
        let name = video.path().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self { name, location: InputLocation::Video(Box::new(video)) }
    }

    /// Whether the motion is read from that file.
    pub fn is_at(&self, path: &Path) -> bool {
        match &self.location {
            InputLocation::File(file) => is_same_file(file, path),
            InputLocation::Video(video) => is_same_file(video.path(), path),
            InputLocation::Sample(..) => false,
        }
    }

    /// Reads the motion with the frame rate and unit of length given by the user. `keypoints` is the file of face
    /// keypoints; without it those of the run or the dataset are used.
    pub fn read(
        &self,
        (fps, units): (Option<FrameRate>, Option<LengthUnit>),
        keypoints: Option<&Path>,
    ) -> Result<InputMotion> {
        let loaded = match &self.location {
            InputLocation::Sample(dataset, sample) => {
                ensure!(units.is_none(), "{} is in metres: --units applies to .bvh files", self.name);
                let sample = dataset.read(sample)?;
                let body = sample.pose2d.slice(ndarray::s![.., ..N_BODY, ..]).to_owned();
                let with_posture = InputMotion::with_keypoints(sample.motion, body.view(), None);
                // The angles of a dataset were computed on the complete video.
                InputMotion {
                    sound: Some(sample.sound),
                    posture: sample.posture.or(with_posture.posture),
                    ..with_posture
                }
            }
            InputLocation::File(path) => {
                let MotionFile { motion, has_rate, notes } = motion_file::read_at(path, fps, units)?;
                let has_rate = has_rate || fps.is_some();
                let body = CapturedBody::read(path, units)?;
                InputMotion { motion, posture: None, body, is_seated: None, sound: None, has_rate, notes }
            }
            InputLocation::Video(video) => {
                ensure!(
                    fps.is_none() && units.is_none() && keypoints.is_none(),
                    "{} is a video: --input-fps, --units and --keypoints do not apply",
                    self.name
                );
                let (keypoints, lifted) = video.lift(&video.settings.lift)?;
                let notes = lift::notes(&keypoints, &lifted).into_iter().collect();
                check(&lifted.motion).with_context(|| format!("cannot animate {}", self.name))?;
                let lifted = InputMotion::with_keypoints(lifted.motion, keypoints.body.view(), Some(&lifted.extra));
                return Ok(InputMotion { notes, ..lifted });
            }
        };
        check(&loaded.motion).with_context(|| format!("cannot animate {}", self.name))?;
        match self.keypoints(keypoints, &loaded.motion)? {
            Some(Keypoints { body, .. }) => {
                let InputMotion { motion, sound, has_rate, notes, .. } = loaded;
                Ok(InputMotion {
                    sound,
                    has_rate,
                    notes,
                    ..InputMotion::with_keypoints(motion, body.view(), self.extra()?.as_ref())
                })
            }
            None => Ok(loaded),
        }
    }

    /// The keypoints of a file, or else of the run to which a lifted video belongs.
    pub fn keypoints(&self, named: Option<&Path>, motion: &Motion) -> Result<Option<Keypoints>> {
        let path = named.map(Path::to_owned).or_else(|| self.of_run(Artifact::Keypoints));
        path.map(|path| read_keypoints(&path, motion)).transpose()
    }

    /// Nose and hips that were lifted with the joints.
    fn extra(&self) -> Result<Option<Array3<f32>>> {
        match &self.location {
            InputLocation::File(path) if path.extension().is_some_and(|ending| ending == "npz") => {
                joints_npz::read_extra(path)
            }
            _ => Ok(None),
        }
    }

    /// The audio of the run to which a lifted video belongs.
    pub fn sound_of_run(&self) -> Option<PathBuf> {
        self.of_run(Artifact::Sound)
    }

    /// Path of an artifact in the run: `work/lift/SPEAKER/VIDEO/joints.npz` has its keypoints at
    /// `work/pose2d/SPEAKER/VIDEO/keypoints.npz`, and so on.
    fn of_run(&self, file: Artifact) -> Option<PathBuf> {
        let path = match &self.location {
            InputLocation::File(path) => path,
            InputLocation::Video(video) => return Some(video.file(file)),
            InputLocation::Sample(..) => return None,
        };
        let folder = path.canonicalize().ok()?.parent()?.to_owned();
        let (video, speaker) = (folder.file_name()?, folder.parent()?.file_name()?);
        let lift = folder.parent()?.parent()?;
        let folder = lift.parent()?.join(file.stage().as_str()).join(speaker).join(video);
        let found = file.within(&folder);
        (lift.file_name()? == StageName::Lift.as_str() && found.is_file()).then_some(found)
    }
}

impl InputMotion {
    /// Motion of a person with known keypoints [T, 17, 3] and optionally nose and hips [T, 3, 3] in 3D.
    fn with_keypoints(motion: Motion, body: ArrayView3<f32>, extra: Option<&Array3<f32>>) -> Self {
        let lifted = LiftedBody { joints: Some(motion.joints.view()), extra: extra.map(|extra| extra.view()) };
        let posture = Some(posture::estimate(body, lifted));
        let is_seated = posture::is_seated(body);
        Self { posture, body: None, is_seated, motion, sound: None, has_rate: true, notes: Vec::new() }
    }
}

fn read_keypoints(path: &Path, motion: &Motion) -> Result<Keypoints> {
    let keypoints = keypoints_npz::read(path)?;
    ensure!(
        keypoints.n_frames() == motion.n_frames(),
        "{} has {} frames of keypoints, the motion has {}: expected keypoints of the same clip",
        path.display(),
        keypoints.n_frames(),
        motion.n_frames()
    );
    Ok(keypoints)
}

/// Checks that the motion has frames and is in metres.
fn check(motion: &Motion) -> Result<()> {
    ensure!(motion.n_frames() > 0, "the motion has no frames");
    units::arm_bone(motion).with_context(|| {
        format!("no arm is detected in any of the {} frames: every arm joint is NaN", motion.n_frames())
    })?;
    units::check(motion)
}
