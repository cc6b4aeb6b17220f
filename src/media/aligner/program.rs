//! The process that aligns: started, fed with words and sound, asked for times.

use anyhow::{Context, Result, bail, ensure};
use orator_base::foreign_program::{command_in, empty_folder};
use std::fmt::Write as _;
use std::io::{ErrorKind, Read as _, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// What the interpreter runs, given on its command line.
const DRIVER: &str = include_str!("align.py");
/// Version of the package that the driver is written for.
const VERSION: &str = "5.1.1";
/// The package's version, or an error.
const ASK: &str = "import os, pocketsphinx, importlib.metadata as m; os.memfd_create; print(m.version('pocketsphinx'))";

/// Word of a text, and the seconds between which it may be said, where they are known.
#[derive(Clone, Debug, PartialEq)]
pub struct SpokenWord {
    pub word: String,
    pub within: Option<(f64, f64)>,
}

/// Seconds from the beginning of the sound, and how well the word fits, above 0 up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignedWord {
    pub start_secs: f64,
    pub end_secs: f64,
    pub confidence: f64,
}

/// A started process that waits for words and sound.
pub struct Aligner {
    process: Child,
    python: PathBuf,
}

impl Aligner {
    /// Version of the package, as the interpreter `python` finds it. Errors: no such interpreter, or no package; the
    /// message says how to get both.
    pub fn version(python: &Path) -> Result<String> {
        let name = python.display();
        let remedy = remedy();
        let folder = empty_folder()?;
        let asked = isolated(python, ASK, folder.path())?.stdin(Stdio::null()).output();
        let output = match asked {
            Ok(output) => output,
            Err(error) if error.kind() == ErrorKind::NotFound => bail!("there is no Python `{name}`: {remedy}"),
            Err(error) => return Err(error).with_context(|| format!("cannot run {name}: {remedy}")),
        };
        let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        ensure!(
            output.status.success() && !version.is_empty(),
            "`{name}` has no package pocketsphinx ({}): {remedy}",
            last_line(&output.stderr)
        );
        Ok(version)
    }

    /// Starts the process by the interpreter `python`. Errors: as of `version`.
    pub fn start(python: &Path) -> Result<Self> {
        Self::version(python)?;
        let folder = empty_folder()?;
        let mut command = isolated(python, DRIVER, folder.path())?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = command.spawn().with_context(|| format!("cannot run {}", python.display()))?;
        // The driver's first byte reports that its modules are loaded: the folder can be removed, before this process may
        // restrict itself. Without that byte the process has ended, which `align` reports.
        let _ = process.stdout.as_mut().map(|stdout| stdout.read_exact(&mut [0]));
        Ok(Self { process, python: python.to_owned() })
    }

    /// Times of the words in a sound, `None` where a word does not fit. `feed` gets what takes the sound: pieces of mono
    /// samples in -1..1 at 16 kHz. Errors: of `feed`; a process that ended too early, with what it said.
    pub fn align(
        mut self,
        words: &[SpokenWord],
        feed: impl FnOnce(&mut dyn FnMut(&[f32]) -> Result<()>) -> Result<()>,
    ) -> Result<Vec<Option<AlignedWord>>> {
        let mut pipe = self.process.stdin.take().context("the aligner has no input")?;
        let header = header(words);
        let mut bytes = Vec::new();
        let fed = pipe.write_all(header.as_bytes()).map_err(anyhow::Error::from).and_then(|()| {
            feed(&mut |piece| {
                bytes.clear();
                let levels = piece.iter().map(|sample| (sample.clamp(-1.0, 1.0) * 32_767.0).round() as i16);
                bytes.extend(levels.flat_map(i16::to_le_bytes));
                Ok(pipe.write_all(&bytes)?)
            })
        });
        drop(pipe);
        let is_gone = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
        if let Err(error) = fed
            && !error.downcast_ref::<std::io::Error>().is_some_and(is_gone)
        {
            let _ = self.process.kill();
            let _ = self.process.wait();
            return Err(error);
        }
        let output = self.process.wait_with_output()?;
        ensure!(
            output.status.success(),
            "the aligner ({}, pocketsphinx {VERSION}) ended with {}: {}",
            self.python.display(),
            output.status,
            last_line(&output.stderr)
        );
        let said = String::from_utf8_lossy(&output.stdout);
        let times: Vec<_> = said.lines().map(times).collect::<Result<_>>()?;
        ensure!(times.len() == words.len(), "the aligner gave {} words of {}", times.len(), words.len());
        Ok(times)
    }
}

/// Python in isolated mode (no variables PYTHON*, no user site, no module of the working directory), in an empty folder.
fn isolated(python: &Path, code: &str, folder: &Path) -> Result<Command> {
    let mut command = command_in(folder, python)?;
    command.args(["-I", "-c", code]);
    Ok(command)
}

/// What gets the package, and how its interpreter is named.
fn remedy() -> String {
    format!(
        "make one with `python3 -m venv aligner && aligner/bin/pip install pocketsphinx=={VERSION}`, and name it with \
         --python aligner/bin/python or in ORATOR_PYTHON"
    )
}

/// Words for the process: their number, then a line each.
fn header(words: &[SpokenWord]) -> String {
    let mut header = format!("{}\n", words.len());
    for SpokenWord { word, within } in words {
        // A word has no blanks within; other control characters are no part of it.
        let word = word.replace(char::is_control, "");
        let _ = match within {
            Some((from, until)) => writeln!(header, "{word}\t{from}\t{until}"),
            None => writeln!(header, "{word}\t-\t-"),
        };
    }
    header
}

fn times(line: &str) -> Result<Option<AlignedWord>> {
    let numbers: Vec<f64> = line.split('\t').filter_map(|part| part.parse().ok()).collect();
    match numbers[..] {
        _ if line == "-" => Ok(None),
        [start_secs, end_secs, confidence] => Ok(Some(AlignedWord { start_secs, end_secs, confidence })),
        _ => bail!("the aligner said `{line}`"),
    }
}

fn last_line(said: &[u8]) -> String {
    String::from_utf8_lossy(said).lines().rev().map(str::trim).find(|line| !line.is_empty()).unwrap_or("").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_times_cross_the_pipe_as_lines() {
        let words = [("so\u{7}", None), ("well", Some((0.5, 2.0)))];
        let words = words.map(|(word, within)| SpokenWord { word: word.to_owned(), within });
        assert_eq!(header(&words), "2\nso\t-\t-\nwell\t0.5\t2\n");
        let expected = AlignedWord { start_secs: 0.5, end_secs: 0.75, confidence: 1.0 };
        assert_eq!(times("0.50\t0.75\t1.00").unwrap(), Some(expected));
        assert!(times("-").unwrap().is_none() && times("0.5\tx").is_err());
    }

    #[test]
    fn an_interpreter_that_is_not_there_is_named_with_the_remedy() {
        let error = Aligner::version(Path::new("/nowhere/python")).unwrap_err().to_string();
        assert!(error.contains("/nowhere/python") && error.contains("pocketsphinx==5.1.1"), "{error}");
    }
}
