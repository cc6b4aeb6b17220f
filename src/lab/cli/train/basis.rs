//! `orator-lab train basis`.

use super::corpus;
use crate::train::space::basis;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::progress::Progress as _;
use orator_base::text::counted;
use std::path::PathBuf;

/// Fit the fixed basis in which `orator evaluate` compares windows of motion.
///
/// The basis has the 64 principal components of windows of one second, of captured motion (--mocap, with procedural
/// hands) and of procedural motion. A basis is built into the program; values measured with another one are not
/// comparable with its own.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    corpus: corpus::CorpusArgs,
    /// File to write (safetensors).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub fn run(args: Args, ui: &Ui) -> anyhow::Result<Outcome> {
    let corpus = corpus::gather(&args.corpus, ui)?;
    let fitted = {
        let _task = ui.begin("principal components", 0);
        basis::fit(&corpus, args.corpus.seed, &args.out)?
    };
    let mut text = format!(
        "wrote {}: {}, finger weight {:.2}\nvariance explained by the 64 components: {:.1} %",
        args.out.display(),
        counted(fitted.n_windows, "window"),
        fitted.finger_weight,
        100.0 * fitted.share
    );
    for (set, share) in &fitted.held_out {
        text += &format!("\n  held out, {set}: {:.1} %", 100.0 * share);
    }
    let held_out: Vec<_> = fitted.held_out.iter().map(|(set, share)| serde_json::json!([set, share])).collect();
    let facts = serde_json::json!({
        "out": args.out, "windows": fitted.n_windows, "finger_weight": fitted.finger_weight, "share": fitted.share,
        "held_out": held_out,
    });
    ui.summary(&text, None, facts);
    Ok(Outcome::Done)
}
