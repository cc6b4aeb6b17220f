//! Messages between a run and a subprocess. A compromised process may send anything, so message lengths are bounded.

use super::failure::SentFailure;
use anyhow::{Context, Result, ensure};
use orator_dataset::config::{KeypointSource, Settings};
use orator_dataset::decisions::Decision;
use orator_media::sandbox::Restriction;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::ffi::OsString;
use std::io::{Read, Write};
use std::path::PathBuf;

/// Largest message, bytes.
const MAX_BYTES: u64 = 16 << 20;

#[derive(Debug, Serialize, Deserialize)]
pub enum Request {
    /// Enter the sandbox and report how far it applies.
    Restrict,
    /// Process a unit.
    Unit(Box<UnitRequest>),
    /// Read the header of a video.
    Media {
        source: PathBuf,
        /// Memory limit, bytes.
        memory: u64,
    },
}

/// Fields of a video header that the limits depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MediaHeader {
    /// Duration in seconds, if stated.
    pub secs: Option<f64>,
    /// Coded width and height in px; 0 without a video stream.
    pub image_size: [usize; 2],
    /// Average frame rate, if stated.
    pub fps: Option<f64>,
}

/// A unit to process, with everything that is needed to build the stage.
#[derive(Debug, Serialize, Deserialize)]
pub struct UnitRequest {
    pub stage: String,
    pub speaker: String,
    pub video: String,
    pub source: OsString,
    /// Part to process; `None`: the complete unit.
    pub part: Option<usize>,
    /// Settings, reduced to the speaker of the unit.
    pub settings: Settings,
    /// Path of the configuration file, which the subprocess does not read.
    pub config_file: PathBuf,
    /// Set if the unit consists of keypoints of another program.
    pub keypoints: Option<KeypointSource>,
    /// Decisions of users on the unit.
    pub decisions: Vec<Decision>,
    /// Files and folders that the stage may read.
    pub reads: Vec<OsString>,
    /// Empty output folder.
    pub out: OsString,
    /// Memory limit, bytes.
    pub memory: u64,
}

/// Message from a subprocess. Progress tasks are numbered.
#[derive(Debug, Serialize, Deserialize)]
pub enum Message {
    Restricted(Restriction),
    Begin {
        task: u32,
        total: u64,
    },
    Advance {
        task: u32,
        steps: u64,
    },
    Detail {
        task: u32,
        text: String,
    },
    End {
        task: u32,
    },
    Line {
        line: String,
    },
    Estimate {
        line: String,
    },
    Done {
        line: String,
        facts: Map<String, Value>,
    },
    /// Answer to `Request::Media`.
    Media(MediaHeader),
    /// Asks for the values of all outputs of a shared model; those of its input follow, see `send_floats`.
    Inference {
        model: String,
    },
    Failed(SentFailure),
}

/// Sends numbers as their count and bytes.
pub fn send_floats(to: &mut impl Write, numbers: &[f32]) -> Result<()> {
    send(to, &numbers.len())?;
    let mut bytes = vec![[0; 4]; numbers.len()];
    bytes.iter_mut().zip(numbers).for_each(|(bytes, number)| *bytes = number.to_le_bytes());
    to.write_all(bytes.as_flattened())?;
    Ok(to.flush()?)
}

/// Receives numbers.
///
/// # Errors
/// Those of `receive`; more than 16 MiB.
pub fn receive_floats(from: &mut impl Read) -> Result<Vec<f32>> {
    let n: usize = receive(from)?;
    ensure!(n as u64 <= MAX_BYTES / 4, "{n} numbers in a message");
    let mut bytes = vec![[0; 4]; n];
    from.read_exact(bytes.as_flattened_mut())?;
    Ok(bytes.into_iter().map(f32::from_le_bytes).collect())
}

pub fn send(to: &mut impl Write, message: &impl Serialize) -> Result<()> {
    to.write_all(&rmp_serde::to_vec_named(message)?)?;
    Ok(to.flush()?)
}

/// Receives one message.
///
/// # Errors
/// End of the stream; data that is not a valid message.
pub fn receive<T: DeserializeOwned>(from: &mut impl Read) -> Result<T> {
    rmp_serde::from_read(from.take(MAX_BYTES)).context("invalid message")
}
