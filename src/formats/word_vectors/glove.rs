//! Text format of GloVe and word2vec: a word and its vector per line; word2vec begins with their number and dimension.

use super::writer::TableWriter;
use anyhow::{Context, Result, bail, ensure};
use std::io::BufRead;
use std::path::Path;

/// Maximum length of a line, bytes.
const MAX_LINE: u64 = 1 << 20;

/// Converts the text to the table `path` and returns the number of words.
///
/// # Errors
///
/// The line that has the wrong number of values, an invalid number or invalid text; a truncated file.
pub fn convert(mut text: impl BufRead, path: &Path) -> Result<usize> {
    let mut writer: Option<TableWriter> = None;
    let (mut line, mut declared, mut n_lines) = (Vec::new(), None, 0_u64);
    for n in 1_u64.. {
        line.clear();
        let read = std::io::Read::take(&mut text, MAX_LINE).read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        let position = || format!("line {n}");
        ensure!(
            line.ends_with(b"\n"),
            "line {n} has no line end: the file is truncated, or not a text file of vectors"
        );
        let line =
            std::str::from_utf8(&line).with_context(position).context("expected UTF-8 text of GloVe or word2vec")?;
        let line = line.trim_end_matches(['\n', '\r', ' ']);
        let parts: Vec<&str> = line.split(' ').collect();
        if let (1, [words, dim]) = (n, parts.as_slice()) {
            let numbers = words.parse::<u64>().ok().zip(dim.parse::<usize>().ok());
            let (words, dim) =
                numbers.with_context(|| format!("line 1: expected a vector or two sizes, found `{line}`"))?;
            declared = Some(words);
            writer = Some(TableWriter::new(path, dim)?);
            continue;
        }
        let writer = match &mut writer {
            Some(writer) => writer,
            None => writer.insert(TableWriter::new(path, parts.len() - 1).with_context(position)?),
        };
        let Some(at) = parts.len().checked_sub(writer.dim()).filter(|at| *at > 0) else {
            bail!(
                "line {n}: expected a word and {} numbers, found {} fields: the file is truncated, or its vectors \
                   differ in length",
                writer.dim(),
                parts.len()
            );
        };
        let number = |part: &&str| part.parse::<f32>().with_context(|| format!("line {n}: `{part}` is not a number"));
        let vector = parts[at..].iter().map(number).collect::<Result<Vec<f32>>>()?;
        // Some words of GloVe contain spaces.
        let word = parts[..at].join(" ");
        ensure!(
            at == 1 || parts[1..at].iter().any(|part| part.parse::<f32>().is_err()),
            "line {n}: `{}` has {} numbers, expected {}",
            parts[0],
            parts.len() - 1,
            writer.dim()
        );
        writer.push(&word, &vector).with_context(position)?;
        n_lines += 1;
    }
    if let Some(declared) = declared {
        ensure!(
            n_lines == declared,
            "its first line states {declared} words, but it has {n_lines}: the file is truncated"
        );
    }
    writer.context("the file is empty")?.finish()
}
