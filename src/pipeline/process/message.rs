//! What is said between a run and the process of a unit. A process that was taken over may send anything: lengths are
//! bounded.

use super::failure::SentFailure;
use anyhow::{Context, Result};
use orator_dataset::config::{KeypointSource, Settings};
use orator_media::sandbox::Restriction;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::ffi::OsString;
use std::io::{Read, Write};
use std::path::PathBuf;

/// Bytes of the longest message.
const MAX_BYTES: u64 = 16 << 20;

/// What the process is asked.
#[derive(Debug, Serialize, Deserialize)]
pub enum Request {
    /// To restrict itself and to say how far that went.
    Restrict,
    /// To work on a unit.
    Unit(Box<UnitRequest>),
    /// To read the header of a video, or to copy an excerpt of it.
    Media {
        wanted: MediaRequest,
        /// Most bytes of memory.
        memory: u64,
    },
}

/// What is wanted of a video before any stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MediaRequest {
    pub source: PathBuf,
    /// The excerpt to copy; without it the header is read.
    pub excerpt: Option<ExcerptRequest>,
}

/// An excerpt to copy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExcerptRequest {
    pub start_secs: f64,
    pub secs: f64,
    /// The file to write, in a folder that is there.
    pub to: PathBuf,
}

/// The header of a video as far as limits depend on it; of an excerpt, its length alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MediaHeader {
    /// Length in seconds, if stated.
    pub secs: Option<f64>,
    /// Width and height in px as coded; 0 without pictures.
    pub image_size: [usize; 2],
    /// Average frames a second, if stated.
    pub fps: Option<f64>,
}

/// A unit at a stage, with all that the stage is built of.
#[derive(Debug, Serialize, Deserialize)]
pub struct UnitRequest {
    /// Name of the stage.
    pub stage: String,
    pub speaker: String,
    pub video: String,
    pub source: OsString,
    /// The part to work on; none: the unit as a whole.
    pub part: Option<usize>,
    /// Settings with the unit's speaker alone.
    pub settings: Settings,
    /// The configuration file, which is not read.
    pub config_file: PathBuf,
    /// Where the unit is keypoints of another program.
    pub keypoints: Option<KeypointSource>,
    /// Files and folders that the stage reads.
    pub reads: Vec<OsString>,
    /// The empty folder that it writes into.
    pub out: OsString,
    /// Most bytes of memory.
    pub memory: u64,
}

/// What the process says. Tasks of its progress have numbers.
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
    Say {
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
    Failed(SentFailure),
}

/// Sends one message.
pub fn send(to: &mut impl Write, message: &impl Serialize) -> Result<()> {
    to.write_all(&rmp_serde::to_vec_named(message)?)?;
    Ok(to.flush()?)
}

/// Receives one message. Errors: the end, or something else than a message.
pub fn receive<T: DeserializeOwned>(from: &mut impl Read) -> Result<T> {
    rmp_serde::from_read(from.take(MAX_BYTES)).context("no message")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_keep_their_last_bit_and_names_their_bytes() {
        let facts = json!({ "a": 0.1 + 0.2, "b": 1.0, "c": 3, "d": null, "e": [-1, 1e300, 0.017_453_292_519_943_295] });
        let facts = facts.as_object().unwrap().clone();
        let settings = Settings::default();
        let source = {
            use std::os::unix::ffi::OsStringExt as _;
            OsString::from_vec(vec![b'a', 0xff])
        };
        let unit = UnitRequest {
            stage: "extract".into(),
            speaker: "host".into(),
            video: "a".into(),
            source: source.clone(),
            part: Some(3),
            settings: settings.clone(),
            config_file: "pipeline.toml".into(),
            keypoints: Some(KeypointSource { fps: None, image_size: Some([4, 3]), sound: Err("none".into()) }),
            reads: vec![source.clone()],
            out: "out".into(),
            memory: 1 << 40,
        };
        let mut pipe = Vec::new();
        send(&mut pipe, &Request::Unit(Box::new(unit))).unwrap();
        send(&mut pipe, &Message::Done { line: "l".into(), facts: facts.clone() }).unwrap();
        let mut pipe = pipe.as_slice();
        let Request::Unit(unit) = receive(&mut pipe).unwrap() else { panic!("another request") };
        assert_eq!((unit.settings, unit.source), (settings, source));
        let Message::Done { facts: back, .. } = receive(&mut pipe).unwrap() else { panic!("another message") };
        assert_eq!(serde_json::to_string(&back).unwrap(), serde_json::to_string(&facts).unwrap());
        assert!(receive::<Message>(&mut pipe).is_err());
    }
}
