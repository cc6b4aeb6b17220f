//! The two files of an ncnn model: a line of text for each layer, and the weights one after the other.

use super::graph::ElementType;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;

/// The first line of the text.
const MAGIC: &str = "7767517";
/// The most layers.
const MAX_LAYERS: usize = 1 << 14;
/// What comes before weights of 16-bit floats.
const FLOAT16: u32 = 0x0130_6b47;

/// A line of the text.
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
    /// A whole number. Errors: a list, or a fraction.
    pub(crate) fn int(&self, key: i32, absent: i64) -> Result<i64> {
        let Some(numbers) = self.parameters.get(&key) else { return Ok(absent) };
        match numbers.as_slice() {
            [number] if number.fract() == 0.0 && number.abs() < 1e15 => Ok(*number as i64),
            _ => bail!("parameter {key} is a whole number, not {numbers:?}"),
        }
    }

    /// The numbers of a list; absent: none.
    pub(crate) fn list(&self, key: i32) -> &[f64] {
        self.parameters.get(&key).map_or(&[], Vec::as_slice)
    }

    /// Nothing may be said that is not read. Errors: a parameter beyond `keys`.
    pub(crate) fn knows(&self, keys: &[i32]) -> Result<()> {
        match self.parameters.keys().find(|key| !keys.contains(key)) {
            Some(key) => bail!("parameter {key} = {:?} is not known", self.list(*key)),
            None => Ok(()),
        }
    }
}

/// The layers of a `.param` file in the order in which they run. Errors: another first line, or a line that is no
/// layer; the message has its number.
pub(crate) fn layers(file: &[u8]) -> Result<Vec<NcnnLayer<'_>>> {
    let text = std::str::from_utf8(file).context("the .param file is no text")?;
    let mut lines = text.lines().enumerate();
    ensure!(
        lines.next().is_some_and(|(_, line)| line.trim() == MAGIC),
        "the .param file begins with {MAGIC}, in the order .param, .bin"
    );
    let counts = lines.next().map(|(_, line)| line.split_whitespace().map(str::parse).collect::<Vec<_>>());
    let Some([Ok(n_layers), Ok(_)]) = counts.as_deref() else { bail!("line 2 has the numbers of layers and blobs") };
    let n_layers: usize = *n_layers;
    let written = lines.filter(|(_, line)| !line.trim().is_empty());
    let layers = written.take(MAX_LAYERS + 1).map(|(k, line)| layer(line).with_context(|| place(k)));
    let layers = layers.collect::<Result<Vec<_>>>()?;
    ensure!(
        layers.len() == n_layers && n_layers <= MAX_LAYERS,
        "the .param file has {} layers, its second line says {n_layers}, {MAX_LAYERS} are the most",
        layers.len()
    );
    Ok(layers)
}

fn place(line: usize) -> String {
    format!("line {} of the .param file", line + 1)
}

fn layer(line: &str) -> Result<NcnnLayer<'_>> {
    let mut words = line.split_whitespace();
    let mut word = |what: &str| words.next().with_context(|| format!("the line ends before {what}"));
    let (kind, name) = (word("the kind")?, word("the name")?);
    let count = |word: &str| word.parse().ok().filter(|n| *n <= 64).with_context(|| format!("{word} blobs"));
    let (n_inputs, n_outputs): (usize, usize) = (count(word("the inputs")?)?, count(word("the outputs")?)?);
    let inputs = (0..n_inputs).map(|_| word("an input")).collect::<Result<_>>()?;
    let outputs = (0..n_outputs).map(|_| word("an output")).collect::<Result<_>>()?;
    let mut parameters = BTreeMap::new();
    for word in words {
        let number = |number: &str| number.parse::<f64>().ok().filter(|number| number.is_finite());
        let parameter = word.split_once('=').and_then(|(key, value)| {
            let (key, numbers) = (key.parse::<i32>().ok()?, value.split(',').map(number).collect::<Option<Vec<_>>>()?);
            // A list has the key -23300 - k and begins with its length.
            match (key, numbers.as_slice()) {
                (0..=64, [_]) => Some((key, numbers)),
                (-23364..=-23300, [n, list @ ..]) if *n == list.len() as f64 => Some((-23300 - key, list.to_vec())),
                _ => None,
            }
        });
        let (key, numbers) = parameter.with_context(|| format!("{word:?} is no parameter"))?;
        parameters.insert(key, numbers);
    }
    Ok(NcnnLayer { kind, name, inputs, outputs, parameters })
}

/// What of a `.bin` file is not yet read.
pub(crate) struct NcnnWeights<'a> {
    rest: &'a [u8],
}

impl<'a> NcnnWeights<'a> {
    /// All of it.
    pub(crate) fn new(file: &'a [u8]) -> Self {
        Self { rest: file }
    }

    fn take(&mut self, n_bytes: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n_bytes).with_context(|| {
            format!("{n_bytes} bytes of weights are expected, {} are left of the .bin file", self.rest.len())
        })?;
        self.rest = rest;
        Ok(taken)
    }

    /// `n` numbers, little-endian, whose form is said before them. Errors: fewer, or in a form other than float16 and float32.
    pub(crate) fn tagged(&mut self, n: usize) -> Result<(ElementType, &'a [u8])> {
        let tag = self.take(4)?;
        match u32::from_le_bytes([tag[0], tag[1], tag[2], tag[3]]) {
            0 => Ok((ElementType::F32, self.plain(n)?)),
            FLOAT16 => {
                let raw = self.take(n.saturating_mul(2))?;
                self.take(raw.len().next_multiple_of(4) - raw.len())?;
                Ok((ElementType::F16, raw))
            }
            tag => bail!("weights are float16 or float32, not of the form {tag:#x}"),
        }
    }

    /// `n` 32-bit floats.
    pub(crate) fn plain(&mut self, n: usize) -> Result<&'a [u8]> {
        self.take(n.saturating_mul(4))
    }

    /// Nothing may be left.
    pub(crate) fn end(&self) -> Result<()> {
        ensure!(self.rest.is_empty(), "{} bytes of the .bin file belong to no layer", self.rest.len());
        Ok(())
    }
}
