//! Look-up in a table of word vectors, by the rules of FineMotion (GENEA 2020): lower case, a final full stop removed;
//! index 0 is padding, a vector of zeros, index 1 an unknown word, a vector of ones. Only the words are held in memory.

use super::writer::{VECTORS, WORDS};
use anyhow::{Context, Result, ensure};
use orator_base::input;
use safetensors::Dtype;
use safetensors::tensor::Metadata;
use std::collections::HashMap;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Index of padding.
pub const PADDING: usize = 0;
/// Index of a word without a vector.
pub const UNKNOWN: usize = 1;
/// Number of indices before that of the first word.
const N_SPECIAL: usize = 2;
/// Maximum size of the header, bytes.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// An open table of word vectors; it can be shared between threads.
#[derive(Debug)]
pub struct WordVectors {
    path: PathBuf,
    file: File,
    /// File offset of the first vector, bytes.
    at: u64,
    dim: usize,
    rows: HashMap<String, u32>,
}

impl WordVectors {
    /// Opens a table.
    ///
    /// # Errors
    ///
    /// The file is not a table of word vectors, or is truncated or damaged.
    pub fn open(path: &Path) -> Result<Self> {
        Self::read(path).with_context(|| format!("{} is not a valid table of word vectors", path.display()))
    }

    fn read(path: &Path) -> Result<Self> {
        let file = input::open(path)?;
        let bytes = file.metadata()?.len();
        let part = |at: u64, size: u64| -> Result<Vec<u8>> {
            ensure!(at.checked_add(size).is_some_and(|end| end <= bytes), "it is truncated after {bytes} bytes");
            let mut part = vec![0; usize::try_from(size)?];
            file.read_exact_at(&mut part, at)?;
            Ok(part)
        };
        let length = u64::from_le_bytes(part(0, 8)?.try_into().unwrap_or_default());
        ensure!(length <= MAX_HEADER_BYTES, "it has no header; convert GloVe text files with `orator words add FILE`");
        let metadata: Metadata = serde_json::from_slice(&part(8, length)?).context("its header is damaged")?;
        let tensor = |name: &str| metadata.info(name).with_context(|| format!("it has no tensor `{name}`"));
        let (vectors, words) = (tensor(VECTORS)?, tensor(WORDS)?);
        ensure!(vectors.dtype == Dtype::F32 && words.dtype == Dtype::U8, "expected tensors of type F32 and U8");
        let [n_words, dim] = vectors.shape[..] else {
            anyhow::bail!("tensor `{VECTORS}`: expected shape [words, numbers]")
        };
        ensure!(dim > 0, "its vectors are empty");
        let data = 8 + length;
        let end = data + vectors.data_offsets.1.max(words.data_offsets.1) as u64;
        ensure!(end == bytes, "it has {bytes} bytes, but its header states {end}: it is truncated or damaged");
        let word_list = part(data + words.data_offsets.0 as u64, (words.data_offsets.1 - words.data_offsets.0) as u64)?;
        let word_list = String::from_utf8(word_list).context("its words are not valid UTF-8")?;
        let mut rows = HashMap::with_capacity(word_list.lines().count());
        for (word, row) in word_list.lines().zip(0_u32..) {
            rows.entry(word.to_owned()).or_insert(row);
        }
        ensure!(rows.len() == n_words, "it has {} words, but {n_words} vectors", rows.len());
        let at = data + vectors.data_offsets.0 as u64;
        Ok(Self { path: path.to_owned(), file, at, dim, rows })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn dim(&self) -> usize {
        self.dim
    }

    pub fn n_words(&self) -> usize {
        self.rows.len()
    }

    /// Index of a word as written in a transcript; `UNKNOWN` if it has no vector. A word that is unknown with its
    /// surrounding punctuation is looked up without it.
    pub fn index(&self, word: &str) -> usize {
        let word = word.trim().to_lowercase();
        let stripped = word.strip_suffix('.').filter(|rest| !rest.is_empty()).unwrap_or(&word);
        let bare = stripped.trim_matches(|character: char| !character.is_alphanumeric());
        let row = self.rows.get(stripped).or_else(|| self.rows.get(bare));
        row.map_or(UNKNOWN, |row| N_SPECIAL + *row as usize)
    }

    /// Vector of an index.
    ///
    /// # Errors
    ///
    /// The index is out of range, or the file cannot be read.
    pub fn vector(&self, index: usize) -> Result<Vec<f32>> {
        let row = match index {
            PADDING => return Ok(vec![0.0; self.dim]),
            UNKNOWN => return Ok(vec![1.0; self.dim]),
            _ => index - N_SPECIAL,
        };
        ensure!(row < self.n_words(), "{} has no word with index {index}", self.path.display());
        let mut bytes = vec![0; 4 * self.dim];
        let read = self.file.read_exact_at(&mut bytes, self.at + (4 * row * self.dim) as u64);
        read.with_context(|| format!("cannot read {}", self.path.display()))?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number)).collect())
    }

    /// Number of `words` that have vectors.
    pub fn n_known<'w>(&self, words: impl IntoIterator<Item = &'w str>) -> usize {
        words.into_iter().filter(|word| self.index(word) != UNKNOWN).count()
    }
}
