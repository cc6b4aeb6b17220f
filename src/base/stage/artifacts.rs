//! Names of the six stages and of every file that they write. No other file of the crate contains these names.

use super::Unit;
use anyhow::bail;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Stages of the pipeline, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// Videos to audio, frame times and shot scores.
    Extract,
    /// Frames to 2D keypoints of one speaker.
    Pose2d,
    /// Keypoints to usable intervals.
    Segment,
    /// 2D keypoints to 3D joints.
    Lift,
    /// Audio to words with times, for speakers with `transcripts = "auto"`.
    Transcribe,
    /// All videos of a speaker to one dataset.
    Dataset,
}

impl StageName {
    /// All stages, in order.
    pub const ALL: [Self; 6] =
        [Self::Extract, Self::Pose2d, Self::Segment, Self::Lift, Self::Transcribe, Self::Dataset];
    /// Stages that process one video at a time, in order.
    pub const OF_VIDEOS: [Self; 5] = [Self::Extract, Self::Pose2d, Self::Segment, Self::Lift, Self::Transcribe];

    /// Stage name: an argument of `--from`, and the stage's folder in the work folder.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Extract => "extract",
            Self::Pose2d => "pose2d",
            Self::Segment => "segment",
            Self::Lift => "lift",
            Self::Transcribe => "transcribe",
            Self::Dataset => "dataset",
        }
    }

    /// Name of the stage in records of earlier versions of the program, if it was different.
    pub const fn former(self) -> Option<&'static str> {
        match self {
            Self::Dataset => Some("shard"),
            Self::Extract | Self::Pose2d | Self::Segment | Self::Lift | Self::Transcribe => None,
        }
    }
}

impl fmt::Display for StageName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for StageName {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|stage| stage.as_str() == name) {
            Some(stage) => Ok(stage),
            None => bail!("unknown stage `{name}`: expected one of {}", Self::ALL.map(Self::as_str).join(", ")),
        }
    }
}

/// Files that a stage writes for a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Artifact {
    /// Audio, 16 kHz mono; absent for a video without an audio track.
    Sound,
    Timeline,
    MediaInfo,
    /// Folder with the frames as PNG; written on request.
    Frames,
    Keypoints,
    /// Detections in one part of a long video; removed when all parts have been joined.
    PoseSpan,
    /// Face shape and colours of the person; absent, like `FacePicture`, when no face was detected.
    Portrait,
    /// Picture of the face from the front.
    FacePicture,
    Measures,
    /// Delay of the audio against the picture; absent when nobody was visibly speaking.
    SoundOffset,
    SegmentIntervals,
    SegmentLedger,
    Joints,
    Bones,
    Camera,
    BoneChange,
    LiftIntervals,
    LiftLedger,
    /// Recognised words, a transcript on the clock of the video file.
    Words,
}

impl Artifact {
    pub const fn stage(self) -> StageName {
        match self {
            Self::Sound | Self::Timeline | Self::MediaInfo | Self::Frames => StageName::Extract,
            Self::Keypoints | Self::PoseSpan | Self::Portrait | Self::FacePicture => StageName::Pose2d,
            Self::Measures | Self::SoundOffset | Self::SegmentIntervals | Self::SegmentLedger => StageName::Segment,
            Self::Joints | Self::Bones | Self::Camera | Self::BoneChange | Self::LiftIntervals | Self::LiftLedger => {
                StageName::Lift
            }
            Self::Words => StageName::Transcribe,
        }
    }

    /// File name in the folder of the video.
    pub const fn file(self) -> &'static str {
        match self {
            Self::Sound => "audio.wav",
            Self::Timeline => "timeline.npz",
            Self::MediaInfo => "media.json",
            Self::Frames => "frames",
            Self::Keypoints => "keypoints.npz",
            Self::PoseSpan => "span.msgpack",
            Self::Portrait => "portrait.json",
            Self::FacePicture => "face.png",
            Self::Measures => "measures.npz",
            Self::SoundOffset => "sound_offset.json",
            Self::SegmentIntervals | Self::LiftIntervals => "intervals.json",
            Self::SegmentLedger | Self::LiftLedger => "ledger.json",
            Self::Joints => "joints.npz",
            Self::Bones => "bones.json",
            Self::Camera => "camera.json",
            Self::BoneChange => "bone_change.npz",
            Self::Words => "words.json",
        }
    }

    /// Path of the file for the video `unit` in the work folder `work`.
    pub fn path(self, work: &Path, unit: &Unit) -> PathBuf {
        self.within(&dir(work, self.stage(), unit))
    }

    /// Path of the file in `folder`, a stage's folder of one video.
    pub fn within(self, folder: &Path) -> PathBuf {
        folder.join(self.file())
    }
}

/// Folder of `unit` at `stage`: `work/<stage>/<speaker>/<video>`, or `work/<stage>/<speaker>` for a whole speaker.
pub fn dir(work: &Path, stage: StageName, unit: &Unit) -> PathBuf {
    unit.dir(&work.join(stage.as_str()))
}

/// Folder of a speaker at `stage`; for `StageName::Dataset` this folder is the dataset.
pub fn speaker_dir(work: &Path, stage: StageName, speaker: &str) -> PathBuf {
    work.join(stage.as_str()).join(speaker)
}

/// Record of the splits of a speaker's videos; it is kept when the dataset is removed.
pub fn splits(work: &Path, speaker: &str) -> PathBuf {
    work.join("splits").join(format!("{speaker}.json"))
}

/// Picture of the faces in a speaker's videos, which earlier versions of the program wrote.
pub fn faces(work: &Path, speaker: &str) -> PathBuf {
    work.join("faces").join(format!("{speaker}.png"))
}

/// Cache of file hashes in a work folder.
pub fn hashes(work: &Path) -> PathBuf {
    work.join("hashes.json")
}
