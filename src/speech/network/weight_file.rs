//! Index of a weight file: CTranslate2's binary format (version 6) or safetensors of transformers. Tensors are read one
//! by one, so that only one copy of the weights is in memory. All lengths are checked against the size of the file.

use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Version and model type that a CTranslate2 file must have.
const VERSION: u32 = 6;
const SPEC: &str = "WhisperSpec";
/// Maximum length in bytes of the header of a safetensors file.
const MAX_HEADER: u64 = 100 << 20;

/// Names of CTranslate2 and of transformers: replaced in this order, then `/` by `.`.
const TRANSFORMERS_NAMES: [(&str, &str); 16] = [
    ("self_attention/layer_norm", "self_attn_layer_norm"),
    ("/attention/layer_norm", "/encoder_attn_layer_norm"),
    ("ffn/layer_norm", "final_layer_norm"),
    ("ffn/linear_0", "fc1"),
    ("ffn/linear_1", "fc2"),
    ("self_attention/linear_0", "self_attn/[q|k|v]_proj"),
    ("self_attention/linear_1", "self_attn/out_proj"),
    ("/attention/linear_0", "/encoder_attn/q_proj"),
    ("/attention/linear_1", "/encoder_attn/[k|v]_proj"),
    ("/attention/linear_2", "/encoder_attn/out_proj"),
    ("embeddings/weight", "embed_tokens/weight"),
    ("position_encodings/encodings", "embed_positions/weight"),
    ("gamma", "weight"),
    ("beta", "bias"),
    ("/layer_", "/layers/"),
    ("/layers/norm", "/layer_norm"),
];

/// An open weight file. Variables have the names of CTranslate2.
pub(super) struct WeightFile {
    path: PathBuf,
    file: File,
    is_ctranslate2: bool,
    variables: BTreeMap<String, StoredTensor>,
}

struct StoredTensor {
    shape: Vec<usize>,
    number: StoredNumber,
    start: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum StoredNumber {
    F32,
    F16,
    I16,
    /// A type that only other networks use, with its size in bytes.
    Other(usize),
}

impl StoredNumber {
    fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::I16 => 2,
            Self::Other(size) => size,
        }
    }
}

impl WeightFile {
    /// Opens `model.bin` or `model.safetensors` in a folder.
    ///
    /// # Errors
    /// The folder has neither; the file is of another format or version, truncated or malformed. The message names the
    /// file and the position.
    pub(super) fn open(dir: &Path) -> Result<Self> {
        let is_ctranslate2 = dir.join("model.bin").exists();
        let path = dir.join(if is_ctranslate2 { "model.bin" } else { "model.safetensors" });
        let opened = input::open(&path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (n_bytes, file) = opened.with_context(|| {
            format!(
                "cannot open {}: expected a folder with model.bin (CTranslate2) or model.safetensors",
                path.display()
            )
        })?;
        let mut reader = IndexReader { reader: BufReader::new(&file), at: 0, n_bytes };
        let read = if is_ctranslate2 { reader.ctranslate2() } else { reader.safetensors() };
        let variables =
            read.with_context(|| format!("{}, byte {} of {n_bytes}: damaged file", path.display(), reader.at))?;
        Ok(Self { path, file, is_ctranslate2, variables })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn is_ctranslate2(&self) -> bool {
        self.is_ctranslate2
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.stored_names(name).iter().any(|name| self.variables.contains_key(name))
    }

    /// Shape of a variable that is stored as one tensor.
    pub(super) fn shape(&self, name: &str) -> Result<&[usize]> {
        Ok(&self.stored(&self.stored_names(name)[0])?.shape)
    }

    /// Value of an integer variable, at least 0.
    pub(super) fn int(&self, name: &str) -> Result<usize> {
        let stored = self.stored(name)?;
        let is_integer = stored.number == StoredNumber::I16 && stored.shape.iter().product::<usize>() == 1;
        ensure!(is_integer, "{}: {name} is not an i16 number", self.path.display());
        let mut bytes = [0; 2];
        self.file.read_exact_at(&mut bytes, stored.start).with_context(|| self.cannot_read(name))?;
        Ok(usize::from(u16::from_le_bytes(bytes)))
    }

    /// Values of a variable, row-major. Fused projections are assembled from their parts if these are stored
    /// separately, with zeros for the bias that keys do not have.
    ///
    /// # Errors
    /// A tensor is missing, has another shape or type, or a value that is not finite.
    pub(super) fn tensor(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
        let names = self.stored_names(name);
        let mut values = Vec::new();
        for part in &names {
            let part_shape: Vec<usize> = [&[shape[0] / names.len()], &shape[1..]].concat();
            let n: usize = part_shape.iter().product();
            if part.ends_with("k_proj.bias") && !self.variables.contains_key(part) {
                values.resize(values.len() + n, 0.0);
                continue;
            }
            let stored = self.stored(part)?;
            ensure!(
                stored.shape == part_shape,
                "{}: {part} has shape {:?}, expected {part_shape:?}",
                self.path.display(),
                stored.shape
            );
            let mut bytes = vec![0; n * stored.number.size()];
            self.file.read_exact_at(&mut bytes, stored.start).with_context(|| self.cannot_read(part))?;
            match stored.number {
                StoredNumber::F32 => values.extend(bytes.as_chunks().0.iter().map(|v| f32::from_le_bytes(*v))),
                StoredNumber::F16 => {
                    values.extend(bytes.as_chunks().0.iter().map(|v| f32_of_f16(u16::from_le_bytes(*v))));
                }
                other => bail!(
                    "{}: {part} has type {other:?}; supported are weights of type float32 or float16",
                    self.path.display()
                ),
            }
        }
        let is_finite = values.iter().all(|value| value.is_finite());
        ensure!(is_finite, "{}: {name} has a value that is not finite: the file is damaged", self.path.display());
        Ok(values)
    }

    fn stored(&self, name: &str) -> Result<&StoredTensor> {
        self.variables.get(name).with_context(|| {
            format!("{}: it has no tensor {name}, expected the weights of a Whisper network", self.path.display())
        })
    }

    fn cannot_read(&self, name: &str) -> String {
        format!("cannot read {name} in {}", self.path.display())
    }

    /// Names under which the file stores the parts of a variable.
    fn stored_names(&self, name: &str) -> Vec<String> {
        if self.is_ctranslate2 {
            return vec![name.to_owned()];
        }
        transformers_names(name)
    }
}

/// Names of the tensors of transformers that are the parts of a variable, in their order.
pub(super) fn transformers_names(name: &str) -> Vec<String> {
    let replace = |name: String, (from, to): &(&str, &str)| name.replace(from, to);
    let name = TRANSFORMERS_NAMES.iter().fold(name.to_owned(), replace).replace('/', ".");
    match name.split_once('[').and_then(|(before, rest)| Some((before, rest.split_once(']')?))) {
        Some((before, (parts, after))) => parts.split('|').map(|part| format!("{before}{part}{after}")).collect(),
        None => vec![name],
    }
}

/// Converts a number of half precision; infinities and NaN become NaN.
fn f32_of_f16(bits: u16) -> f32 {
    /// 2^112, the ratio of the smallest normal numbers.
    const SCALE: f32 = f32::from_bits(0x7780_0000);
    let magnitude =
        if bits & 0x7c00 == 0x7c00 { f32::NAN } else { f32::from_bits(u32::from(bits & 0x7fff) << 13) * SCALE };
    if bits & 0x8000 == 0 { magnitude } else { -magnitude }
}

/// Entry of the header of a safetensors file.
#[derive(Deserialize)]
struct HeaderEntry {
    dtype: String,
    shape: Vec<usize>,
    data_offsets: [u64; 2],
}

/// Reads lengths and names, and skips the values.
struct IndexReader<R> {
    reader: R,
    /// Position in the file.
    at: u64,
    n_bytes: u64,
}

impl<R: BufRead + Seek> IndexReader<R> {
    fn ctranslate2(&mut self) -> Result<BTreeMap<String, StoredTensor>> {
        let version = self.u32()?;
        ensure!(version == VERSION, "the format has version {version}, expected {VERSION} of CTranslate2");
        let spec = self.string()?;
        ensure!(spec == SPEC, "the model is a {spec:?}, expected {SPEC}");
        let _revision = self.u32()?;
        let mut variables = BTreeMap::new();
        for _ in 0..self.u32()? {
            let name = self.string()?;
            let [rank] = self.bytes()?;
            let shape = (0..rank).map(|_| Ok(self.u32()? as usize)).collect::<Result<Vec<_>>>()?;
            let [number] = self.bytes()?;
            let number = match number {
                0 => StoredNumber::F32,
                1 => StoredNumber::Other(1),
                2 => StoredNumber::I16,
                3 => StoredNumber::Other(4),
                4 => StoredNumber::F16,
                5 => StoredNumber::Other(2),
                other => bail!("{name} has the unknown number type {other}"),
            };
            let n_bytes = u64::from(self.u32()?);
            add(&mut variables, name, StoredTensor { shape, number, start: self.at }, n_bytes)?;
            self.skip(n_bytes)?;
        }
        for _ in 0..self.u32()? {
            let [alias, name] = [self.string()?, self.string()?];
            ensure!(variables.contains_key(&name), "{alias} is another name of {name}, which does not exist");
        }
        ensure!(self.at == self.n_bytes, "unexpected data after the last variable");
        Ok(variables)
    }

    fn safetensors(&mut self) -> Result<BTreeMap<String, StoredTensor>> {
        let n_header = u64::from_le_bytes(self.bytes()?);
        let n_left = self.n_bytes - self.at;
        ensure!(n_header <= n_left.min(MAX_HEADER), "the header has {n_header} bytes, but the file {n_left}");
        let mut header = String::new();
        self.reader.by_ref().take(n_header).read_to_string(&mut header)?;
        let mut entries: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&header)?;
        entries.remove("__metadata__");
        self.at += n_header;
        let n_data = self.n_bytes - self.at;
        let mut variables = BTreeMap::new();
        for (name, entry) in entries {
            let entry: HeaderEntry = serde_json::from_value(entry).with_context(|| name.clone())?;
            let [start, end] = entry.data_offsets;
            ensure!(start <= end && end <= n_data, "{name} ends at byte {end} of {n_data} bytes of data");
            let number = match entry.dtype.as_str() {
                "F32" => StoredNumber::F32,
                "F16" => StoredNumber::F16,
                other => bail!("{name} has type {other}; supported are weights of type F32 or F16"),
            };
            let name = name.strip_prefix("model.").map_or_else(|| name.clone(), str::to_owned);
            let stored = StoredTensor { shape: entry.shape, number, start: self.at + start };
            add(&mut variables, name, stored, end - start)?;
        }
        Ok(variables)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes).context("the file is truncated")?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.bytes()?))
    }

    /// Reads a string: its length including the terminating zero, and its bytes.
    fn string(&mut self) -> Result<String> {
        let length = u64::from(u16::from_le_bytes(self.bytes()?));
        let mut bytes = Vec::new();
        self.reader.by_ref().take(length).read_to_end(&mut bytes)?;
        ensure!(bytes.len() as u64 == length, "the file is truncated");
        ensure!(bytes.pop() == Some(0), "a name without a terminating zero");
        self.at += length;
        Ok(String::from_utf8(bytes)?)
    }

    fn skip(&mut self, n_bytes: u64) -> Result<()> {
        ensure!(n_bytes <= self.n_bytes - self.at, "the file is truncated");
        self.reader.seek_relative(n_bytes as i64)?;
        self.at += n_bytes;
        Ok(())
    }
}

/// Adds a variable after comparing its shape with the number of bytes that it occupies.
fn add(to: &mut BTreeMap<String, StoredTensor>, name: String, stored: StoredTensor, n_bytes: u64) -> Result<()> {
    let size = stored.shape.iter().try_fold(stored.number.size(), |n, length| n.checked_mul(*length));
    ensure!(
        size.is_some_and(|size| size as u64 == n_bytes),
        "{name} has {n_bytes} bytes, which is not the size of the shape {:?}",
        stored.shape
    );
    ensure!(!to.contains_key(&name), "{name} occurs twice");
    to.insert(name, stored);
    Ok(())
}
