//! Sample of a dataset: motion, keypoints, sound and metadata of an interval, and the encoding of its members.

use super::{pretty, words};
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use orator_base::types::pose2d::{N_BODY, N_HAND};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_formats::transcript::Word;
use orator_formats::{npy, wav};

/// Number of keypoints of a frame: 17 of the body, 21 of the left hand, 21 of the right hand.
pub const N_KEYPOINTS: usize = N_BODY + 2 * N_HAND;

/// Interval of continuous motion with its sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Key `<slug>-<8 hex of the video's content>-<first frame, 6 digits>`; [a-z0-9_-] only.
    pub key: String,
    /// Joints at the dataset rate.
    pub motion: Motion,
    /// Keypoints [T, 59, 3]: x px, y px, score.
    pub pose2d: Array3<f32>,
    /// Sound at 16 kHz mono, from the beginning of the first frame to the end of the last.
    pub sound: Sound,
    /// Words of the interval, with times from its start; `None`: no transcripts were requested.
    pub words: Option<Vec<Word>>,
    /// Angles of head and trunk; `None`: posture was not requested.
    pub posture: Option<Posture>,
    /// Sound of the person whom the speaker talks to, like `sound`; `None`: not recorded apart.
    pub interlocutor: Option<Sound>,
    /// Metadata: source and properties of the interval.
    pub meta: serde_json::Value,
}

/// Extensions of the required members, in the order of a shard.
pub const EXTENSIONS: [&str; 5] = ["json", "mask.npy", "pose2d.npy", "pose3d.npy", "wav"];
/// Extension of the member with the words.
pub const WORDS_EXTENSION: &str = "words.json";
/// Extensions of the optional members, after `EXTENSIONS` in a shard; `head.npy` and `trunk.npy` occur together.
pub const OPTIONAL_EXTENSIONS: [&str; 4] = [WORDS_EXTENSION, "head.npy", "trunk.npy", "interlocutor.wav"];

impl Sample {
    pub fn n_frames(&self) -> usize {
        self.motion.n_frames()
    }

    /// Encodes the members of `EXTENSIONS`.
    ///
    /// # Errors
    /// An invalid key, or shapes and lengths that contradict each other.
    pub fn members(&self) -> Result<[Vec<u8>; 5]> {
        let (key, n_frames) = (&self.key, self.n_frames());
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
        ensure!(
            !key.is_empty() && key.len() <= 80 && key.chars().all(plain),
            "invalid sample key `{key}`: expected 1 to 80 of a-z, 0-9, - and _"
        );
        ensure!(n_frames > 0, "{key}: the sample has no frames");
        ensure!(self.motion.joints.shape() == [n_frames, N_JOINTS, 3], "{key}: joints are not [T, 49, 3]");
        ensure!(self.motion.mask.shape() == [n_frames, N_JOINTS], "{key}: the mask is not [{n_frames}, 49]");
        ensure!(self.pose2d.shape() == [n_frames, N_KEYPOINTS, 3], "{key}: keypoints are not [{n_frames}, 59, 3]");
        let json = pretty(&self.meta).context("cannot encode the metadata of a sample as JSON")?;
        Ok([
            json,
            npy::write_bool(self.motion.mask.shape(), self.motion.mask.iter()),
            npy::write_f32(self.pose2d.shape(), self.pose2d.iter()),
            npy::write_f32(self.motion.joints.shape(), self.motion.joints.iter()),
            self.encoded(&self.sound)?,
        ])
    }

    /// Encodes the members of `OPTIONAL_EXTENSIONS` that the sample has.
    ///
    /// # Errors
    /// Words, angles or sound that contradict the length of the sample.
    pub fn optional_members(&self) -> Result<[Option<Vec<u8>>; 4]> {
        let n_frames = self.n_frames();
        let angles = |channel: PostureChannel| -> Result<Option<Vec<u8>>> {
            let Some(angles) = self.posture.as_ref().map(|posture| posture.channel(channel)) else { return Ok(None) };
            let (key, name) = (&self.key, channel.name());
            ensure!(angles.shape() == [n_frames, 3], "{key}: angles of the {name} are not [{n_frames}, 3]");
            Ok(Some(npy::write_f32(angles.shape(), angles.iter())))
        };
        let interlocutor = self.interlocutor.as_ref().map(|sound| self.encoded(sound)).transpose()?;
        Ok([self.words_member()?, angles(PostureChannel::Head)?, angles(PostureChannel::Trunk)?, interlocutor])
    }

    /// Encodes a sound that must have the sample's length.
    fn encoded(&self, sound: &Sound) -> Result<Vec<u8>> {
        let (key, n_frames) = (&self.key, self.n_frames());
        ensure!(sound.rate == SAMPLE_RATE, "{key}: audio at {} Hz, expected {SAMPLE_RATE} Hz", sound.rate);
        let expected = sample_at(self.motion.fps, SAMPLE_RATE, n_frames);
        ensure!(
            sound.samples.len().abs_diff(expected) <= 1,
            "{key}: {} audio samples for {n_frames} frames, expected {expected}",
            sound.samples.len()
        );
        wav::to_bytes(sound)
    }

    fn words_member(&self) -> Result<Option<Vec<u8>>> {
        let Some(words) = &self.words else { return Ok(None) };
        let secs = self.motion.fps.secs(self.n_frames());
        words::check(words, secs).with_context(|| self.key.clone())?;
        let mut json = serde_json::to_vec(words).context("cannot encode the words of a sample as JSON")?;
        json.push(b'\n');
        Ok(Some(json))
    }
}
