//! The names of the five stages and of every file that they write. No other file of the crate spells them.

use super::Unit;
use anyhow::bail;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A stage of the pipeline, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// Videos to sound, frame times and shot scores.
    Extract,
    /// Frames to 2D keypoints of one speaker.
    Pose2d,
    /// Keypoints to intervals worth keeping.
    Segment,
    /// 2D keypoints to 3D joints.
    Lift,
    /// All videos of a speaker to one dataset.
    Dataset,
}

impl StageName {
    /// Every stage, in order.
    pub const ALL: [Self; 5] = [Self::Extract, Self::Pose2d, Self::Segment, Self::Lift, Self::Dataset];
    /// The stages that work video by video, in order.
    pub const OF_VIDEOS: [Self; 4] = [Self::Extract, Self::Pose2d, Self::Segment, Self::Lift];

    /// The name: an argument of `--from`, the stage's folder in the work folder.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Extract => "extract",
            Self::Pose2d => "pose2d",
            Self::Segment => "segment",
            Self::Lift => "lift",
            Self::Dataset => "dataset",
        }
    }

    /// The name that the stage had in earlier versions of the program, where it was another.
    pub const fn former(self) -> Option<&'static str> {
        match self {
            Self::Dataset => Some("shard"),
            Self::Extract | Self::Pose2d | Self::Segment | Self::Lift => None,
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

    /// Reads a name, today's or a former one.
    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|stage| stage.as_str() == name || stage.former() == Some(name)) {
            Some(stage) => Ok(stage),
            None => bail!("no stage is called {name}; there are: {}", Self::ALL.map(Self::as_str).join(", ")),
        }
    }
}

/// A file that a stage writes for a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Artifact {
    /// 16 kHz mono; absent for a video without sound.
    Sound,
    Timeline,
    MediaInfo,
    /// The folder of the frames as PNG, if asked for.
    Frames,
    Keypoints,
    /// What was seen in a part of a long video, until all parts are there.
    PoseSpan,
    /// Shape of the face and colours of the person; absent where no face was seen. So is the next.
    Portrait,
    /// The face, seen from the front.
    FacePicture,
    Measures,
    /// How much later the sound is than the picture; absent where nobody was seen to speak.
    SoundOffset,
    SegmentIntervals,
    SegmentLedger,
    Joints,
    Bones,
    Camera,
    BoneChange,
    LiftIntervals,
    LiftLedger,
}

impl Artifact {
    /// The stage that writes it.
    pub const fn stage(self) -> StageName {
        match self {
            Self::Sound | Self::Timeline | Self::MediaInfo | Self::Frames => StageName::Extract,
            Self::Keypoints | Self::PoseSpan | Self::Portrait | Self::FacePicture => StageName::Pose2d,
            Self::Measures | Self::SoundOffset | Self::SegmentIntervals | Self::SegmentLedger => StageName::Segment,
            Self::Joints | Self::Bones | Self::Camera | Self::BoneChange | Self::LiftIntervals | Self::LiftLedger => {
                StageName::Lift
            }
        }
    }

    /// The file's name in the folder of the video.
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
        }
    }

    /// The file of the video `unit` under the work folder `work`.
    pub fn path(self, work: &Path, unit: &Unit) -> PathBuf {
        self.within(&dir(work, self.stage(), unit))
    }

    /// The file in `folder`, a stage's folder of one video.
    pub fn within(self, folder: &Path) -> PathBuf {
        folder.join(self.file())
    }
}

/// The folder of `unit` at `stage`: `work/<stage>/<speaker>/<video>`, for a whole speaker `work/<stage>/<speaker>`.
pub fn dir(work: &Path, stage: StageName, unit: &Unit) -> PathBuf {
    unit.dir(&work.join(stage.as_str()))
}

/// The folder of a speaker at `stage`; of the last stage it is the dataset.
pub fn speaker_dir(work: &Path, stage: StageName, speaker: &str) -> PathBuf {
    work.join(stage.as_str()).join(speaker)
}

/// The record of the splits of a speaker's videos, which outlives the dataset.
pub fn splits(work: &Path, speaker: &str) -> PathBuf {
    work.join("splits").join(format!("{speaker}.json"))
}

/// The picture of one face a video, where a speaker's videos seem to show several people.
pub fn faces(work: &Path, speaker: &str) -> PathBuf {
    work.join("faces").join(format!("{speaker}.png"))
}

/// The table of known hashes of a work folder.
pub fn hashes(work: &Path) -> PathBuf {
    work.join("hashes.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_is_found_by_its_name_and_by_its_former_name() {
        for stage in StageName::ALL {
            assert_eq!(stage.as_str().parse::<StageName>().unwrap(), stage);
        }
        assert_eq!("shard".parse::<StageName>().unwrap(), StageName::Dataset);
        assert!(
            "lit".parse::<StageName>().unwrap_err().to_string().contains("extract, pose2d, segment, lift, dataset")
        );
    }
}
