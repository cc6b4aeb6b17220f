//! BVH reader for any hierarchy and any number and order of channels, with the positions of all joints in a frame.
//! `mocap` maps the joints to our skeleton.

use super::skeleton::{JointChannels, joint_positions};
use super::words::{Words, number};
use super::{frame_time, motion_lines};
use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use orator_base::math::vec3::Vec3;
use orator_base::text::counted;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Contents of a BVH file, in its own units and axes.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Joints in file order; an `End Site` is named after its parent, with the suffix `_end`.
    pub joints: Vec<JointChannels>,
    /// Time between consecutive frames, seconds.
    pub frame_secs: f64,
    pub n_frames: usize,
    /// What was assumed or left out when reading the file, one sentence each.
    pub notes: Vec<String>,
    /// Channel values [n_frames * n_channels], in joint order within a frame.
    pub(super) values: Vec<f64>,
    pub(super) n_channels: usize,
}

/// A degree of freedom of a joint; axis 0 is x, 1 is y, 2 is z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Channel {
    /// Translation along an axis, in the file's unit.
    Position(usize),
    /// Rotation about an axis, degrees.
    Rotation(usize),
}
/// Meaning of a joint's position channels: the format does not define it, and both conventions occur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// Values are added to OFFSET (the original specification; CMU files).
    Add,
    /// Values replace OFFSET (Bandai-Namco files).
    Replace,
    /// `Replace` if the position channels of the joints below the root are closer to their OFFSET than to zero (added
    /// values would be near zero), otherwise `Add`.
    Auto,
}

/// Maximum number of positions (frames times joints): the larger of a fixed limit and a limit per byte of the file. A
/// moving joint takes at least six bytes per frame.
const MIN_POSITION_LIMIT: usize = 1 << 20;
const MAX_POSITIONS_PER_BYTE: usize = 4;
/// Maximum number of joints including end sites; rigs with hair, cloth and twist bones have several hundred.
pub const MAX_JOINTS: usize = 10_000;
/// Maximum nesting depth, and maximum length of a name: an end site repeats the name of its parent.
pub const MAX_DEPTH: usize = 512;
const MAX_NAME_BYTES: usize = 1024;

impl Bvh {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// The file is unreadable or not BVH; the message names the line and what was expected.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MAX_DATA).with_context(|| format!("cannot read {}", path.display()))?;
        Self::from_bytes(&bytes).with_context(|| format!("{} is not a valid BVH file", path.display()))
    }

    /// Parses the bytes of a file: UTF-8 with or without byte order mark, or another encoding that extends ASCII, of
    /// which only joint names and comments are affected.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if let Ok(text) = std::str::from_utf8(bytes) {
            return Self::parse(text);
        }
        let mut bvh = Self::parse(&bytes.iter().map(|&byte| distinct_char(byte)).collect::<String>())?;
        bvh.notes.push("the text is not UTF-8: joint names are read as Latin-1".to_owned());
        Ok(bvh)
    }

    pub fn parse(text: &str) -> Result<Self> {
        let mut words = Words::new(text);
        let parsed = Self::from_words(&mut words);
        let bvh = parsed.with_context(|| format!("line {}", words.line))?;
        // The positions of all joints are held in memory, so their number is limited by the size of the file.
        let n_positions = bvh.n_frames * bvh.joints.len();
        ensure!(
            n_positions <= MIN_POSITION_LIMIT.max(MAX_POSITIONS_PER_BYTE * text.len()),
            "{} frames of {} joints with only {}: too many positions for the size of the file",
            bvh.n_frames,
            bvh.joints.len(),
            counted(bvh.n_channels, "channel")
        );
        Ok(bvh)
    }

    fn from_words(words: &mut Words) -> Result<Self> {
        words.expect("HIERARCHY")?;
        words.expect("ROOT")?;
        let mut joints: Vec<JointChannels> = Vec::new();
        let mut n_channels = 0;
        let mut open: Vec<usize> = Vec::new();
        push(&mut joints, &mut open, words.next("the root's name")?.to_owned(), words)?;
        while let Some(&current) = open.last() {
            match words.next("the rest of the hierarchy")? {
                "OFFSET" => joints[current].offset = [words.number()?, words.number()?, words.number()?],
                "CHANNELS" => {
                    let is_first = current + 1 == joints.len() && joints[current].channels.is_empty();
                    ensure!(
                        is_first,
                        "joint {}: expected CHANNELS once, before the child joints",
                        joints[current].name
                    );
                    let count = words.number()?;
                    ensure!(
                        (0.0..=6.0).contains(&count),
                        "joint {}: {count} channels, expected 0 to 6",
                        joints[current].name
                    );
                    joints[current].channels =
                        (0..count as usize).map(|_| channel(words.next("a channel")?)).collect::<Result<_>>()?;
                    n_channels += joints[current].channels.len();
                }
                "JOINT" => push(&mut joints, &mut open, words.next("a joint's name")?.to_owned(), words)?,
                "End" => {
                    words.expect("Site")?;
                    let name = format!("{}_end", joints[current].name);
                    push(&mut joints, &mut open, name, words)?;
                }
                "}" => drop(open.pop()),
                other => bail!("unexpected `{other}` in joint {}", joints[current].name),
            }
        }
        words.expect("MOTION")?;
        words.expect("Frames:")?;
        let (n_declared, frames_line) = (words.number()?, words.line);
        ensure!(
            n_declared >= 0.0 && n_declared.fract() == 0.0 && n_declared < 1e8,
            "invalid number of frames {n_declared}: expected 0 to 99999999"
        );
        ensure!(n_declared == 0.0 || n_channels > 0, "{n_declared} frames without channels");
        words.expect("Frame")?;
        words.expect("Time:")?;
        let written = words.next("a number")?;
        let mut frame_secs = number(written)?;
        // The bounds allow for the rounding of frame times.
        ensure!(
            (0.000_99..=1.01).contains(&frame_secs),
            "invalid frame time {frame_secs:?} s: expected 0.001 to 1 (1000 to 1 fps)"
        );
        let mut notes = Vec::new();
        if let Some(rate) = frame_time::rounded_rate(written, frame_secs) {
            notes.push(format!(
                "the frame time {written} is rounded: read as {rate} (as written {:.2} fps)",
                1.0 / frame_secs
            ));
            frame_secs = 1.0 / rate.per_sec();
        }
        let values = motion_lines::read(words, (n_declared as usize, frames_line), n_channels, &mut notes)?;
        let n_frames = values.len().checked_div(n_channels).unwrap_or(0);
        Ok(Self { joints, frame_secs, n_frames, notes, values, n_channels })
    }

    /// Index of the joint with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }

    /// Resolves `Auto` to `Add` or `Replace` by the rule documented there.
    pub fn resolve(&self, positions: Positions) -> Positions {
        if positions != Positions::Auto {
            return positions;
        }
        let (mut to_offset, mut to_zero) = (0.0, 0.0);
        for frame in self.frames().take(100) {
            let channels =
                self.joints.iter().flat_map(|joint| joint.channels.iter().map(move |channel| (joint, channel)));
            for ((joint, channel), value) in channels.zip(frame).filter(|((joint, _), _)| joint.parent.is_some()) {
                if let Channel::Position(axis) = *channel {
                    to_offset += (value - joint.offset[axis]).abs();
                    to_zero += value.abs();
                }
            }
        }
        if to_offset < to_zero { Positions::Replace } else { Positions::Add }
    }

    /// Positions of all joints in every frame, in the file's units and axes.
    pub fn positions(&self, positions: Positions) -> Vec<Vec<Vec3>> {
        let positions = self.resolve(positions);
        self.frames().map(|frame| joint_positions(&self.joints, frame, positions)).collect()
    }

    /// Channel values of each frame, in joint order.
    pub fn frames(&self) -> impl Iterator<Item = &[f64]> {
        (0..self.n_frames).map(|t| &self.values[t * self.n_channels..(t + 1) * self.n_channels])
    }
}

/// Adds a joint as a child of the innermost open joint and opens it.
fn push(joints: &mut Vec<JointChannels>, open: &mut Vec<usize>, name: String, words: &mut Words) -> Result<()> {
    ensure!(joints.len() < MAX_JOINTS, "more than {MAX_JOINTS} joints: expected the skeleton of one figure");
    ensure!(open.len() < MAX_DEPTH, "the joints are nested deeper than {MAX_DEPTH} levels");
    ensure!(
        name.len() <= MAX_NAME_BYTES,
        "joint {}: the name has {} bytes, expected {MAX_NAME_BYTES} or fewer",
        joints.len() + 1,
        name.len()
    );
    words.expect("{")?;
    joints.push(JointChannels { name, parent: open.last().copied(), offset: [0.0; 3], channels: Vec::new() });
    open.push(joints.len() - 1);
    Ok(())
}

fn channel(word: &str) -> Result<Channel> {
    Ok(match word.to_ascii_lowercase().as_str() {
        "xposition" => Channel::Position(0),
        "yposition" => Channel::Position(1),
        "zposition" => Channel::Position(2),
        "xrotation" => Channel::Rotation(0),
        "yrotation" => Channel::Rotation(1),
        "zrotation" => Channel::Rotation(2),
        _ => bail!("unknown channel `{word}`"),
    })
}

/// Latin-1 character of a byte; the control characters and spaces 0x80 to 0xa0 become letters instead, so that names
/// that differ as bytes differ as text and no name contains a space.
fn distinct_char(byte: u8) -> char {
    match byte {
        0x80..=0xa0 => char::from_u32(0x100 + u32::from(byte)).unwrap_or(char::REPLACEMENT_CHARACTER),
        _ => char::from(byte),
    }
}
