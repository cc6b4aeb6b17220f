//! Writer of a table of word vectors. Only the words are held in memory.

use anyhow::{Context, Result, ensure};
use orator_base::text::counted;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// Names of the tensors in the file.
pub const VECTORS: &str = "vectors";
pub const WORDS: &str = "words";
/// Size of the length field and the JSON header before the tensors; the JSON is padded with spaces.
const HEADER_BYTES: usize = 512;

/// Writer of vectors of dimension `dim`, in the order of the `push` calls.
pub struct TableWriter {
    file: BufWriter<File>,
    dim: usize,
    words: String,
    known: BTreeSet<String>,
}

impl TableWriter {
    pub fn new(path: &Path, dim: usize) -> Result<Self> {
        ensure!((1..=10_000).contains(&dim), "invalid vector length {dim}: expected 1 to 10000");
        let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        let mut file = BufWriter::with_capacity(1 << 20, file);
        file.write_all(&[b' '; HEADER_BYTES])?;
        Ok(Self { file, dim, words: String::new(), known: BTreeSet::new() })
    }

    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Adds a word; only the first vector of each word is used.
    ///
    /// # Errors
    ///
    /// The vector has another length or a non-finite number; the word is empty or contains a line break.
    pub fn push(&mut self, word: &str, vector: &[f32]) -> Result<()> {
        ensure!(vector.len() == self.dim, "`{word}` has {}, expected {}", counted(vector.len(), "number"), self.dim);
        ensure!(vector.iter().all(|number| number.is_finite()), "`{word}` has a value that is not finite");
        ensure!(
            !word.is_empty() && !word.contains('\n'),
            "invalid word `{}`: it is empty or contains a line break",
            word.escape_debug()
        );
        if self.known.insert(word.to_owned()) {
            self.words += word;
            self.words.push('\n');
            vector.iter().try_for_each(|number| self.file.write_all(&number.to_le_bytes()))?;
        }
        Ok(())
    }

    /// Writes the words and the header, and returns the number of words.
    pub fn finish(mut self) -> Result<usize> {
        let (n_words, dim) = (self.known.len(), self.dim);
        ensure!(n_words > 0, "it contains no words");
        self.file.write_all(self.words.as_bytes())?;
        let end = 4 * n_words * dim;
        let header = serde_json::json!({
            VECTORS: { "dtype": "F32", "shape": [n_words, dim], "data_offsets": [0, end] },
            WORDS: { "dtype": "U8", "shape": [self.words.len()], "data_offsets": [end, end + self.words.len()] },
        });
        let json = format!("{:<1$}", header.to_string(), HEADER_BYTES - 8);
        ensure!(json.len() == HEADER_BYTES - 8, "the header is too long");
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&(json.len() as u64).to_le_bytes())?;
        self.file.write_all(json.as_bytes())?;
        self.file.flush()?;
        Ok(n_words)
    }
}
