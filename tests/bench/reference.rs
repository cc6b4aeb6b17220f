//! A reference implementation in Python: a script run as `SCRIPT serve FILE` that answers each command with one line of
//! JSON.

use anyhow::{Context, Result, bail};
use orator_nn::weights::Contents;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

pub(crate) struct Reference {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    /// First line of its output.
    pub(crate) hello: Value,
}

impl Reference {
    /// Starts `script` with the Python in ORATOR_REFERENCE_PYTHON on `n_threads` threads, with the input `given`, which
    /// is written to `file`.
    pub(crate) fn start(script: &Path, n_threads: usize, given: &Contents, file: &Path) -> Result<Self> {
        given.write(file)?;
        let python = std::env::var("ORATOR_REFERENCE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let n_threads = n_threads.to_string();
        let mut command = Command::new(&python);
        command.arg(script).arg("serve").arg(file).env("OMP_NUM_THREADS", &n_threads).env("MKL_NUM_THREADS", n_threads);
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().with_context(|| {
                format!("{python} cannot be run; ORATOR_REFERENCE_PYTHON names a Python with torch")
            })?;
        let (Some(to), Some(from)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("{python} has no standard input and output");
        };
        let mut reference = Self { child, to, from: BufReader::new(from), hello: Value::Null };
        reference.hello = reference.answer().with_context(|| format!("{} did not start", script.display()))?;
        Ok(reference)
    }

    /// Version of PyTorch.
    pub(crate) fn version(&self) -> &str {
        self.hello["torch"].as_str().unwrap_or("?")
    }

    /// Sends a command and returns the answer.
    pub(crate) fn ask(&mut self, command: &str) -> Result<Value> {
        writeln!(self.to, "{command}").context("the reference has stopped")?;
        self.answer().with_context(|| format!("no answer to `{command}`"))
    }

    /// Sends a command and returns the seconds in the answer.
    pub(crate) fn secs(&mut self, command: &str) -> Result<f64> {
        self.ask(command)?["secs"].as_f64().context("the reference returned no time")
    }

    fn answer(&mut self) -> Result<Value> {
        let mut line = String::new();
        self.from.read_line(&mut line)?;
        serde_json::from_str(&line).with_context(|| format!("invalid answer of the reference: {line:?}"))
    }
}

impl Drop for Reference {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
