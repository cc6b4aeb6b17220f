//! `orator evaluate`.

use super::{Outcome, ui::Ui};
use anyhow::{Context, Result, ensure};
use orator::config;
use orator::dataset::{Dataset, Split};
use orator::evaluate::{bodies, hands, speaker, speaker_text};
use orator::generate::Speaker;
use orator::motion::{finger_files, mocap};
use orator::stage::progress::Progress as _;
use std::path::PathBuf;

/// Measure the lifters on captured motion, or a trained speaker on held-out sound.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Lifter(LifterArgs),
    Speaker(SpeakerArgs),
}

/// Print the errors of a lifter on captured motion seen by random cameras, beside those of trivial methods.
#[derive(clap::Args)]
struct LifterArgs {
    /// body or hands.
    #[arg(long, value_enum, default_value = "body")]
    part: Part,
    /// Captured motion, files or folders of them. body: .bvh, CMU or TED .npz; hands: .bvh with fingers, SMPL-X or TED
    /// .npz, ICVL or NYU label .txt.
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    mocap: Vec<PathBuf>,
    /// body: measure the takes of these names apart, and no others: patterns like 'test_*' or 'walk#1' (a file's second
    /// take) [default: all as one set]
    #[arg(long, value_name = "PATTERN", num_args = 1..)]
    takes: Vec<String>,
    /// body: scenes of 4 s a set.
    #[arg(long, value_name = "N", default_value_t = bodies::SCENES)]
    scenes: usize,
    /// Weights of `orator train lifter --part body` [default: the built-in ones]
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// Weights of `orator train lifter --part hands` [default: the built-in ones]
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
}

/// Print how good a trained speaker's motion is for sound it was not trained on.
///
/// Share of correct keypoints (PCK at 0.2: all, arms, fingers), L1 error, Frechet distance of single poses and motion
/// energy, of the model, the mean pose that never moves, the nearest neighbour by sound in the training split, and the
/// model hearing another sound; each with its 95 % interval over blocks of 4 s.
#[derive(clap::Args)]
struct SpeakerArgs {
    /// The dataset, a folder of `orator run` or `orator import`.
    #[arg(long, value_name = "DIR")]
    dataset: PathBuf,
    /// A checkpoint of `orator train gan`, or its folder (the best checkpoint is taken).
    #[arg(long, value_name = "FILE|FOLDER")]
    checkpoint: PathBuf,
    /// Which intervals: validation, test or train.
    #[arg(long, value_name = "SPLIT", default_value = "validation", value_parser = split)]
    split: Split,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Part {
    Body,
    Hands,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.what {
        What::Lifter(args) => match args.part {
            Part::Body => body(args, ui),
            Part::Hands => hands(args, ui),
        },
        What::Speaker(args) => speaker(&args, ui),
    }
}

fn split(name: &str) -> std::result::Result<Split, String> {
    let found = Split::ALL.into_iter().find(|split| split.name() == name);
    found.ok_or_else(|| format!("a split is {}", Split::ALL.map(Split::name).join(", ")))
}

fn speaker(args: &SpeakerArgs, ui: &Ui) -> Result<Outcome> {
    let dataset = Dataset::open(&args.dataset)?;
    let table = {
        let _task = ui.begin("evaluating", 0);
        speaker::evaluate(&dataset, &Speaker::open(&args.checkpoint)?, args.split)?
    };
    let facts = serde_json::json!({ "speaker": table, "meaning": speaker_text::meaning(&table) });
    ui.summary(&speaker_text::text(&table), None, facts);
    Ok(Outcome::Done)
}

fn body(args: LifterArgs, ui: &Ui) -> Result<Outcome> {
    ensure!((1..=100_000).contains(&args.scenes), "--scenes must lie between 1 and 100000");
    let settings = config::Lift {
        body_weights: args.body_weights.unwrap_or_default(),
        hand_weights: args.hand_weights.unwrap_or_default(),
        ..Default::default()
    };
    let takes = mocap::read_all(&args.mocap).context("reading --mocap")?;
    let sets = if args.takes.is_empty() {
        vec![("all takes".to_owned(), takes)]
    } else {
        mocap::divide(takes, &args.takes)?.0
    };
    let rows = bodies::table(&bodies::Lifters::new(&settings)?, &sets, args.scenes)?;
    ui.summary(&bodies::text(&rows), None, serde_json::json!({ "body": rows }));
    Ok(Outcome::Done)
}

fn hands(args: LifterArgs, ui: &Ui) -> Result<Outcome> {
    let rows = hands::evaluate(
        &*hands::lifter_of(&args.hand_weights.unwrap_or_default())?,
        &finger_files::read_all(&args.mocap)?,
        hands::MEASURED,
        1,
    )?;
    ui.summary(&hands::text(&rows), None, serde_json::json!({ "hands": rows }));
    Ok(Outcome::Done)
}
