//! `orator evaluate`: errors on captured motion.

use super::{Outcome, ui::Ui};
use orator::evaluate::hands;
use orator::motion::finger_files;
use std::path::PathBuf;

/// Measure the lifters on captured motion.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Lifter(LifterArgs),
}

/// Print the errors of a lifter on captured motion seen by random cameras, beside those of trivial methods.
#[derive(clap::Args)]
struct LifterArgs {
    /// hands.
    #[arg(long, value_enum)]
    part: Part,
    /// Captured fingers (.bvh, SMPL-X or TED .npz, ICVL or NYU label .txt) or folders of them; a row each.
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    mocap: Vec<PathBuf>,
    /// Weights of `orator train lifter --part hands` [default: the built-in ones]
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Part {
    Hands,
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    let What::Lifter(args) = args.what;
    let Part::Hands = args.part;
    let rows = hands::evaluate(
        &*hands::lifter_of(&args.hand_weights.unwrap_or_default())?,
        &finger_files::read_all(&args.mocap)?,
        hands::MEASURED,
        1,
    )?;
    ui.summary(&hands::text(&rows), None, serde_json::json!({ "hands": rows }));
    Ok(Outcome::Done)
}
