//! Verbs that moved to `orator-lab`: the error for their old names.

use super::program::Outcome;
use anyhow::{Result, bail};

/// A verb that `orator` had before version 0.2; its arguments are accepted and ignored.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub struct MovedVerb {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<String>,
}

impl MovedVerb {
    /// Fails with the command that replaces `orator VERB`.
    pub fn fail(self, verb: &str) -> Result<Outcome> {
        let arguments = self.rest.iter().map(|argument| format!(" {argument}")).collect::<String>();
        bail!("`orator {verb}` has moved to another program: run `orator-lab {verb}{arguments}`")
    }
}
