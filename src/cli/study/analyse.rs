//! `orator study analyse`.

use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator_base::stage::workdir;
use orator_study::analyse::result::{StatisticSettings, StudyAnalysis};
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::analyse::{Registration, analyse, page, text};
use orator_study::export;
use orator_study::folder::StudyFolder;
use orator_study::plan::TaskDesign;
use serde::Deserialize as _;
use serde::de::IntoDeserializer as _;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Analyse the votes of a study, or a table of votes from elsewhere.
///
/// A table is CSV (comma, semicolon or tab) or JSON Lines with the columns of `orator study export`, or a subset:
/// participant, clip and correct (1 or 0), or participant, clip, condition and score (0 to 100); also speaker, task
/// and design if there are several.
///
/// Every estimate has a confidence interval that generalises to other participants and other clips. Results that were
/// not registered before the first participant are marked as exploratory, and those that treat votes as independent
/// as naive.
///
/// Exit code 2: rows of the table were not valid votes; they are listed with their line and ignored.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of a study, or a table of votes (.csv, .tsv, .jsonl).
    #[arg(value_name = "STUDY|VOTES")]
    source: PathBuf,
    /// Mapping of differently named columns, such as participant=worker,clip=stimulus.
    #[arg(long, value_name = "FIELD=NAME,...", default_value = "", value_parser = columns, hide_default_value = true)]
    columns: ColumnNames,
    /// Design of the votes, if the table does not state it: turing, turing-single, preference, sliders or mismatch;
    /// defaults to what the columns imply.
    #[arg(long, value_name = "DESIGN", value_parser = design)]
    design: Option<TaskDesign>,
    /// Deviation from chance that counts as equivalent, percentage points on either side; a registered bound takes
    /// precedence.
    #[arg(long, value_name = "POINTS", default_value_t = 10.0)]
    bound: f64,
    /// Number of bootstrap draws of participants; defaults to the registered number, else to 10000.
    #[arg(long, value_name = "N")]
    draws: Option<usize>,
    /// Random seed of the draws; defaults to the registered one, else to 1.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Also write an HTML page with plots and all statistics.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
}

pub fn columns(text: &str) -> Result<ColumnNames, String> {
    ColumnNames::parse(text).map_err(|error| format!("{error:#}"))
}

pub fn design(name: &str) -> Result<TaskDesign, String> {
    let known = TaskDesign::deserialize(name.into_deserializer());
    known.map_err(|error: serde::de::value::Error| error.to_string())
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    ensure!((0.1..50.0).contains(&args.bound), "--bound {}: expected 0.1 to below 50 percentage points", args.bound);
    if let Some(draws) = args.draws {
        ensure!((100..=1_000_000).contains(&draws), "--draws {draws}: expected 100 to 1000000");
    }
    check_report(args)?;
    enter_sandbox(args.report.as_deref(), args.source.is_dir().then_some(args.source.as_path()));
    let analysis = analysis(args)?;
    let mut shown = text::text(&analysis);
    if let Some(path) = &args.report {
        let html = page::html(&analysis);
        workdir::write_file(path, html.as_bytes())?;
        let _ = writeln!(shown, "\nwrote {}", path.display());
    }
    let next = format!("orator study analyse {} --report analysis.html", args.source.display());
    let next = args.report.is_none().then_some(next);
    let facts = json!({ "analysis": analysis, "report": args.report });
    ui.summary(&shown, next.as_deref(), facts);
    Ok(if analysis.rejected.is_empty() { Outcome::Done } else { Outcome::SomeFailed })
}

/// Checks that the page does not overwrite an input.
fn check_report(args: &Args) -> Result<()> {
    let Some(path) = &args.report else { return Ok(()) };
    let fits = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("html"));
    ensure!(fits, "{}: expected a file that ends in .html", path.display());
    ensure!(!path.is_dir(), "{} is a folder, expected a file", path.display());
    Ok(())
}

fn analysis(args: &Args) -> Result<StudyAnalysis> {
    let name = name(&args.source)?;
    let settings = |registered: StatisticSettings| StatisticSettings {
        bound: args.bound / 100.0,
        n_draws: args.draws.unwrap_or(registered.n_draws),
        seed: args.seed.unwrap_or(registered.seed),
        ..registered
    };
    if !args.source.is_dir() {
        let read = VotesRead::of_file(&args.source, &args.columns, args.design)?;
        let settings = settings(StatisticSettings::default());
        return analyse([&name, &name], &read, None, &settings).with_context(|| args.source.display().to_string());
    }
    let options = [(args.design.is_some(), "--design"), (args.columns != ColumnNames::default(), "--columns")];
    for (is_given, option) in options {
        ensure!(!is_given, "{option} applies to tables of votes; {} is a study folder", args.source.display());
    }
    let folder = StudyFolder::new(&args.source);
    let registration = Registration::of_folder(&folder)?;
    let read = VotesRead::of_votes(export::responses(&folder)?.1);
    let settings = settings(StatisticSettings::from(&registration.settings));
    analyse([&registration.title, &name], &read, Some(&registration), &settings)
        .with_context(|| args.source.display().to_string())
}

/// Name of a file or folder without its parent folders.
fn name(path: &Path) -> Result<String> {
    let path = path.canonicalize().with_context(|| path.display().to_string())?;
    Ok(path.file_name().unwrap_or_default().to_string_lossy().into_owned())
}
