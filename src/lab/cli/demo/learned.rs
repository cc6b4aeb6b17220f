//! `orator-lab demo learned`: how much of the rule a trained model reproduces, as a table and a plot.

use crate::demo::check::positions::PositionShare;
use crate::demo::check::{learned, traces};
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir;
use orator_base::text::{counted, length};
use orator_dataset::Dataset;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_media::opencv::png;
use std::path::{Path, PathBuf};

pub fn run(
    dataset: &Path,
    truth: Option<&Path>,
    checkpoint: Option<&Path>,
    picture: Option<&Path>,
    ui: &Ui,
) -> Result<Outcome> {
    let dataset = Dataset::open(dataset)?;
    let checkpoints: Vec<PathBuf> = checkpoint.into_iter().map(Path::to_path_buf).collect();
    let speakers = EvaluatedCheckpoint::open_all(&checkpoints, &dataset.info().speaker)?;
    let learned = learned::measure(&dataset, truth, speakers.first(), ui)?;
    let heads = "predictor                          speed L  speed R  PCK 0.2   energy   pauses       L1";
    let has_words = learned.rows.iter().any(|row| row.positions.is_some());
    let of_words = if has_words { "   positions: all words     isolated words" } else { "" };
    let mut text =
        format!("test split: {}, {}\n{heads}{of_words}\n", counted(learned.n_clips, "clip"), length(learned.secs));
    for row in &learned.rows {
        let [left, right] = row.speed_correlation;
        text += &format!("{:34}{left:>9.3}{right:>9.3}", row.predictor);
        text += &row.poses.map_or(String::new(), |p| {
            format!("{:>7.1} %{:>7.1} %{:>7.1} %{:>9.3}", 100.0 * p.pck, 100.0 * p.energy, 100.0 * p.pauses, p.l1)
        });
        let share = |share: PositionShare| {
            let [low, high] = share.interval().map(|end| 100.0 * end);
            format!("{:7.1} % ({low:.0} to {high:.0})", 100.0 * share.share())
        };
        text += &row.positions.map_or(String::new(), |p| format!("    {}{}", share(p.all), share(p.isolated)));
        text += "\n";
    }
    if let Some(positions) = learned.rows.iter().find_map(|row| row.positions) {
        text += &format!(
            "positions: share of {} whose wrist is nearest to the target of the word at the end of its stroke (95 % \
             interval); isolated: {} without another such word within 5 s; chance: {:.0} %. With the first rule, speeds \
             are compared only where no word moves the hand.\n",
            counted(positions.all.n_words, "word"),
            counted(positions.isolated.n_words, "word"),
            100.0 * PositionShare::CHANCE
        );
    }
    text += "speed: correlation of the speed of each wrist (per frame, not smoothed, clips concatenated) with that\n\
             of the rule without variation; PCK, energy (mean squared joint speed relative to the ground truth) and\n\
             L1 (normalised): against the ground truth; pauses: energy in frames where the rule moves neither wrist,\n\
             which the audio does not determine.";
    if let (Some(met), true) = (learned.targets_met, learned.has_word_targets) {
        text += &format!(
            "\ntargets: positions {:.0} % (GAN {:.0} %, a network of the words of a segment {:.0} % of the isolated \
             words); with mismatched or without words within {:.0} percentage points of chance, or below if words are \
             audible; speed of beats {}: {}",
            100.0 * learned::MIN_POSITIONS,
            100.0 * learned::MIN_GAN_POSITIONS,
            100.0 * learned::MIN_ISOLATED_POSITIONS,
            100.0 * learned::MAX_FROM_CHANCE,
            learned::MIN_BEATS,
            if met { "met" } else { "MISSED" }
        );
    } else if let Some(met) = learned.targets_met {
        let speed = match truth {
            Some(_) => format!("{} times that of the ground truth", learned::MIN_SHARE_OF_LIFTED),
            None => learned::MIN_CORRELATION.to_string(),
        };
        text += &format!(
            "\ntargets: speed {speed}, PCK {} times that of mismatched audio and of the mean pose, energy {:.0} to {:.0} \
             %: {}",
            learned::MIN_PCK,
            100.0 * learned::ENERGY.start(),
            100.0 * learned::ENERGY.end(),
            if met { "met" } else { "MISSED" }
        );
    }
    if let (Some(path), Some(clip)) = (picture, &learned.first) {
        let image = traces::picture(clip, dataset.info().fps)?;
        workdir::replace(path, |attempt| png::write(attempt, &image))?;
        text += &format!("\nwrote {}", path.display());
    }
    ui.summary(&text, None, serde_json::to_value(&learned)?);
    Ok(if learned.targets_met == Some(false) { Outcome::SomeFailed } else { Outcome::Done })
}
