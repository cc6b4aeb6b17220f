//! `orator study plan`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress as _;
use orator_study::file::{StudyFile, StudyTask};
use orator_study::folder::StudyFolder;
use orator_study::plan::TaskDesign;
use orator_study::power::{self, PowerQuestion};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Say how many participants a study needs, by simulating studies and analysing them.
///
/// Each simulated study draws its participants and clips anew and goes through the analysis of `orator study analyse`.
/// Two questions are answered: how many participants find a true share other than 50 %, and how many show equivalence
/// with 50 % where there is no difference. How much participants and clips differ has to be assumed; with 0.3 log odds one
/// in three participants (or clips) scores below 43 or above 57 % where the mean is 50 %.
#[derive(clap::Args)]
pub struct Args {
    /// The study file, or the folder of a built study.
    #[arg(value_name = "STUDY")]
    study: PathBuf,
    /// Task that is planned for [default: the first one against chance]
    #[arg(long, value_name = "NAME")]
    task: Option<String>,
    /// Wanted power, a share.
    #[arg(long, value_name = "SHARE", default_value_t = 0.9)]
    power: f64,
    /// True share that is to be found different from 50 %, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 55.0)]
    effect: f64,
    /// Bound of equivalence, points of percent [default: the registered one, else 10]
    #[arg(long, value_name = "POINTS")]
    bound: Option<f64>,
    /// How much participants differ: standard deviation, log odds; the mixed model of `orator study analyse` estimates it.
    #[arg(long, value_name = "SD", default_value_t = 0.3)]
    participant_sd: f64,
    /// How much clips differ: standard deviation, log odds.
    #[arg(long, value_name = "SD", default_value_t = 0.3)]
    clip_sd: f64,
    /// Clips of the task [default: as the study has them]
    #[arg(long, value_name = "N")]
    clips: Option<usize>,
    /// Simulated studies for each number of participants.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    simulations: usize,
    /// Seed of the simulations.
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
    let plan = power::plan(&question, &|row| bar.detail(&format!("{} participants", row.n_participants)))?;
    drop(bar);
    let secs = started.elapsed().as_secs_f64();
    let text = format!("task {}\n{}\nsimulated in {secs:.1} s", task.name, power::text(&plan));
    let wanted = plan.difference.n_participants.max(plan.equivalence.n_participants);
    let next = match wanted {
        Some(n) if n != study.participants => {
            format!("write participants = {n} into {}, then orator study build {}", file.display(), file.display())
        }
        _ => format!("orator study build {}", file.display()),
    };
    ui.summary(&text, Some(&next), json!({ "task": task.name, "plan": plan, "secs": secs }));
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
            .with_context(|| format!("--task: no task is called {name}; tasks are {}", names()))?,
        None => study.task.iter().find(has_chance).with_context(|| {
            format!(
                "{}: no task is judged against chance (tasks: {}); power is planned for such tasks",
                args.study.display(),
                names()
            )
        })?,
    };
    ensure!(
        has_chance(&found),
        "--task {}: preferences and sliders have no chance level; power is planned for tasks judged against chance",
        found.name
    );
    Ok(found)
}

/// Number of clips of all speakers, at least as many as a participant is shown.
fn n_clips(study: &StudyFile, task: &StudyTask) -> usize {
    let written: usize = study.speaker.iter().filter_map(|speaker| speaker.clips).sum();
    written.max(task.trials)
}
