//! `orator status`.

use super::config_args::ConfigArgs;
use super::road::{self, STEPS, Step};
use super::{Outcome, ui::Ui};
use anyhow::Result;
use orator::config::Config;
use orator::stage::fingerprint::HashCache;
use orator::stage::record::DirtyReason;
use orator::stage::runner::{self, State};
use orator::stage::{Stage, Unit};
use serde_json::json;

/// Show every stage of every video: fresh, stale, failed, or waiting for an earlier stage.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Only this speaker; may be given several times.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// Say why a stage is stale, what the error was, and what a fresh stage reported.
    #[arg(long)]
    why: bool,
}

/// One cell of the table: how it stands in a word, and why.
struct Cell {
    word: &'static str,
    why: String,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let config = args.config.load()?;
    let hashes = HashCache::open(&config.settings.work.dir.join("hashes.json"));
    let mut lines = vec![format!("{:44} {}", "", STEPS.map(|step| format!("{:8}", step.name())).join(" "))];
    let (mut whys, mut facts, mut datasets_fresh) = (Vec::new(), Vec::new(), true);
    for videos in road::speakers(&config, &args.speaker)? {
        for message in &videos.missing {
            whys.push(format!("{}: {message}", videos.speaker));
            facts.push(json!({ "unit": videos.speaker, "stage": "extract", "state": "failed", "why": message }));
        }
        let ready = road::ready(&config, &videos, &hashes).unwrap_or_default();
        let stages: Vec<_> = STEPS.iter().map(|step| step.stage(&config, &ready)).collect();
        let mut speaker_waits_for = None;
        let mut rows: Vec<(Unit, Vec<(Step, Cell)>)> = Vec::new();
        for unit in &videos.units {
            let mut waits_for = None;
            let per_video = STEPS.into_iter().zip(&stages).take(4);
            let cells: Vec<_> = per_video
                .map(|(step, stage)| (step, cell(step, stage, unit, &config, &hashes, &mut waits_for)))
                .collect();
            // The dataset is made without a video that failed; it waits for those that can still come.
            let failed = cells.iter().any(|(_, cell)| cell.word == "failed");
            speaker_waits_for = speaker_waits_for.or(waits_for.filter(|_| !failed));
            rows.push((unit.clone(), cells));
        }
        for unit in Step::Shard.units(&config, &videos) {
            let cell =
                cell(Step::Shard, &stages[Step::Shard as usize], &unit, &config, &hashes, &mut speaker_waits_for);
            rows.push((unit, vec![(Step::Shard, cell)]));
        }
        for (unit, cells) in rows {
            let word = |step: &Step| cells.iter().find(|(of, _)| of == step).map_or("", |(_, cell)| cell.word);
            lines.push(format!("{:44} {}", unit.to_string(), STEPS.map(|step| format!("{:8}", word(&step))).join(" ")));
            for (step, cell) in &cells {
                datasets_fresh &= cell.word == "fresh" || *step != Step::Shard;
                whys.push(format!("{unit} {}: {}: {}", step.name(), cell.word, cell.why));
                facts.push(
                    json!({ "unit": unit.to_string(), "stage": step.name(), "state": cell.word, "why": cell.why }),
                );
            }
        }
    }
    if args.why {
        lines.push(String::new());
        lines.extend(whys);
    }
    hashes.save().unwrap_or_default();
    let verb = if datasets_fresh { "train gan" } else { "run" };
    let next = format!("orator {verb}{}", args.config.flags());
    ui.summary(&lines.join("\n"), Some(&next), json!({ "units": facts, "next": next }));
    Ok(Outcome::Done)
}

/// How `unit` stands at a stage, given the first stage before it that is not fresh.
fn cell(
    step: Step,
    stage: &Result<Box<dyn Stage>>,
    unit: &Unit,
    config: &Config,
    hashes: &HashCache,
    waits_for: &mut Option<Step>,
) -> Cell {
    let stage = match stage {
        Ok(stage) => stage,
        Err(error) => return Cell { word: "failed", why: format!("{error:#}") },
    };
    let state = match waits_for {
        Some(earlier) => State::Stale(DirtyReason::WaitsFor { stage: earlier.name().to_owned() }),
        None => runner::state(&**stage, unit, &config.settings.work.dir, hashes),
    };
    if !matches!(state, State::Fresh(_)) {
        waits_for.get_or_insert(step);
    }
    match state {
        State::Fresh(record) => Cell { word: "fresh", why: record.line },
        State::Stale(why @ DirtyReason::NeverDone) => Cell { word: "-", why: why.to_string() },
        State::Stale(why @ DirtyReason::WaitsFor { .. }) => Cell { word: "waits", why: why.to_string() },
        State::Stale(why) => Cell { word: "stale", why: why.to_string() },
        State::Failed(error) => Cell { word: "failed", why: error },
    }
}
