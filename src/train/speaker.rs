//! What a checkpoint of the generator means: the facts that make a new sound into motion, and the network itself.

use super::checkpoint::Contents;
use super::poses::{N_NUMBERS, Normalisation};
use crate::audio::mel;
use crate::nn::params::Params;
use crate::nn::unet::{Config, Generator};
use crate::types::sound::SAMPLE_RATE;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Tensors of the generator in a checkpoint begin with this.
pub const GENERATOR: &str = "generator.";
/// Name and version of the layout; another is refused.
const KIND: &str = "orator speaker 1";
const SKELETON: &str = "49 joints, house order";

/// Everything beside the tensors that generation needs. Stored under `speaker` in a checkpoint's facts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Facts {
    pub kind: String,
    /// The speaker's name.
    pub name: String,
    pub fps: FrameRate,
    pub skeleton: String,
    pub network: Config,
    pub audio: Audio,
    pub normalisation: Normalisation,
}

/// How the spectrogram was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audio {
    pub rate: u32,
    pub window: usize,
    pub hop: usize,
    pub fft: usize,
    pub n_mels: usize,
    pub lowest_hz: f64,
    pub highest_hz: f64,
}

impl Audio {
    /// This program's.
    pub fn present() -> Self {
        Self {
            rate: SAMPLE_RATE,
            window: mel::WINDOW,
            hop: mel::HOP,
            fft: mel::FFT,
            n_mels: mel::N_MELS,
            lowest_hz: mel::LOWEST_HZ,
            highest_hz: mel::HIGHEST_HZ,
        }
    }
}

impl Facts {
    pub fn new(name: &str, fps: FrameRate, network: Config, normalisation: Normalisation) -> Self {
        Self {
            kind: KIND.to_owned(),
            name: name.to_owned(),
            fps,
            skeleton: SKELETON.to_owned(),
            network,
            audio: Audio::present(),
            normalisation,
        }
    }
}

/// A trained generator, ready to use.
pub struct TrainedSpeaker {
    pub facts: Facts,
    pub generator: Generator,
}

/// Reads a checkpoint of `orator train gan`. Errors name the file and what is wrong with it.
pub fn load(path: &Path) -> Result<TrainedSpeaker> {
    let contents = Contents::read(path)?;
    build(&contents).with_context(|| format!("{} is no checkpoint of `orator train gan`", path.display()))
}

fn build(contents: &Contents) -> Result<TrainedSpeaker> {
    let kind = &contents.facts["speaker"]["kind"];
    ensure!(kind == KIND, "its kind is {kind}, this program reads {KIND:?}");
    let facts: Facts = serde_json::from_value(contents.facts["speaker"].clone()).context("its facts are incomplete")?;
    ensure!(facts.skeleton == SKELETON, "its skeleton is {:?}, expected {SKELETON:?}", facts.skeleton);
    ensure!(facts.audio == Audio::present(), "its audio settings are others than this program's: {:?}", facts.audio);
    ensure!(facts.network.n_out == N_NUMBERS, "it makes {} numbers a pose, not {N_NUMBERS}", facts.network.n_out);
    facts.normalisation.check()?;
    let mut params = Params::frozen();
    let generator = Generator::new(&mut params, &facts.network)?;
    params.load(&contents.part(GENERATOR))?;
    Ok(TrainedSpeaker { facts, generator })
}
