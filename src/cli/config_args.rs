//! Arguments several verbs share.

use crate::Split;
use std::path::PathBuf;

/// Where the configuration is, and what the command line changes in it.
#[derive(clap::Args, Clone, Debug)]
pub struct ConfigArgs {
    /// The configuration file.
    #[arg(short, long, default_value = "pipeline.toml", value_name = "FILE")]
    pub config: PathBuf,
    /// Change one key of the configuration, for instance `--set extract.fps=15`; may be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl ConfigArgs {
    /// Arguments as typed, for the next command; begins with a space unless empty.
    pub fn flags(&self) -> String {
        let file = self.config.display().to_string();
        let file = if file == "pipeline.toml" { String::new() } else { format!(" -c {file}") };
        self.set.iter().fold(file, |flags, set| format!("{flags} --set {set}"))
    }

    /// Reads the configuration; where the usual file is not there, the defaults count.
    pub fn load_or_default(&self) -> anyhow::Result<orator_dataset::config::Config> {
        let is_usual = self.config == std::path::Path::new("pipeline.toml");
        if is_usual && !self.config.exists() {
            orator_dataset::config::load_default(&self.config, &self.set)
        } else {
            self.load()
        }
    }

    /// Reads the configuration, with every problem at once; a key under a former name is noted on standard error.
    pub fn load(&self) -> anyhow::Result<orator_dataset::config::Config> {
        let config = orator_dataset::config::load(&self.config, &self.set)?;
        config.notes.iter().for_each(|note| crate::cli::ui::note(&format!("note    {note}")));
        Ok(config)
    }
}

/// Reads the name of a split.
pub fn split(name: &str) -> Result<Split, String> {
    let found = Split::ALL.into_iter().find(|split| split.name() == name);
    found.ok_or_else(|| "expected train, validation or test".to_owned())
}
