//! The two files of an ncnn model: one line of text per layer, and the concatenated weights.

use super::graph::ElementType;
use anyhow::{Context, Result, bail, ensure};
use orator_base::text::counted;
use std::collections::BTreeMap;

/// First line of the text.
const MAGIC: &str = "7767517";
const MAX_LAYERS: usize = 1 << 14;
/// Tag before float16 weights.
const FLOAT16: u32 = 0x0130_6b47;

/// A layer, from one line of the text.
#[derive(Debug)]
pub(crate) struct NcnnLayer<'a> {
    pub kind: &'a str,
    pub name: &'a str,
    pub inputs: Vec<&'a str>,
    pub outputs: Vec<&'a str>,
    /// Numbers by key; a list has several.
    parameters: BTreeMap<i32, Vec<f64>>,
}

impl NcnnLayer<'_> {
    /// An integer parameter; `absent` if absent. Errors: the value is a list or a fraction.
    pub(crate) fn int(&self, key: i32, absent: i64) -> Result<i64> {
        let Some(numbers) = self.parameters.get(&key) else { return Ok(absent) };
        match numbers.as_slice() {
            [number] if number.fract() == 0.0 && number.abs() < 1e15 => Ok(*number as i64),
            _ => bail!("parameter {key} must be an integer, not {numbers:?}"),
        }
    }

    /// Numbers of a list parameter; empty if absent.
    pub(crate) fn list(&self, key: i32) -> &[f64] {
        self.parameters.get(&key).map_or(&[], Vec::as_slice)
    }

    /// Checks that all parameters are supported. Errors: a parameter is not in `keys`.
    pub(crate) fn check_keys(&self, keys: &[i32]) -> Result<()> {
        match self.parameters.keys().find(|key| !keys.contains(key)) {
            Some(key) => bail!("unsupported parameter {key} = {:?}", self.list(*key)),
            None => Ok(()),
        }
    }
}

/// Layers of a `.param` file in execution order. Errors: a wrong first line, or a line is not a layer, with its number.
pub(crate) fn layers(file: &[u8]) -> Result<Vec<NcnnLayer<'_>>> {
    let text = std::str::from_utf8(file).context("the .param file is not UTF-8 text")?;
    let mut lines = text.lines().enumerate();
    ensure!(
        lines.next().is_some_and(|(_, line)| line.trim() == MAGIC),
        "line 1 of the .param file: expected {MAGIC}; list the files in the order .param, .bin"
    );
    let counts = lines.next().map(|(_, line)| line.split_whitespace().map(str::parse).collect::<Vec<_>>());
    let Some([Ok(n_layers), Ok(_)]) = counts.as_deref() else {
        bail!("{}: expected the numbers of layers and blobs", line_position(1))
    };
    let n_layers: usize = *n_layers;
    let written = lines.filter(|(_, line)| !line.trim().is_empty());
    let layers = written.take(MAX_LAYERS + 1).map(|(k, line)| layer(line).with_context(|| line_position(k)));
    let layers = layers.collect::<Result<Vec<_>>>()?;
    ensure!(
        layers.len() == n_layers && n_layers <= MAX_LAYERS,
        "the .param file has {} layers, expected {n_layers} according to line 2 and at most {MAX_LAYERS}",
        layers.len()
    );
    Ok(layers)
}

fn line_position(line: usize) -> String {
    format!("line {} of the .param file", line + 1)
}

fn layer(line: &str) -> Result<NcnnLayer<'_>> {
    let mut words = line.split_whitespace();
    let mut word = |what: &str| words.next().with_context(|| format!("the line ends before {what}"));
    let (kind, name) = (word("the layer type")?, word("the name")?);
    let invalid = |word: &str| format!("invalid number of blobs {word:?}: expected 0 to 64");
    let count = |word: &str| word.parse().ok().filter(|n| *n <= 64).with_context(|| invalid(word));
    let (n_inputs, n_outputs): (usize, usize) =
        (count(word("the number of inputs")?)?, count(word("the number of outputs")?)?);
    let inputs = (0..n_inputs).map(|_| word("an input")).collect::<Result<_>>()?;
    let outputs = (0..n_outputs).map(|_| word("an output")).collect::<Result<_>>()?;
    let mut parameters = BTreeMap::new();
    for word in words {
        let number = |number: &str| number.parse::<f64>().ok().filter(|number| number.is_finite());
        let parameter = word.split_once('=').and_then(|(key, value)| {
            let (key, numbers) = (key.parse::<i32>().ok()?, value.split(',').map(number).collect::<Option<Vec<_>>>()?);
            // A list has the key -23300 - k and starts with its length.
            match (key, numbers.as_slice()) {
                (0..=64, [_]) => Some((key, numbers)),
                (-23364..=-23300, [n, list @ ..]) if *n == list.len() as f64 => Some((-23300 - key, list.to_vec())),
                _ => None,
            }
        });
        let (key, numbers) = parameter.with_context(|| format!("invalid parameter {word:?}: expected KEY=VALUE"))?;
        parameters.insert(key, numbers);
    }
    Ok(NcnnLayer { kind, name, inputs, outputs, parameters })
}

/// Reader for the weights in a `.bin` file; holds the unread rest.
pub(crate) struct NcnnWeights<'a> {
    rest: &'a [u8],
}

impl<'a> NcnnWeights<'a> {
    /// Starts at the beginning of the file.
    pub(crate) fn new(file: &'a [u8]) -> Self {
        Self { rest: file }
    }

    fn take(&mut self, n_bytes: usize) -> Result<&'a [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(n_bytes).with_context(|| {
            format!("the .bin file is too short: expected {n_bytes} more bytes of weights, found {}", self.rest.len())
        })?;
        self.rest = rest;
        Ok(bytes)
    }

    /// Reads `n` little-endian numbers, preceded by a tag with their type. Errors: the file is too short, or the type
    /// is neither float16 nor float32.
    pub(crate) fn tagged(&mut self, n: usize) -> Result<(ElementType, &'a [u8])> {
        let tag = self.take(4)?;
        match u32::from_le_bytes([tag[0], tag[1], tag[2], tag[3]]) {
            0 => Ok((ElementType::F32, self.plain(n)?)),
            FLOAT16 => {
                let raw = self.take(n.saturating_mul(2))?;
                self.take(raw.len().next_multiple_of(4) - raw.len())?;
                Ok((ElementType::F16, raw))
            }
            tag => bail!("unsupported weight type {tag:#x}: expected float16 or float32"),
        }
    }

    /// Reads `n` 32-bit floats without a tag.
    pub(crate) fn plain(&mut self, n: usize) -> Result<&'a [u8]> {
        self.take(n.saturating_mul(4))
    }

    /// Checks that all weights have been read.
    pub(crate) fn end(&self) -> Result<()> {
        ensure!(self.rest.is_empty(), "{} of the .bin file belong to no layer", counted(self.rest.len(), "byte"));
        Ok(())
    }
}
