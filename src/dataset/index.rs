//! Index file `index.jsonl`: one line per sample with its location in a shard and its BLAKE3 hash, for random access
//! and verification. The shards are listed in `info.json`.

use orator_base::types::file_name::FileName;
use orator_base::types::split::Split;
use orator_formats::wav;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Largest accepted number of samples or frames: years of motion, and sums of such numbers do not overflow.
const MAX_COUNT: usize = u32::MAX as usize;

/// Deserialises a number of samples or frames.
///
/// # Errors
/// A number above `MAX_COUNT`, which shows that the file is damaged.
pub fn count<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    let count = usize::deserialize(from)?;
    if count > MAX_COUNT {
        return Err(D::Error::custom(format!(
            "{count} samples or frames, expected at most {MAX_COUNT}: the file is damaged"
        )));
    }
    Ok(count)
}

/// Tar shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardRef {
    /// File name in the dataset folder.
    pub file: FileName,
    /// Size of the file, bytes.
    pub bytes: u64,
    #[serde(deserialize_with = "count")]
    pub n_samples: usize,
    /// BLAKE3 of the file, hexadecimal.
    pub blake3: String,
}

/// Location of a sample and its members; offsets count from the beginning of the shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampleRef {
    /// Name, unique in the dataset.
    pub key: FileName,
    pub split: Split,
    pub shard: FileName,
    /// Start of the sample including its tar headers; the bytes from here on form a valid tar stream.
    pub offset: u64,
    /// Number of bytes of the sample from `offset` on.
    pub size: u64,
    #[serde(deserialize_with = "count")]
    pub n_frames: usize,
    /// BLAKE3 of the `size` bytes at `offset`, hexadecimal.
    pub blake3: String,
    /// Metadata of the interval (`json`).
    pub json: ByteRange,
    /// Visibility mask of the joints (`mask.npy`).
    pub mask: ByteRange,
    /// 2D keypoints (`pose2d.npy`).
    pub pose2d: ByteRange,
    /// 3D joints (`pose3d.npy`).
    pub pose3d: ByteRange,
    /// Sound (`wav`).
    pub wav: ByteRange,
    /// Words (`words.json`); `None`: no transcripts were requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<ByteRange>,
    /// Head angles (`head.npy`); `None`: posture was not requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub head: Option<ByteRange>,
    /// Trunk angles (`trunk.npy`); present if and only if `head` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trunk: Option<ByteRange>,
    /// Sound of the interlocutor (`interlocutor.wav`); `None`: not recorded apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interlocutor: Option<ByteRange>,
}

/// Range of bytes in a shard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByteRange {
    /// Position of the first byte.
    pub offset: u64,
    /// Number of bytes.
    pub size: u64,
}

impl SampleRef {
    /// Number of audio samples, from the size of the 16-bit mono wav.
    pub fn n_sound_samples(&self) -> usize {
        (self.wav.size.saturating_sub(wav::HEADER_BYTES as u64) / 2) as usize
    }

    /// Whether all members are inside the sample, and the sample is inside a shard of `shard_bytes`.
    pub fn fits(&self, shard_bytes: u64) -> bool {
        let end = |offset: u64, size: u64| offset.checked_add(size);
        let Some(sample_end) = end(self.offset, self.size) else { return false };
        let members = [self.json, self.mask, self.pose2d, self.pose3d, self.wav];
        sample_end <= shard_bytes
            && members
                .iter()
                .chain([self.words, self.head, self.trunk, self.interlocutor].iter().flatten())
                .all(|m| m.offset >= self.offset && end(m.offset, m.size).is_some_and(|e| e <= sample_end))
    }
}
