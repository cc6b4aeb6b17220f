//! Loading of a configuration file: resolved and validated settings, or all of its problems at once.

use super::file::{self, Folders, Problem};
use super::rules;
use super::sections::Settings;
use anyhow::{Context, Result};
use orator_base::input;
use std::fmt;
use std::path::{Path, PathBuf};

/// Documented default configuration, which `orator init` writes.
pub const DEFAULT_FILE: &str = include_str!("../../../pipeline.toml");

/// A configuration ready to use.
#[derive(Clone, Debug)]
pub struct Config {
    /// Resolved: paths absolute, values in range.
    pub settings: Settings,
    /// Absolute path of the file it was read from.
    pub file: PathBuf,
    /// Notes on keys given under a former name, a line each.
    pub notes: Vec<String>,
}

/// All problems of a configuration; the message has a line for each.
#[derive(Debug, thiserror::Error)]
pub struct ConfigError {
    /// The file with the problems.
    pub file: PathBuf,
    /// Problems sorted by line.
    pub problems: Vec<Problem>,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.problems.len() == 1 { "problem" } else { "problems" };
        write!(f, "{} {plural} in {}", self.problems.len(), self.file.display())?;
        self.problems.iter().try_for_each(|problem| write!(f, "\n  {problem}"))
    }
}

/// Reads `file` and applies the `--set` changes to it. Paths in the file are relative to its folder, paths given by
/// `--set` to the working directory.
///
/// # Errors
/// A file that cannot be read, or `ConfigError` with every problem at once.
pub fn load(file: &Path, sets: &[String]) -> Result<Config> {
    let text = input::read_text(file, input::MAX_TEXT).with_context(|| {
        format!(
            "cannot read the configuration {}: create it with `orator init DIR`, or give its path with -c FILE",
            file.display()
        )
    })?;
    resolve(&text, sets, std::path::absolute(file)?)
}

/// Configuration as if `file` were empty, with the `--set` changes applied.
///
/// # Errors
/// `ConfigError` with every problem at once.
pub fn load_default(file: &Path, sets: &[String]) -> Result<Config> {
    resolve("", sets, std::path::absolute(file)?)
}

/// Resolves `text`, the content of `file`, and validates the result.
///
/// # Errors
/// `ConfigError` with every problem at once.
pub fn resolve(text: &str, sets: &[String], file: PathBuf) -> Result<Config> {
    let current = std::env::current_dir()?;
    let unicode = |folder: &Path| -> Result<String> {
        Ok(folder
            .to_str()
            .with_context(|| format!("the path of the folder {} is not valid UTF-8: rename it", folder.display()))?
            .into())
    };
    let folder = unicode(file.parent().unwrap_or(Path::new("")))?;
    let given = file::read(text, sets, &Folders { file: &folder, current: &unicode(&current)? });
    let mut problems = given.problems;
    problems.extend(rules::check(&given.settings, &given.locations));
    problems.sort_by(|a, b| (a.location, &a.key).cmp(&(b.location, &b.key)));
    if problems.is_empty() {
        Ok(Config { settings: given.settings, file, notes: given.notes })
    } else {
        Err(ConfigError { file, problems }.into())
    }
}
