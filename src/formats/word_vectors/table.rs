//! Look-up in a table of word vectors, by the rules of FineMotion's entry to GENEA 2020: lower case, a stop at the end
//! stripped; index 0 is padding, a vector of zeros, index 1 an unknown word, a vector of ones. Memory: the words.

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
/// Indices before the first word's.
const N_SPECIAL: usize = 2;
/// Most bytes of a header.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// Open table of word vectors; threads may share it.
#[derive(Debug)]
pub struct WordVectors {
    path: PathBuf,
    file: File,
    /// Offset of the first vector.
    at: u64,
    dim: usize,
    /// Row of each word.
    rows: HashMap<String, u32>,
}

impl WordVectors {
    /// Opens a table. Errors: a file that is none, is cut off or damaged.
    pub fn open(path: &Path) -> Result<Self> {
        Self::read(path).with_context(|| format!("{} is no table of word vectors", path.display()))
    }

    fn read(path: &Path) -> Result<Self> {
        let file = input::open(path)?;
        let bytes = file.metadata()?.len();
        let part = |at: u64, size: u64| -> Result<Vec<u8>> {
            ensure!(at.checked_add(size).is_some_and(|end| end <= bytes), "it has only {bytes} bytes: it is cut off");
            let mut part = vec![0; usize::try_from(size)?];
            file.read_exact_at(&mut part, at)?;
            Ok(part)
        };
        let length = u64::from_le_bytes(part(0, 8)?.try_into().unwrap_or_default());
        ensure!(length <= MAX_HEADER_BYTES, "it has no header (`orator words add FILE` makes one from GloVe's text)");
        let metadata: Metadata = serde_json::from_slice(&part(8, length)?).context("its header is damaged")?;
        let tensor = |name: &str| metadata.info(name).with_context(|| format!("it has no tensor `{name}`"));
        let (vectors, words) = (tensor(VECTORS)?, tensor(WORDS)?);
        ensure!(vectors.dtype == Dtype::F32 && words.dtype == Dtype::U8, "its tensors are not F32 and U8");
        let [n_words, dim] = vectors.shape[..] else { anyhow::bail!("`{VECTORS}` is not [words, numbers]") };
        ensure!(dim > 0, "its vectors have no numbers");
        let data = 8 + length;
        let end = data + vectors.data_offsets.1.max(words.data_offsets.1) as u64;
        ensure!(end == bytes, "it has {bytes} bytes, its header says {end}: it is cut off or damaged");
        let said = part(data + words.data_offsets.0 as u64, (words.data_offsets.1 - words.data_offsets.0) as u64)?;
        let said = String::from_utf8(said).context("its words are no UTF-8")?;
        let mut rows = HashMap::with_capacity(said.lines().count());
        for (word, row) in said.lines().zip(0_u32..) {
            rows.entry(word.to_owned()).or_insert(row);
        }
        ensure!(rows.len() == n_words, "it has {} words and {n_words} vectors", rows.len());
        let at = data + vectors.data_offsets.0 as u64;
        Ok(Self { path: path.to_owned(), file, at, dim, rows })
    }

    /// Numbers of a vector.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of words.
    pub fn n_words(&self) -> usize {
        self.rows.len()
    }

    /// Index of a word as a transcript writes it; `UNKNOWN` without a vector. A word that is unknown with the punctuation
    /// around it is looked up without.
    pub fn index(&self, word: &str) -> usize {
        let word = word.trim().to_lowercase();
        let stripped = word.strip_suffix('.').filter(|rest| !rest.is_empty()).unwrap_or(&word);
        let bare = stripped.trim_matches(|letter: char| !letter.is_alphanumeric());
        let row = self.rows.get(stripped).or_else(|| self.rows.get(bare));
        row.map_or(UNKNOWN, |row| N_SPECIAL + *row as usize)
    }

    /// Vector of an index. Errors: no such index, a file that cannot be read.
    pub fn vector(&self, index: usize) -> Result<Vec<f32>> {
        let row = match index {
            PADDING => return Ok(vec![0.0; self.dim]),
            UNKNOWN => return Ok(vec![1.0; self.dim]),
            _ => index - N_SPECIAL,
        };
        ensure!(row < self.n_words(), "{} has no index {index}", self.path.display());
        let mut bytes = vec![0; 4 * self.dim];
        let read = self.file.read_exact_at(&mut bytes, self.at + (4 * row * self.dim) as u64);
        read.with_context(|| format!("cannot read {}", self.path.display()))?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number)).collect())
    }

    /// Number of the words that have vectors.
    pub fn n_known<'w>(&self, words: impl IntoIterator<Item = &'w str>) -> usize {
        words.into_iter().filter(|word| self.index(word) != UNKNOWN).count()
    }
}

#[cfg(test)]
mod tests {
    use super::super::glove;
    use super::*;

    /// Table of a text of vectors.
    fn table(dir: &Path, text: &str) -> Result<WordVectors> {
        let path = dir.join("w.safetensors");
        glove::convert(text.as_bytes(), &path)?;
        WordVectors::open(&path)
    }

    #[test]
    fn words_are_found_by_the_rules_of_the_paper() {
        let dir = tempfile::tempdir().unwrap();
        let table = table(dir.path(), "the 0.5 -1\nso 1e-3 2\n. 3 4\nu.s. 5 6\nthe 9 9\n").unwrap();
        assert_eq!((table.dim(), table.n_words()), (2, 4));
        let vector = |word: &str| table.vector(table.index(word)).unwrap();
        assert_eq!(
            (vector("The"), vector("so."), vector("."), vector("So,")),
            (vec![0.5, -1.0], vec![0.001, 2.0], vec![3.0, 4.0], vec![0.001, 2.0])
        );
        assert_eq!((vector("Straße"), table.vector(PADDING).unwrap()), (vec![1.0, 1.0], vec![0.0, 0.0]));
        assert!(table.vector(6).is_err());
        assert_eq!(table.n_known(["the", "der", "so"]), 2);
    }

    #[test]
    fn a_file_that_is_cut_off_is_refused_wherever_it_is_cut() {
        let dir = tempfile::tempdir().unwrap();
        drop(table(dir.path(), "the 0.5 -1\nso 1 2\n").unwrap());
        let path = dir.path().join("w.safetensors");
        let whole = std::fs::read(&path).unwrap();
        for end in 0..whole.len() {
            std::fs::write(&path, &whole[..end]).unwrap();
            assert!(WordVectors::open(&path).is_err(), "{end}");
        }
        for at in (0..512).step_by(3) {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x15;
            std::fs::write(&path, &bytes).unwrap();
            let _ = WordVectors::open(&path).map(|table| table.vector(2));
        }
    }
}
