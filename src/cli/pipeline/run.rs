//! `orator run`.

use super::steps;
use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::ui::Ui;
use anyhow::{Context, Result};
use orator::config::Config;
use orator::config::videos::Videos;
use orator::stage::artifacts;
use orator::stage::artifacts::StageName;
use orator::stage::fingerprint::HashCache;
use orator::stage::progress::Progress;
use orator::stage::runner;
use orator::stage::runner::Ended;
use orator::stage::{Stage, Unit, workdir};
use serde_json::{Value, json};

/// Run the stages extract, pose2d, segment, lift, dataset for every video of every speaker.
///
/// What is fresh is not done again: a run that was killed goes on where it was. A video that fails is reported and
/// the others go on. Exit code 2 says that some failed or that a speaker ended with no interval.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Begin with this stage.
    #[arg(long, value_parser = steps::stage_parser(), value_name = "STAGE")]
    from: Option<StageName>,
    /// End with this stage.
    #[arg(long, value_parser = steps::stage_parser(), value_name = "STAGE")]
    to: Option<StageName>,
    /// Run this stage alone.
    #[arg(long, value_parser = steps::stage_parser(), value_name = "STAGE", conflicts_with_all = ["from", "to"])]
    only: Option<StageName>,
    /// Only this speaker; may be given several times.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// Videos worked on side by side; 0: one a processor core. Default: work.jobs of the configuration.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Do the chosen stages again, also where they are fresh.
    #[arg(long)]
    force: bool,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let config = args.config.load()?;
    let (from, to) = match args.only {
        Some(step) => (step, step),
        None => (args.from.unwrap_or(StageName::Extract), args.to.unwrap_or(StageName::Dataset)),
    };
    anyhow::ensure!(from <= to, "--from {} comes after --to {}", from.as_str(), to.as_str());
    let speakers = steps::speakers(&config, &args.speaker)?;
    if (from..=to).contains(&StageName::Pose2d) {
        steps::check_models(&config.settings)?;
    }
    // What a stage needs (weights, the manifest) is looked at before hours of work, not after.
    for step in StageName::ALL.into_iter().filter(|step| (from..=to).contains(step)) {
        steps::stage(step, &config, &[])?;
    }
    let work = &config.settings.work.dir;
    let _lock = workdir::lock(work).context("no run now; another folder is chosen with --set work.dir=FOLDER")?;
    let hashes = HashCache::open(&artifacts::hashes(work));
    let mut run = Run {
        config: &config,
        hashes: &hashes,
        jobs: jobs(&args, &config),
        force: args.force,
        flags: args.config.flags(),
        ui,
        log: Log::default(),
    };
    for videos in &speakers {
        for message in &videos.missing {
            ui.say(&format!("failed  {}: {message}", videos.speaker));
            run.log
                .failures
                .push(json!({ "speaker": videos.speaker, "stage": StageName::Extract.as_str(), "error": message }));
        }
    }
    let mut alive = speakers.clone();
    let chosen = || StageName::ALL.into_iter().filter(|step| (from..=to).contains(step));
    run.steps(&chosen().filter(|step| *step != StageName::Dataset).collect::<Vec<_>>(), &mut alive)?;
    run.steps(&chosen().filter(|step| *step == StageName::Dataset).collect::<Vec<_>>(), &mut alive)?;
    run.close(speakers.len())
}

fn jobs(args: &Args, config: &Config) -> usize {
    match args.jobs.unwrap_or(config.settings.work.jobs) {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    }
}

struct Run<'a> {
    config: &'a Config,
    hashes: &'a HashCache,
    jobs: usize,
    force: bool,
    /// The configuration's arguments, for the next command.
    flags: String,
    ui: &'a Ui,
    log: Log,
}

/// What the closing summary says.
#[derive(Default)]
struct Log {
    lines: Vec<String>,
    stages: serde_json::Map<String, Value>,
    failures: Vec<Value>,
    /// Speakers whose dataset stands.
    datasets: Vec<String>,
    reports: Vec<Value>,
}

impl Run<'_> {
    /// Runs these stages, which have the same units, for everything alive; what fails is not alive for later ones.
    fn steps(&mut self, steps: &[StageName], alive: &mut [Videos]) -> Result<()> {
        let Some(&first) = steps.first() else { return Ok(()) };
        let units: Vec<Unit> = alive.iter().flat_map(|videos| steps::units(first, self.config, videos)).collect();
        let videos = self.dataset_videos(first, alive)?;
        let stages = steps.iter().map(|step| steps::stage(*step, self.config, &videos)).collect::<Result<Vec<_>>>()?;
        let stages: Vec<&dyn Stage> = stages.iter().map(|stage| &**stage).collect();
        let work = &self.config.settings.work.dir;
        let ended = runner::run_stages(&stages, &units, work, self.hashes, (self.jobs, self.force), self.ui);
        self.hashes.save()?;
        let mut counts = vec![[0usize; 3]; steps.len()];
        let mut failed_units = Vec::new();
        for (unit, answers) in units.iter().zip(ended) {
            for ((step, counts), answer) in steps.iter().zip(&mut counts).zip(answers) {
                let (state, word) = match &answer {
                    Ended::Done(_) => (0, "done"),
                    Ended::Skipped(_) => (1, "fresh"),
                    Ended::Failed(_) => (2, "failed"),
                };
                counts[state] += 1;
                match answer {
                    Ended::Done(made) | Ended::Skipped(made) => self.log.reports.push(json!({
                        "unit": unit.to_string(), "stage": step.as_str(), "state": word,
                        "line": made.line, "facts": made.facts,
                    })),
                    Ended::Failed(error) => {
                        failed_units.push(unit.speaker.clone());
                        let unit_name = unit.to_string();
                        self.log.failures.push(json!({ "unit": unit_name, "stage": step.as_str(), "error": error }));
                        for videos in alive.iter_mut().filter(|videos| videos.speaker == unit.speaker) {
                            videos.units.retain(|alive| alive != unit);
                        }
                    }
                }
            }
        }
        if first == StageName::Dataset {
            self.log.datasets = alive
                .iter()
                .filter(|videos| !failed_units.contains(&videos.speaker))
                .map(|videos| videos.speaker.clone())
                .collect();
        }
        for (step, [done, fresh, failed]) in steps.iter().zip(counts) {
            self.log.lines.push(format!("{:8} {done} done, {fresh} fresh already, {failed} failed", step.as_str()));
            self.log.stages.insert(step.as_str().to_owned(), json!({ "done": done, "fresh": fresh, "failed": failed }));
        }
        Ok(())
    }

    /// The videos the datasets are made of; those that are not ready are named and left out.
    fn dataset_videos(&self, step: StageName, alive: &[Videos]) -> Result<Vec<Unit>> {
        let mut all_ready = Vec::new();
        for videos in alive.iter().filter(|_| step == StageName::Dataset) {
            let ready = steps::ready(self.config, videos, self.hashes)?;
            for unit in videos.units.iter().filter(|unit| !ready.contains(unit)) {
                self.ui.say(&format!("left out of the dataset: {unit} (`orator status --why` says why)"));
            }
            all_ready.extend(ready);
        }
        Ok(all_ready)
    }

    fn close(self, n_speakers: usize) -> Result<Outcome> {
        let work = &self.config.settings.work.dir;
        let mut lines = self.log.lines;
        let datasets: Vec<_> =
            self.log.datasets.iter().map(|speaker| artifacts::speaker_dir(work, StageName::Dataset, speaker)).collect();
        lines.extend(datasets.iter().map(|dir| format!("dataset  {}", dir.display())));
        let failures = self.log.failures.len();
        if failures > 0 {
            lines.push(format!("{failures} failed; `orator status --why` says each error again"));
        }
        let next = match self.log.datasets.first() {
            Some(speaker) if datasets.len() == n_speakers => {
                format!("orator train gan{} --speaker {speaker}", self.flags)
            }
            _ => format!("orator status{} --why", self.flags),
        };
        let facts = json!({
            "stages": self.log.stages, "failures": self.log.failures, "units": self.log.reports,
            "datasets": datasets, "next": next,
        });
        self.ui.summary(&lines.join("\n"), Some(&next), facts);
        Ok(if failures == 0 { Outcome::Done } else { Outcome::SomeFailed })
    }
}
