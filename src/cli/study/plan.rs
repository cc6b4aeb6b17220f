//! `orator study plan`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress as _;
use orator_base::text::counted;
use orator_study::file::{StudyFile, StudyTask};
use orator_study::folder::StudyFolder;
use orator_study::plan::TaskDesign;
use orator_study::power::{self, PowerQuestion};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Find the number of participants for a study, by simulation.
///
/// Each simulated study draws new participants and clips and runs the analysis of `orator study analyse`. Two numbers
/// are estimated: the participants needed to detect a true share other than 50 %, and the participants needed to show
/// equivalence with 50 % if there is no difference. The variation between participants and between clips has to be
/// assumed: with 0.3 log odds, one in three participants (or clips) scores below 43 or above 57 % if the mean is 50
/// %.
#[derive(clap::Args)]
pub struct Args {
    /// Study file, or folder of a built study.
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// Task to plan for; defaults to the first one with a chance level.
    #[arg(long, value_name = "NAME")]
    task: Option<String>,
    /// Required statistical power, 0 to 1.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.9)]
    power: f64,
    /// True share to be detected as different from 50 %, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 55.0)]
    effect: f64,
    /// Equivalence bound, percentage points; defaults to the registered one, else to 10.
    #[arg(long, value_name = "POINTS")]
    bound: Option<f64>,
    /// Standard deviation between participants, log odds; the mixed model of `orator study analyse` estimates it.
    #[arg(long, value_name = "SD", default_value_t = 0.3)]
    participant_sd: f64,
    /// Standard deviation between clips, log odds.
    #[arg(long, value_name = "SD", default_value_t = 0.3)]
    clip_sd: f64,
    /// Number of clips of the task; defaults to that of the study.
    #[arg(long, value_name = "N")]
    clips: Option<usize>,
    /// Number of simulated studies for each number of participants.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    simulations: usize,
    /// Random seed of the simulations.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let file = if args.study.is_dir() { StudyFolder::new(&args.study).study_file() } else { args.study.clone() };
    let study = StudyFile::read(&file)?;
    let task = task(args, &study)?;
    let mut registered = study.hypothesis.iter().filter(|hypothesis| hypothesis.task == task.name);
    let registered = registered.find_map(|hypothesis| hypothesis.points);
    let question = PowerQuestion {
        n_trials: task.trials,
        n_clips: args.clips.unwrap_or_else(|| n_clips(&study, task)),
        sd_participants: args.participant_sd,
        sd_clips: args.clip_sd,
        power: args.power,
        effect: args.effect / 100.0,
        bound: args.bound.or(registered).unwrap_or(10.0) / 100.0,
        n_simulations: args.simulations,
        seed: args.seed,
    };
    let started = Instant::now();
    let bar = ui.begin("simulating studies", 0);
    let plan = power::plan(&question, &|row| bar.detail(&counted(row.n_participants, "participant")))?;
    drop(bar);
    let secs = started.elapsed().as_secs_f64();
    let text = format!("task {}\n{}\nsimulated in {secs:.1} s", task.name, power::text(&plan));
    let needed = plan.difference.n_participants.max(plan.equivalence.n_participants);
    let next = match needed {
        Some(n) if n != study.participants => {
            format!("set participants = {n} in {}, then run orator study build {}", file.display(), file.display())
        }
        _ => format!("orator study build {}", file.display()),
    };
    ui.summary(&text, Some(&next), json!({ "task": task.name, "plan": plan, "secs": secs, "next": next }));
    Ok(Outcome::Done)
}

/// The named task, or the first whose answers have a chance level.
fn task<'s>(args: &Args, study: &'s StudyFile) -> Result<&'s StudyTask> {
    let has_chance = |task: &&StudyTask| !matches!(task.design, TaskDesign::Preference | TaskDesign::Sliders);
    let names = || study.task.iter().map(|task| task.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = match &args.task {
        Some(name) => study
            .task
            .iter()
            .find(|task| task.name == *name)
            .with_context(|| format!("--task {name}: no such task; tasks: {}", names()))?,
        None => study.task.iter().find(has_chance).with_context(|| {
            format!(
                "{}: no task has a chance level (tasks: {}); power analysis requires one",
                args.study.display(),
                names()
            )
        })?,
    };
    ensure!(
        has_chance(&found),
        "--task {}: preferences and sliders have no chance level; power analysis requires one",
        found.name
    );
    Ok(found)
}

/// Number of clips of all speakers, at least as many as a participant is shown.
fn n_clips(study: &StudyFile, task: &StudyTask) -> usize {
    let written: usize = study.speaker.iter().filter_map(|speaker| speaker.clips).sum();
    written.max(task.trials)
}
