//! Text of GloVe and of word2vec: a word and its numbers a line; word2vec's first line says how many there are of both.

use super::writer::TableWriter;
use anyhow::{Context, Result, bail, ensure};
use std::io::BufRead;
use std::path::Path;

/// Most bytes of a line.
const MAX_LINE: u64 = 1 << 20;

/// Writes the vectors of a text as the table `path`; the number of words. Errors: the line that is not as the others:
/// too few numbers, no number, no text; a text that is cut off.
pub fn convert(mut text: impl BufRead, path: &Path) -> Result<usize> {
    let mut writer: Option<TableWriter> = None;
    let (mut line, mut promised, mut n_lines) = (Vec::new(), None, 0_u64);
    for n in 1_u64.. {
        line.clear();
        let read = std::io::Read::take(&mut text, MAX_LINE).read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        let place = || format!("line {n}");
        ensure!(line.ends_with(b"\n"), "line {n} has no end: the file is cut off, or is no text of vectors");
        let line =
            std::str::from_utf8(&line).with_context(place).context("it is no text (UTF-8) of GloVe or word2vec")?;
        let line = line.trim_end_matches(['\n', '\r', ' ']);
        let parts: Vec<&str> = line.split(' ').collect();
        if let (1, [words, dim]) = (n, parts.as_slice()) {
            let numbers = words.parse::<u64>().ok().zip(dim.parse::<usize>().ok());
            let (words, dim) = numbers.with_context(|| format!("line 1: `{line}` is neither a vector nor a size"))?;
            promised = Some(words);
            writer = Some(TableWriter::new(path, dim)?);
            continue;
        }
        let writer = match &mut writer {
            Some(writer) => writer,
            None => writer.insert(TableWriter::new(path, parts.len() - 1).with_context(place)?),
        };
        let Some(at) = parts.len().checked_sub(writer.dim()).filter(|at| *at > 0) else {
            bail!(
                "line {n}: a word and {} numbers are expected, it has {} parts: the file is cut off, or its vectors \
                   differ in length",
                writer.dim(),
                parts.len()
            );
        };
        let number = |part: &&str| part.parse::<f32>().with_context(|| format!("line {n}: `{part}` is no number"));
        let vector = parts[at..].iter().map(number).collect::<Result<Vec<f32>>>()?;
        // Some words of GloVe have blanks in them.
        let word = parts[..at].join(" ");
        ensure!(
            at == 1 || parts[1..at].iter().any(|part| part.parse::<f32>().is_err()),
            "line {n}: `{}` has {} numbers, {} are expected",
            parts[0],
            parts.len() - 1,
            writer.dim()
        );
        writer.push(&word, &vector).with_context(place)?;
        n_lines += 1;
    }
    if let Some(promised) = promised {
        ensure!(n_lines == promised, "its first line promises {promised} words, it has {n_lines}: it is cut off");
    }
    writer.context("it is empty")?.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &[u8]) -> String {
        let dir = tempfile::tempdir().unwrap();
        format!("{:#}", convert(text, &dir.path().join("w")).unwrap_err())
    }

    #[test]
    fn a_text_of_another_dimension_or_cut_off_is_refused_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("w");
        assert_eq!(convert(&b"2 3\nthe 1 2 3 \n. . . 4 5 6\n"[..], &path).unwrap(), 2);
        assert!(refusal(b"the 1 2 3\nso 1 2\n").contains("line 2: a word and 3 numbers"));
        assert!(refusal(b"the 1 2 3\nso 1 2 3 4\n").contains("line 2: `so` has 4 numbers, 3"));
        assert!(refusal(b"the 1 2 3\nso 1 2 x\n").contains("line 2: `x` is no number"));
        assert!(refusal(b"the 1 2 3\nso 1 2 nan\n").contains("not finite"));
        assert!(refusal(b"the 1 2 3\nso 1 2 3").contains("line 2 has no end"));
        assert!(refusal(b"3 2\nthe 1 2\nso 1 2\n").contains("promises 3 words, it has 2"));
        assert!(refusal(b"").contains("empty") && refusal(b"the\n").contains("1 to 10000"));
        assert!(refusal(b"\xff\xfe\n").contains("no text"));
    }
}
