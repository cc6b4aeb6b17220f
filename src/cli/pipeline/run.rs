//! `orator run`.

use super::train::train_speakers;
use crate::cli::Outcome;
use crate::cli::config_args::{ConfigArgs, DeviceArgs};
use crate::cli::sandbox::this_program;
use crate::cli::setup::models::with_models;
use crate::cli::signals;
use crate::cli::train::stopped::{report_stopped, stop_on_signal};
use crate::cli::ui::Ui;
use anyhow::Result;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use orator_base::stage::artifacts::StageName;
use orator_base::stage::progress::{Event, Progress};
use orator_base::text::{counted, first_three};
use orator_cluster::plan::ClusterPlan;
use orator_pipeline::{Pipeline, Selection, UnitFailure};
use serde_json::json;

/// Run the pipeline: extract, pose2d, segment, lift, transcribe, dataset.
///
/// Every stage runs for every video of every speaker; `transcribe` only for speakers with `transcripts = "auto"`. Stages
/// that are up to date are skipped, so an interrupted run continues when the same command is given again. A failed video
/// is reported, and the others are still processed.
///
/// With --train, a GAN is then trained for each speaker with the settings of `[gan]`, as by `orator train gan --all`,
/// and evaluated on a held-out part: gan/SPEAKER/result.html in the work folder has a film of generated beside true
/// motion, the metrics and the conclusions. A training is resumed; a model whose dataset has changed since is moved to
/// gan/SPEAKER-old and trained anew.
///
/// Exit code 2: a video failed, a speaker has no accepted interval, or a dataset lacks a video because its earlier
/// stages are not up to date or because it is listed in the plan of `orator plan` but no longer exists.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// First stage to run; defaults to extract.
    #[arg(long, value_parser = stage_parser(), value_name = "STAGE")]
    from: Option<StageName>,
    /// Last stage to run; defaults to dataset.
    #[arg(long, value_parser = stage_parser(), value_name = "STAGE")]
    to: Option<StageName>,
    /// Run only this stage.
    #[arg(long, value_parser = stage_parser(), value_name = "STAGE", conflicts_with_all = ["from", "to"])]
    only: Option<StageName>,
    /// Process only this speaker; may be repeated.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// Number of videos processed in parallel; 0 uses one per CPU core; defaults to `work.jobs` of the configuration.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Run the selected stages even where they are up to date.
    #[arg(long)]
    force: bool,
    /// Then train a model for each speaker and evaluate it.
    #[arg(long, conflicts_with_all = ["to", "only"])]
    train: bool,
}

/// Parser for the name of a stage.
fn stage_parser() -> impl TypedValueParser<Value = StageName> {
    PossibleValuesParser::new(StageName::ALL.map(StageName::as_str)).try_map(|name| name.parse::<StageName>())
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let flags = args.config.flags();
    let default = args.only.map_or_else(Selection::default, Selection::only);
    let (from, to) = (args.from.unwrap_or(default.from), args.to.unwrap_or(default.to));
    let selection = Selection { from, to, speakers: args.speaker, jobs: args.jobs, force: args.force };
    let pipeline = Pipeline::open(args.config.load()?)?.with_processes(this_program());
    let device = pipeline.config().settings.work.device;
    let device = args.train.then(|| DeviceArgs::default().open(device, || None, ui)).transpose()?;
    signals::exit_on_signal("completed stages are saved; run the same command again to continue");
    let mut report = with_models(&pipeline.config().settings, ui, || pipeline.run(&selection, ui))?;

    if selection.from == StageName::Dataset {
        // Videos of a plan were processed before: one that has been removed since is missing from the dataset.
        let plan = pipeline.config().settings.work.dir.join("plan.json");
        for unit in ClusterPlan::missing_videos(&plan, &pipeline)? {
            if !selection.speakers.is_empty() && !selection.speakers.contains(&unit.speaker) {
                continue;
            }
            let (stage, name) = (StageName::Dataset, unit.to_string());
            let (video, plan) = (unit.source.display(), plan.display());
            let error = format!(
                "the video {video} of {plan} does not exist: restore it, or write a new plan with `orator plan`"
            );
            ui.event(&Event::Failed { stage: stage.as_str(), unit: &name, error: &error });
            report.failures.push(UnitFailure { speaker: None, unit: Some(name), stage, error, cause: None });
        }
    }
    // `transcribe`, which few projects use, is longer than the other names.
    let width = report.stages.keys().map(|stage| stage.as_str().len()).fold(8, usize::max);
    let counts = |(stage, n): (&StageName, &orator_pipeline::StageCounts)| {
        format!("{stage:width$} {} done, {} up to date, {} failed", n.done, n.up_to_date, n.failed)
    };
    let mut lines: Vec<String> = report.stages.iter().map(counts).collect();
    let chosen = pipeline.videos(&selection.speakers)?;
    for videos in chosen.iter().filter(|videos| !videos.passed_over.is_empty()) {
        let (speaker, n) = (&videos.speaker, counted(videos.passed_over.len(), "file"));
        lines.push(format!("{speaker}: passed over {n} without video: {}", first_three(&videos.passed_over)));
    }
    lines.extend(report.datasets.iter().map(|dir| format!("{:width$} {}", StageName::Dataset, dir.display())));
    let n_failed = report.failures.len();
    if n_failed > 0 {
        lines.push(format!("{}; `orator status --why` prints the errors", counted(n_failed, "failure")));
    }
    let first = report.datasets.first().and_then(|dir| dir.file_name());
    let mut next = match first {
        Some(speaker) if report.datasets.len() == report.n_speakers => {
            format!("orator train gan{flags} --speaker {}", speaker.to_string_lossy())
        }
        // The errors have been printed.
        _ if n_failed > 0 => format!("orator report{flags}"),
        _ => format!("orator status{flags} --why"),
    };
    let mut facts = json!(report);
    let mut outcome = if n_failed == 0 { Outcome::Done } else { Outcome::SomeFailed };
    if let Some(device) = &device {
        stop_on_signal(ui);
        let trained = match train_speakers(&pipeline, &report.datasets, device, ui) {
            Ok(trained) => trained,
            Err(error) => return report_stopped(error, ui),
        };
        lines.push(trained.text);
        facts["models"] = json!(trained.facts);
        next = trained.next.unwrap_or(next);
        outcome = if trained.outcome == Outcome::Done { outcome } else { trained.outcome };
    }
    facts["next"] = json!(next);
    facts["passed_over"] = chosen.iter().map(|videos| (videos.speaker.clone(), json!(videos.passed_over))).collect();
    facts["work_secs"] = json!(report.times.iter().map(|time| time.secs).sum::<f64>());
    ui.summary(&lines.join("\n"), Some(&next), facts);
    Ok(outcome)
}
