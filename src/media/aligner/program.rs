//! The subprocess for forced alignment: starting it, sending words and audio, and reading the times.

use anyhow::{Context, Result, bail, ensure};
use orator_base::foreign_program::{command_in, empty_folder};
use orator_base::text::counted;
use std::fmt::Write as _;
use std::io::{ErrorKind, Read as _, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Program passed to the interpreter on its command line.
const PROGRAM: &str = include_str!("align.py");
/// Package version for which the program is written.
const VERSION: &str = "5.1.1";
/// Prints the package version, or fails.
const PRINT_VERSION: &str =
    "import os, pocketsphinx, importlib.metadata as m; os.memfd_create; print(m.version('pocketsphinx'))";

/// A word of a text, and the range of seconds in which it may be spoken, if known.
#[derive(Clone, Debug, PartialEq)]
pub struct SpokenWord {
    pub word: String,
    pub within: Option<(f64, f64)>,
}

/// Times of a word in seconds from the start of the audio, and its confidence (0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignedWord {
    pub start_secs: f64,
    pub end_secs: f64,
    pub confidence: f64,
}

/// A running subprocess that waits for words and audio.
pub struct Aligner {
    process: Child,
    python: PathBuf,
}

impl Aligner {
    /// Version of the package found by the interpreter `python`.
    ///
    /// # Errors
    ///
    /// The interpreter or the package is missing; the message explains how to install both.
    pub fn version(python: &Path) -> Result<String> {
        let name = python.display();
        let remedy = remedy();
        let folder = empty_folder()?;
        let queried = isolated(python, PRINT_VERSION, folder.path())?.stdin(Stdio::null()).output();
        let output = match queried {
            Ok(output) => output,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                bail!("the Python interpreter `{name}` was not found: {remedy}")
            }
            Err(error) => return Err(error).with_context(|| format!("cannot run {name}: {remedy}")),
        };
        let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        ensure!(
            output.status.success() && !version.is_empty(),
            "`{name}` does not find the package pocketsphinx ({}; PYTHONPATH, the user site and .python-version are ignored): \
             {remedy}",
            last_line(&output.stderr)
        );
        Ok(version)
    }

    /// Starts the subprocess with the interpreter `python`. Errors as [`Self::version`].
    pub fn start(python: &Path) -> Result<Self> {
        Self::version(python)?;
        let folder = empty_folder()?;
        let mut command = isolated(python, PROGRAM, folder.path())?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = command.spawn().with_context(|| format!("cannot run {}", python.display()))?;
        // The program's first byte reports that its modules are loaded, so that the folder can be removed before this
        // process restricts itself. Without that byte the subprocess has ended, which `align` reports.
        let _ = process.stdout.as_mut().map(|stdout| stdout.read_exact(&mut [0]));
        Ok(Self { process, python: python.to_owned() })
    }

    /// Aligns words with audio; `None` for a word that does not fit. `feed` is called with a function that takes
    /// chunks of mono samples in -1..1 at 16 kHz.
    pub fn align(
        mut self,
        words: &[SpokenWord],
        feed: impl FnOnce(&mut dyn FnMut(&[f32]) -> Result<()>) -> Result<()>,
    ) -> Result<Vec<Option<AlignedWord>>> {
        let mut pipe = self.process.stdin.take().context("the input of the aligner is closed")?;
        let header = header(words);
        let mut bytes = Vec::new();
        let sent = pipe.write_all(header.as_bytes()).map_err(anyhow::Error::from).and_then(|()| {
            feed(&mut |chunk| {
                bytes.clear();
                let levels = chunk.iter().map(|sample| (sample.clamp(-1.0, 1.0) * 32_767.0).round() as i16);
                bytes.extend(levels.flat_map(i16::to_le_bytes));
                Ok(pipe.write_all(&bytes)?)
            })
        });
        drop(pipe);
        let is_broken_pipe = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
        if let Err(error) = sent
            && !error.downcast_ref::<std::io::Error>().is_some_and(is_broken_pipe)
        {
            let _ = self.process.kill();
            let _ = self.process.wait();
            return Err(error);
        }
        let output = self.process.wait_with_output()?;
        ensure!(
            output.status.success(),
            "the aligner ({}, pocketsphinx {VERSION}) failed with {}: {}",
            self.python.display(),
            output.status,
            last_line(&output.stderr)
        );
        let output_text = String::from_utf8_lossy(&output.stdout);
        let times: Vec<_> = output_text.lines().map(times).collect::<Result<_>>()?;
        ensure!(
            times.len() == words.len(),
            "the aligner returned {}, expected {}",
            counted(times.len(), "word"),
            words.len()
        );
        Ok(times)
    }
}

/// Python command in isolated mode (no PYTHON* variables, no user site, no modules from the working directory), in an
/// empty folder.
fn isolated(python: &Path, code: &str, folder: &Path) -> Result<Command> {
    let mut command = command_in(folder, python)?;
    command.args(["-I", "-c", code]);
    Ok(command)
}

/// Instructions for installing the package and naming its interpreter.
fn remedy() -> String {
    format!(
        "install pocketsphinx with `python3 -m venv aligner && aligner/bin/pip install pocketsphinx=={VERSION}`, and \
         select that Python with --python aligner/bin/python or ORATOR_PYTHON=aligner/bin/python"
    )
}

/// Input for the subprocess: the number of words, then one word per line.
pub fn header(words: &[SpokenWord]) -> String {
    let mut header = format!("{}\n", words.len());
    for SpokenWord { word, within } in words {
        // Words contain no spaces; other control characters are removed.
        let word = word.replace(char::is_control, "");
        let _ = match within {
            Some((from, until)) => writeln!(header, "{word}\t{from}\t{until}"),
            None => writeln!(header, "{word}\t-\t-"),
        };
    }
    header
}

/// Times of a word in a line that `align.py` writes; `None` for a word that was not found.
pub fn times(line: &str) -> Result<Option<AlignedWord>> {
    let numbers: Vec<f64> = line.split('\t').filter_map(|part| part.parse().ok()).collect();
    match numbers[..] {
        _ if line == "-" => Ok(None),
        [start_secs, end_secs, confidence] => Ok(Some(AlignedWord { start_secs, end_secs, confidence })),
        _ => bail!("invalid output of the aligner `{line}`: expected `-` or start, end and confidence"),
    }
}

fn last_line(output_text: &[u8]) -> String {
    String::from_utf8_lossy(output_text)
        .lines()
        .rev()
        .map(str::trim)
        .find(|line| !line.is_empty())
        .unwrap_or("")
        .to_owned()
}
