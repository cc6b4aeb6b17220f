//! `orator status`.

use crate::cli::Outcome;
use crate::cli::cluster::plan::show_progress;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator_base::stage::artifacts;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::ledger::longest_first;
use orator_base::text::counted;
use orator_pipeline::{ModelStatus, Pipeline, StagePlan, StaleResult, StatusReport, TimeBudget, UnitState, UnitStatus};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Maximum number of reasons shown for a stage; `--json` lists all.
const REASONS_SHOWN: usize = 3;

/// Show the state of every stage and the use of every second of video.
///
/// A stage of a video is up to date, stale, failed, or waiting for an earlier stage. A second of video is accepted,
/// rejected with a reason, missing because a stage failed, or not yet decided. The model of a speaker is stale if its
/// dataset has changed since. Stale models, and datasets made by an older lifter, are listed with the command that
/// rebuilds them.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Show only this speaker; may be repeated.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// Show the progress of the workers of this plan instead: active workers, speed, time left, and failures by
    /// reason.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["config", "set", "speaker", "why"])]
    plan: Option<PathBuf>,
    /// Print why each stage is stale, its error if it failed, its report if it is up to date, and what a run would
    /// do.
    #[arg(long)]
    why: bool,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    if let Some(plan) = &args.plan {
        return show_progress(plan, ui);
    }
    let pipeline = Pipeline::open(args.config.load()?)?;
    let work = &pipeline.config().settings.work.dir;
    enter_sandbox([artifacts::hashes(work).as_path()], [&**work]);
    let mut report = pipeline.status(&args.speaker)?;
    let flags = args.config.flags();
    for stale in &mut report.stale {
        stale.command = format!("orator {}{flags}", stale.command);
    }
    let is_new = |unit: &UnitStatus| matches!(unit.state, UnitState::Stale | UnitState::NeverDone);
    let is_trained = |model: &ModelStatus| model.state == UnitState::UpToDate;
    let speakers = &pipeline.config().settings.speaker;
    let trains_again = |model: &ModelStatus| {
        model.state == UnitState::Stale && speakers.iter().any(|of| model.name == format!("gan/{}", of.name))
    };
    let next = match report.models.first() {
        _ if !report.datasets_are_up_to_date() => {
            if report.units.iter().any(is_new) {
                format!("orator run{flags}")
            } else if args.why {
                // A run would only repeat the failures.
                format!("orator report{flags}")
            } else {
                format!("orator status{flags} --why")
            }
        }
        Some(first) if report.models.iter().all(is_trained) => {
            let model = work.join(&first.name);
            format!("orator generate --checkpoint {} --audio speech.wav --out motion.bvh", model.display())
        }
        _ if report.models.iter().any(trains_again) => format!("orator run --train{flags}"),
        // Models of other networks or of several speakers.
        _ => report.stale.first().map_or_else(|| format!("orator train gan{flags}"), |stale| stale.command.clone()),
    };
    let mut facts = json!(report);
    facts["next"] = json!(next);
    ui.summary(&text(&report, args.why), Some(&next), facts);
    Ok(Outcome::Done)
}

fn text(report: &StatusReport, why: bool) -> String {
    let units: Vec<&UnitStatus> = report.units.iter().filter(|unit| unit.state != UnitState::NoVideo).collect();
    let rows: Vec<&[&UnitStatus]> = units.chunk_by(|a, b| a.unit == b.unit).collect();
    let names = units.iter().map(|unit| &unit.unit).chain(report.time_budget.iter().map(|account| &account.unit));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("seconds".len());
    let stages: BTreeSet<StageName> = units.iter().map(|unit| unit.stage).collect();
    let row = |name: &str, word: &dyn Fn(&StageName) -> String| {
        let words: Vec<String> = stages.iter().map(|stage| format!("{:10}", word(stage))).collect();
        format!("{name:width$} {}", words.join(" ")).trim_end().to_owned()
    };
    let mut lines = vec![row("", &StageName::to_string)];
    for of_unit in rows {
        let state = |stage: &StageName| of_unit.iter().find(|unit| unit.stage == *stage).map(|unit| unit.state);
        let word = |stage: &StageName| state(stage).map(|state| state.to_string()).unwrap_or_default();
        lines.push(row(&of_unit[0].unit, &word));
    }
    let headings = ["accepted", "rejected", "failed", "waiting", "duration"].map(|name| format!("{name:>9}")).join("");
    lines.extend([String::new(), format!("{:width$}{headings}  rejected for", "seconds")]);
    lines.extend(report.time_budget.iter().map(|account| seconds(account, width)));
    lines.push(consistency(&report.total));
    let not_judged = |account: &TimeBudget| account.not_judged.as_ref().map(|note| format!("{}: {note}", account.unit));
    lines.extend(report.time_budget.iter().filter_map(not_judged));
    let offset = |account: &TimeBudget| account.sound_offset.map(|offset| format!("{}: {offset}", account.unit));
    lines.extend(report.time_budget.iter().filter_map(offset));
    let model = |model: &ModelStatus| {
        let step = model.step.map(|step| format!(", step {step}")).unwrap_or_default();
        let reason = if model.reason.is_empty() { String::new() } else { format!(": {}", model.reason) };
        format!("model {}: {}{step}{reason}", model.name, model.state)
    };
    lines.extend(report.models.iter().filter(|model| model.state != UnitState::Stale).map(model));
    let rebuild = |StaleResult { name, reason, command }: &StaleResult| format!("{name}: {reason}: {command}");
    lines.extend(report.stale.iter().map(rebuild));
    if why {
        lines.push(String::new());
        lines.extend(report.units.iter().map(|UnitStatus { unit, stage, state, reason }| match state {
            UnitState::NoVideo => format!("{unit}: {reason}"),
            _ => format!("{unit} {stage}: {state}: {reason}"),
        }));
        lines.push(String::new());
        let width = report.plan.iter().map(|plan| plan.stage.as_str().len()).fold(8, usize::max);
        lines.extend(report.plan.iter().map(|of| plan(of, width)));
    }
    lines.join("\n")
}

/// A row of the table of seconds.
fn seconds(account: &TimeBudget, width: usize) -> String {
    let known = account.duration > 0.0 || account.n_unknown == 0;
    let secs = [account.accepted, account.rejected_secs(), account.failed, account.waiting, account.duration];
    let secs = secs.map(|secs| if known { format!("{secs:9.2}") } else { format!("{:>9}", "?") }).join("");
    format!("{:width$}{secs}  {}", account.unit, longest_first(&account.rejected)).trim_end().to_owned()
}

/// Whether all seconds add up.
fn consistency(total: &TimeBudget) -> String {
    let unknown = match total.n_unknown {
        0 => String::new(),
        n => format!("; the duration of {} is unknown (?)", counted(n, "failed video")),
    };
    match total.n_mismatched {
        0 => format!("accepted + rejected + failed + waiting = duration, within one frame per video{unknown}"),
        n => format!(
            "ERROR: the seconds of {} do not add up to the duration; run the stage segment again{unknown}",
            counted(n, "video")
        ),
    }
}

/// What `orator run` would do for a stage, and why; its name has `width` characters.
fn plan(plan: &StagePlan, width: usize) -> String {
    let StagePlan { stage, up_to_date, would_run, reasons } = plan;
    let shown: Vec<&str> = reasons.iter().map(String::as_str).take(REASONS_SHOWN).collect();
    let more = reasons.len().saturating_sub(shown.len());
    let more = if more == 0 { String::new() } else { format!("; {}", counted(more, "other reason")) };
    let why = if *would_run == 0 { String::new() } else { format!(": {}{more}", shown.join("; ")) };
    format!("{stage:width$} {up_to_date} up to date, {would_run} to run{why}")
}
