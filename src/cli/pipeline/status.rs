//! `orator status`: how every unit stands at every stage; the seconds are `account`'s.

use super::account::{Account, Standing};
use super::steps;
use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::ui::Ui;
use anyhow::Result;
use orator::config::Config;
use orator::stage::artifacts;
use orator::stage::artifacts::StageName;
use orator::stage::fingerprint::HashCache;
use orator::stage::record::DirtyReason;
use orator::stage::runner;
use orator::stage::runner::State;
use orator::stage::{Stage, Unit};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Reasons of a stage's plan that are written out; `--json` has all.
const REASONS_SHOWN: usize = 3;

/// Show every stage of every video (fresh, stale, failed, or waiting for an earlier stage), and what became of every
/// second: kept, refused for which reason, lost to a failed stage, or waiting for a verdict.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Only this speaker; may be given several times.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// Say why a stage is stale, what the error was, what a fresh stage reported, and what a run would do.
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
    let work = &config.settings.work.dir;
    let hashes = HashCache::open(&artifacts::hashes(work));
    let mut told = Told::default();
    for videos in steps::speakers(&config, &args.speaker)? {
        for message in &videos.missing {
            told.whys.push(format!("{}: {message}", videos.speaker));
            let fact = json!({ "unit": videos.speaker, "stage": StageName::Extract.as_str(), "state": "failed", "why": message });
            told.facts.push(fact);
        }
        let ready = steps::ready(&config, &videos, &hashes).unwrap_or_default();
        let stages: Vec<_> = StageName::ALL.iter().map(|step| steps::stage(*step, &config, &ready)).collect();
        let mut speaker_waits_for = None;
        let mut total = Account::default();
        for unit in &videos.units {
            let mut waits_for = None;
            let per_video = StageName::ALL.into_iter().zip(&stages).take(4);
            let cells: Vec<_> = per_video
                .map(|(step, stage)| (step, cell(step, stage, unit, &config, &hashes, &mut waits_for)))
                .collect();
            // The dataset is made without a video that failed; it waits for those that can still come.
            let failed = cells.iter().find(|(_, cell)| cell.word == "failed");
            speaker_waits_for = speaker_waits_for.or(waits_for.filter(|_| failed.is_none()));
            let standing = match (failed, waits_for) {
                (Some((step, cell)), _) => Standing::Failed { stage: step.as_str(), error: &cell.why },
                (None, Some(_)) => Standing::Waiting,
                (None, None) => Standing::Judged,
            };
            let account = Account::of(work, unit, standing, cells[0].1.word == "fresh");
            total.add(&account);
            told.account(&unit.to_string(), &account, "video");
            told.cells(unit, &cells);
        }
        told.account(&videos.speaker, &total, "speaker");
        told.total.add(&total);
        for unit in steps::units(StageName::Dataset, &config, &videos) {
            let stage = &stages[StageName::Dataset as usize];
            let cell = cell(StageName::Dataset, stage, &unit, &config, &hashes, &mut speaker_waits_for);
            told.cells(&unit, &[(StageName::Dataset, cell)]);
        }
    }
    hashes.save().unwrap_or_default();
    let verb = if told.datasets_stale { "run" } else { "train gan" };
    let next = format!("orator {verb}{}", args.config.flags());
    let facts = json!({
        "units": told.facts, "plan": told.plan_facts(), "account": told.account_facts,
        "adds_up": told.total.n_wrong == 0, "next": next,
    });
    ui.summary(&told.text(args.why), Some(&next), facts);
    Ok(Outcome::Done)
}

/// What there is to say, as it comes together.
#[derive(Default)]
struct Told {
    /// Units, each with a word a stage.
    rows: Vec<(String, [&'static str; StageName::ALL.len()])>,
    whys: Vec<String>,
    facts: Vec<Value>,
    accounts: Vec<(String, Account)>,
    account_facts: Vec<Value>,
    total: Account,
    /// Of each stage how many units stay fresh, how many would run, and the reasons for that.
    plan: BTreeMap<StageName, (usize, usize, BTreeSet<String>)>,
    datasets_stale: bool,
}

impl Told {
    fn cells(&mut self, unit: &Unit, cells: &[(StageName, Cell)]) {
        let word = |step: &StageName| cells.iter().find(|(of, _)| of == step).map_or("", |(_, cell)| cell.word);
        self.rows.push((unit.to_string(), StageName::ALL.map(|step| word(&step))));
        for (step, cell) in cells {
            let (unit, name) = (unit.to_string(), step.as_str());
            self.datasets_stale |= cell.word != "fresh" && *step == StageName::Dataset;
            self.whys.push(format!("{unit} {name}: {}: {}", cell.word, cell.why));
            self.facts.push(json!({ "unit": unit, "stage": name, "state": cell.word, "why": cell.why }));
            let (n_fresh, n_run, reasons) = self.plan.entry(*step).or_default();
            if cell.word == "fresh" {
                *n_fresh += 1;
            } else {
                *n_run += 1;
                reasons.insert(cell.why.clone());
            }
        }
    }

    fn account(&mut self, name: &str, account: &Account, of: &str) {
        let mut fact = account.json(name);
        fact["kind"] = of.into();
        self.account_facts.push(fact);
        self.accounts.push((name.to_owned(), account.clone()));
    }

    /// A line a stage: what `orator run` would do, and why.
    fn plan_lines(&self) -> Vec<String> {
        let line = |(step, (n_fresh, n_run, reasons)): (&StageName, &(usize, usize, BTreeSet<String>))| {
            let shown: Vec<&str> = reasons.iter().map(String::as_str).take(REASONS_SHOWN).collect();
            let more = reasons.len().saturating_sub(shown.len());
            let more = if more == 0 { String::new() } else { format!("; {more} other reasons") };
            let why = if *n_run == 0 { String::new() } else { format!(": {}{more}", shown.join("; ")) };
            format!("{:8} {n_fresh} stay fresh, {n_run} would run{why}", step.as_str())
        };
        self.plan.iter().map(line).collect()
    }

    fn plan_facts(&self) -> Vec<Value> {
        let fact = |(step, (n_fresh, n_run, reasons)): (&StageName, &(usize, usize, BTreeSet<String>))| json!({ "stage": step.as_str(), "stay_fresh": n_fresh, "would_run": n_run, "because": reasons });
        self.plan.iter().map(fact).collect()
    }

    fn text(&self, why: bool) -> String {
        let names = self.rows.iter().map(|(name, _)| name).chain(self.accounts.iter().map(|(name, _)| name));
        let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("seconds".len());
        let row = |name: &str, words: [&str; StageName::ALL.len()]| {
            format!("{name:width$} {}", words.map(|word| format!("{word:8}")).join(" ")).trim_end().to_owned()
        };
        let mut lines = vec![row("", StageName::ALL.map(StageName::as_str))];
        lines.extend(self.rows.iter().map(|(name, words)| row(name, *words)));
        lines.extend([String::new(), Account::heading(width)]);
        lines.extend(self.accounts.iter().map(|(name, account)| account.row(name, width)));
        lines.push(self.total.verdict());
        if why {
            lines.push(String::new());
            lines.extend(self.whys.iter().cloned());
            lines.push(String::new());
            lines.extend(self.plan_lines());
        }
        lines.join("\n")
    }
}

/// How `unit` stands at a stage, given the first stage before it that is not fresh.
fn cell(
    step: StageName,
    stage: &Result<Box<dyn Stage>>,
    unit: &Unit,
    config: &Config,
    hashes: &HashCache,
    waits_for: &mut Option<StageName>,
) -> Cell {
    let stage = match stage {
        Ok(stage) => stage,
        Err(error) => return Cell { word: "failed", why: format!("{error:#}") },
    };
    let state = match waits_for {
        Some(earlier) => State::Stale(DirtyReason::WaitsFor { stage: earlier.as_str().to_owned() }),
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
