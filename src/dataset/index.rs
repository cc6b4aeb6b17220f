//! Index file `index.jsonl`: a line for each sample with its location in a shard and its BLAKE3 hash, for random access
//! and checks. Shards are listed in `info.json`.

use orator_base::types::file_name::FileName;
use orator_base::types::split::Split;
use orator_formats::wav;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Most samples or frames that a record may speak of: years of motion, and sums of them fit into any integer here.
const MOST: usize = u32::MAX as usize;

/// Reads a number of samples or frames.
///
/// # Errors
///
/// Where it is more than any dataset has, so that the record is damaged.
pub fn count<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    let count = usize::deserialize(from)?;
    if count > MOST {
        return Err(D::Error::custom(format!("{count} samples or frames, {MOST} at most: the file is damaged")));
    }
    Ok(count)
}

/// Tar file of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardRef {
    /// Name in the dataset's folder.
    pub file: FileName,
    /// Size.
    pub bytes: u64,
    /// Samples in it.
    #[serde(deserialize_with = "count")]
    pub n_samples: usize,
    /// Hash of its content, in hex.
    pub blake3: String,
}

/// Sample with its members; offsets count from the beginning of the shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampleRef {
    /// Name, once in the dataset.
    pub key: FileName,
    /// The part it belongs to.
    pub split: Split,
    /// File name of the shard.
    pub shard: FileName,
    /// Start of the sample with its tar headers, a valid tar stream by itself.
    pub offset: u64,
    /// Bytes from `offset` on.
    pub size: u64,
    /// Frames of motion.
    #[serde(deserialize_with = "count")]
    pub n_frames: usize,
    /// Hash of the `size` bytes at `offset`.
    pub blake3: String,
    /// Where it comes from.
    pub json: ByteRange,
    /// Which joints were seen.
    pub mask: ByteRange,
    /// Keypoints.
    pub pose2d: ByteRange,
    /// Joints.
    pub pose3d: ByteRange,
    /// Sound.
    pub wav: ByteRange,
    /// Words; `None`: no transcript was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<ByteRange>,
    /// Angles of the head; `None`: they were not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub head: Option<ByteRange>,
    /// Angles of the trunk, where there are those of the head.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trunk: Option<ByteRange>,
}

/// Range of bytes in a shard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByteRange {
    /// The first byte.
    pub offset: u64,
    /// Number of bytes.
    pub size: u64,
}

impl SampleRef {
    /// Samples of sound.
    pub fn n_sound_samples(&self) -> usize {
        (self.wav.size.saturating_sub(wav::HEADER_BYTES as u64) / 2) as usize
    }

    /// Whether every member lies inside the sample, and the sample inside its shard.
    pub fn fits(&self, shard_bytes: u64) -> bool {
        let end = |offset: u64, size: u64| offset.checked_add(size);
        let Some(sample_end) = end(self.offset, self.size) else { return false };
        let members = [self.json, self.mask, self.pose2d, self.pose3d, self.wav];
        sample_end <= shard_bytes
            && members
                .iter()
                .chain([&self.words, &self.head, &self.trunk].into_iter().flatten())
                .all(|m| m.offset >= self.offset && end(m.offset, m.size).is_some_and(|e| e <= sample_end))
    }
}
