//! The lifters' weights: built into the program, or from files of `orator-lab train lifter`.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::hand::{self, HandLifter};
use orator_nn::lifter::temporal;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The built-in weights; `models/body_lifter.md` says how they were made.
pub const BODY: &[u8] = include_bytes!("../../../models/body_lifter.safetensors");
pub const HANDS: &[u8] = include_bytes!("../../../models/hand_lifter.safetensors");
/// Widest layer that is believed; the published ones have 1024 channels.
const MOST_WIDTH: usize = 2048;
/// Longest window that is believed, in frames; the published ones have up to 243.
pub const MOST_FRAMES: usize = 729;

/// The body lifter of a file, or the built-in one where `path` is empty.
pub fn body(path: &Path) -> Result<BodyLifter> {
    load(path, BODY, "body-lifter", "body", |contents, params| {
        let config: temporal::Config = config(contents)?;
        let own = BodyLifter::config(config.channels.clamp(1, MOST_WIDTH), &config.widths);
        let window = config.receptive_field();
        ensure!(
            (1..=MOST_FRAMES).contains(&window),
            "its network looks at {window} frames, expected 1 to {MOST_FRAMES}"
        );
        ensure!(config == own, "its network is {config:?}, expected {own:?}");
        let (channels, blocks) = (config.channels, config.widths.len().saturating_sub(1));
        let first = config.n_in * channels * config.widths.first().copied().unwrap_or(1);
        contents.expect_numbers(first.saturating_add(blocks.saturating_mul(channels * channels)))?;
        Ok(BodyLifter::new(params, &config)?)
    })
}

/// The hand lifter of a file, or the built-in one where `path` is empty.
pub fn hands(path: &Path) -> Result<HandLifter> {
    load(path, HANDS, "hand-lifter", "hands", |contents, params| {
        let config: hand::Config = config(contents)?;
        let own = hand::Config { hidden: config.hidden.clamp(1, MOST_WIDTH), ..hand::Config::default() };
        ensure!(config == own, "its network is {config:?}, expected {own:?}");
        contents.expect_numbers(config.hidden * config.hidden)?;
        Ok(HandLifter::new(params, hand::NAME, &config)?)
    })
}

fn load<T>(
    path: &Path,
    builtin: &[u8],
    kind: &str,
    part: &str,
    make: impl Fn(&Contents, &mut Params) -> Result<T>,
) -> Result<T> {
    if path.as_os_str().is_empty() {
        return parse(builtin, kind, make).with_context(|| format!("the built-in {kind} does not fit this program"));
    }
    let bytes =
        input::read(path, input::MOST_DATA).with_context(|| format!("cannot read the weights {}", path.display()))?;
    parse(&bytes, kind, make)
        .with_context(|| format!("{} does not hold weights of `orator-lab train lifter --part {part}`", path.display()))
}

fn parse<T>(bytes: &[u8], kind: &str, make: impl Fn(&Contents, &mut Params) -> Result<T>) -> Result<T> {
    let contents = Contents::from_bytes(bytes)?;
    let found = &contents.facts["kind"];
    ensure!(found == kind, "it is of kind {found}, expected {kind}");
    let mut params = Params::frozen();
    let net = make(&contents, &mut params)?;
    params.load(&contents.tensors)?;
    Ok(net)
}

fn config<T: DeserializeOwned>(contents: &Contents) -> Result<T> {
    Ok(serde_json::from_value(contents.facts["lesson"]["config"].clone())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_weights_fit_and_are_small() {
        body(Path::new("")).unwrap();
        hands(Path::new("")).unwrap();
        assert!(BODY.len() + HANDS.len() <= 6_000_000);
    }

    #[test]
    fn a_wrong_file_says_what_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("w.safetensors");
        std::fs::write(&path, HANDS).unwrap();
        hands(&path).unwrap();
        let says = |path: &Path| format!("{:#}", body(path).err().unwrap());
        assert!(says(&path).contains("hand-lifter") && says(&path).contains("w.safetensors"), "{}", says(&path));
        std::fs::write(&path, &HANDS[..HANDS.len() / 2]).unwrap();
        assert!(says(&path).contains("w.safetensors"));
        std::fs::write(&path, b"text").unwrap();
        assert!(says(&path).contains("w.safetensors"));
        assert!(says(&dir.path().join("none")).contains("cannot read"));
    }
}
