//! Pre-registration, fixed before the first participant: number of participants, tasks, hypotheses with their test
//! statistics, exclusion rules and analysis settings. The analysis marks everything else as exploratory.

use super::file::{AnalysisSettings, ExclusionRules, HypothesisKind, StudyFile, StudyHypothesis};
use super::plan::TaskDesign;
use anyhow::{Context, Result, ensure};
use orator_base::stage::workdir;
use serde::{Deserialize, Serialize};
use std::path::Path;

const VERSION: u32 = 1;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Preregistration {
    pub version: u32,
    /// Program and version that wrote the file.
    pub program: String,
    pub title: String,
    /// Target number of participants who complete the study and are not excluded; collection ends when it is reached.
    pub participants: usize,
    pub sessions: usize,
    pub tasks: Vec<RegisteredTask>,
    pub hypotheses: Vec<RegisteredHypothesis>,
    pub exclusion: ExclusionRules,
    pub analysis: AnalysisSettings,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegisteredTask {
    pub name: String,
    pub design: TaskDesign,
    pub conditions: Vec<String>,
    /// Analysed trials per participant.
    pub trials: usize,
    pub votes: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegisteredHypothesis {
    pub claim: StudyHypothesis,
    /// Description: estimate, standard error, test, adjustment.
    pub statistic: String,
}

impl Preregistration {
    pub fn new(file: &StudyFile) -> Self {
        let registered = |claim: &StudyHypothesis| {
            let design = file.task.iter().find(|task| task.name == claim.task).map(|task| task.design);
            RegisteredHypothesis { claim: claim.clone(), statistic: statistic(claim, design, file.analysis.alpha) }
        };
        let tasks = file.task.iter().map(|task| RegisteredTask {
            name: task.name.clone(),
            design: task.design,
            conditions: task.conditions.clone(),
            trials: task.trials,
            votes: task.trials * file.participants,
        });
        Self {
            version: VERSION,
            program: concat!("orator ", env!("CARGO_PKG_VERSION")).to_owned(),
            title: file.title.clone(),
            participants: file.participants,
            sessions: file.n_sessions(),
            tasks: tasks.collect(),
            hypotheses: file.hypothesis.iter().map(registered).collect(),
            exclusion: file.exclusion.clone(),
            analysis: file.analysis.clone(),
        }
    }

    /// Writes the file atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        workdir::write_file(path, &serde_json::to_vec_pretty(self)?)
    }

    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| {
            format!("cannot read the pre-registration {}; `orator study build` creates it", path.display())
        })?;
        let read: Self = serde_json::from_slice(&bytes).with_context(|| {
            format!("{} is damaged: restore the file or rebuild the study in a new folder", path.display())
        })?;
        let (found, path) = (read.version, path.display());
        ensure!(
            found == VERSION,
            "{path} has version {found}, expected {VERSION}: use the version of orator that wrote it"
        );
        Ok(read)
    }
}

fn statistic(claim: &StudyHypothesis, design: Option<TaskDesign>, alpha: f64) -> String {
    let error = "with a standard error for crossed participants and clips and a t distribution";
    let share = match design {
        Some(TaskDesign::Mismatch) => "share of votes for the matching film",
        _ => "share of correct responses",
    };
    let test = match claim.kind {
        HypothesisKind::DiffersFromChance => format!("two-sided test of the {share} against 50 %, {error}"),
        HypothesisKind::GreaterThanChance => {
            format!("two-sided test of the {share} against 50 %, {error}; the share must be above 50 %")
        }
        HypothesisKind::Equivalence => {
            let points = claim.points.unwrap_or_default();
            format!("two one-sided tests of the {share} against 50 % - {points} and 50 % + {points}, {error}")
        }
        HypothesisKind::Differs => {
            let difference = match design {
                Some(TaskDesign::Preference) => "mean preference step between two conditions against 0",
                Some(TaskDesign::TuringSingle) => {
                    "difference between the shares of films judged real of two conditions against 0"
                }
                _ => "mean difference between the scores of two conditions on the same page against 0",
            };
            format!("two-sided test of the {difference}, {error}")
        }
    };
    let is_one = !claim.per_speaker && claim.conditions.is_empty() && claim.kind != HypothesisKind::Differs;
    let adjustment = match is_one || claim.kind == HypothesisKind::Equivalence {
        true => "",
        false => ", Holm-adjusted p if the task has several such tests",
    };
    format!("{test}, alpha {alpha}{adjustment}")
}
