//! Lifter weights: built into the program, or from files written by `orator-lab train lifter`.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::motion::view::body::{N_BODY_IN, N_IN};
use orator_base::motion::view::hand::{HandJoints, HandPoints};
use orator_base::types::skeleton::Side;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::hand::{self, HandLifter};
use orator_nn::lifter::heatmap_network::{self, HeatmapLifter};
use orator_nn::lifter::temporal::Config;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Built-in weights; `models/body_lifter.md` documents their training.
pub const BODY: &[u8] = include_bytes!("../../../models/body_lifter.safetensors");
pub const HANDS: &[u8] = include_bytes!("../../../models/hand_lifter.safetensors");
/// Largest accepted layer width; the published networks have 1024 channels.
const MAX_WIDTH: usize = 2048;
/// Longest accepted receptive field in frames; the published networks have up to 243.
pub const MAX_FRAMES: usize = 729;

/// Loads the body lifter from a file, or the built-in one if `path` is empty.
///
/// # Errors
/// A file that cannot be read or does not contain a body lifter within the limits.
pub fn body(path: &Path) -> Result<BodyLifter> {
    load(path, BODY, &["body-lifter"], "body", |contents, params| {
        let config: Config = config(contents)?;
        let n_in = if config.n_in == N_BODY_IN { N_BODY_IN } else { N_IN };
        let expected = Config { n_in, ..BodyLifter::config(config.channels.clamp(1, MAX_WIDTH), &config.widths) };
        let window = config.receptive_field();
        ensure!(
            (1..=MAX_FRAMES).contains(&window),
            "its network has a receptive field of {window} frames, expected 1 to {MAX_FRAMES}"
        );
        ensure!(config == expected, "its network is {config:?}, expected {expected:?}");
        let (channels, blocks) = (config.channels, config.widths.len().saturating_sub(1));
        let first = config.n_in * channels * config.widths.first().copied().unwrap_or(1);
        contents.expect_numbers(first.saturating_add(blocks.saturating_mul(channels * channels)))?;
        Ok(BodyLifter::new(params, &config)?)
    })
}

/// Hand lifter of either kind.
pub enum HandNetwork {
    Coordinates(HandLifter),
    Heatmap(HeatmapLifter),
}

impl HandNetwork {
    /// Lifts hands of the given side: wrist at 0, picture axes, any unit; `None` where too few points are visible.
    ///
    /// # Errors
    /// Those of the network.
    pub fn lift(&self, seen: &[HandPoints], side: Side) -> Result<Vec<Option<HandJoints>>> {
        Ok(match self {
            Self::Coordinates(lifter) => lifter.lift(seen, side)?,
            Self::Heatmap(lifter) => lifter.lift(seen, side)?,
        })
    }
}

/// Loads the hand lifter from a file, whose metadata names its kind, or the built-in one if `path` is empty.
///
/// # Errors
/// A file that cannot be read or does not contain a hand lifter within the limits.
pub fn hands(path: &Path) -> Result<HandNetwork> {
    load(path, HANDS, &[hand::KIND, heatmap_network::KIND], "hands", |contents, params| {
        if contents.facts["kind"] == heatmap_network::KIND {
            contents.expect_numbers(heatmap_network::N_PARAMETERS)?;
            return Ok(HandNetwork::Heatmap(HeatmapLifter::new(params, heatmap_network::NAME)?));
        }
        let config: hand::Config = config(contents)?;
        let expected = hand::Config { hidden: config.hidden.clamp(1, MAX_WIDTH), ..hand::Config::default() };
        ensure!(config == expected, "its network is {config:?}, expected {expected:?}");
        contents.expect_numbers(config.hidden * config.hidden)?;
        Ok(HandNetwork::Coordinates(HandLifter::new(params, hand::NAME, &config)?))
    })
}

fn load<T>(
    path: &Path,
    builtin: &[u8],
    kinds: &[&str],
    part: &str,
    make: impl Fn(&Contents, &mut Params) -> Result<T>,
) -> Result<T> {
    if path.as_os_str().is_empty() {
        return parse(builtin, kinds, make).with_context(|| format!("invalid built-in weights of the {part} lifter"));
    }
    let bytes =
        input::read(path, input::MAX_DATA).with_context(|| format!("cannot read the weights {}", path.display()))?;
    parse(&bytes, kinds, make).with_context(|| {
        let kinds = kinds.join(" or ");
        format!("{} is not a {kinds}: expected weights of `orator-lab train lifter --part {part}`", path.display())
    })
}

fn parse<T>(bytes: &[u8], kinds: &[&str], make: impl Fn(&Contents, &mut Params) -> Result<T>) -> Result<T> {
    let contents = Contents::from_bytes(bytes)?;
    let found = &contents.facts["kind"];
    ensure!(kinds.iter().any(|kind| found == kind), "it is of kind {found}, expected {}", kinds.join(" or "));
    let mut params = Params::frozen();
    let net = make(&contents, &mut params)?;
    params.load(&contents.tensors)?;
    Ok(net)
}

fn config<T: DeserializeOwned>(contents: &Contents) -> Result<T> {
    Ok(serde_json::from_value(contents.facts["lesson"]["config"].clone())?)
}
