//! `orator-lab demo learned`: how much of its rule a trained speaker has learnt, as a table and a picture.

use crate::demo::check::places::PlaceShare;
use crate::demo::check::{learned, traces};
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir;
use orator_dataset::Dataset;
use orator_gesture::generate::trained::TrainedSpeaker;
use orator_media::opencv::png;
use std::path::Path;

pub fn run(dataset: &Path, checkpoint: Option<&Path>, picture: Option<&Path>, ui: &Ui) -> Result<Outcome> {
    let dataset = Dataset::open(dataset)?;
    let speaker = checkpoint.map(TrainedSpeaker::open).transpose()?;
    let learned = learned::measure(&dataset, speaker.as_ref(), ui)?;
    let heads = "predictor                          speed L  speed R  PCK 0.2   energy   pauses       L1";
    let has_words = learned.rows.iter().any(|row| row.places.is_some());
    let of_words = if has_words { "   right places: all words     lone words" } else { "" };
    let mut text = format!("test split: {} clips, {:.0} s\n{heads}{of_words}\n", learned.n_clips, learned.secs);
    for row in &learned.rows {
        let [left, right] = row.speed_correlation;
        text += &format!("{:34}{left:>9.3}{right:>9.3}", row.predictor);
        text += &row.poses.map_or(String::new(), |p| {
            format!("{:>7.1} %{:>7.1} %{:>7.1} %{:>9.3}", 100.0 * p.pck, 100.0 * p.energy, 100.0 * p.pauses, p.l1)
        });
        let share = |share: PlaceShare| {
            let [low, high] = share.interval().map(|end| 100.0 * end);
            format!("{:7.1} % ({low:.0} to {high:.0})", 100.0 * share.share())
        };
        text += &row.places.map_or(String::new(), |p| format!("    {}{}", share(p.all), share(p.alone)));
        text += "\n";
    }
    if let Some(places) = learned.rows.iter().find_map(|row| row.places) {
        text += &format!(
            "right places: the wrist is nearest to the word's place at the end of its stroke, of {} words, {} of them with no \
             other such word within 5 s; chance {:.0} %; speeds are those of beats, where no word moves the hand\n",
            places.all.n_words,
            places.alone.n_words,
            100.0 * PlaceShare::CHANCE
        );
    }
    text += "speed: correlation of a wrist's speed (m/s, frame by frame, not smoothed, all clips in a row) with that of the\n\
             rule without variation; PCK, energy (mean squared joint speed, share of the data's) and L1 (normalised): against the data;\n\
             pauses: the energy where the rule holds both wrists still, which no sound tells.";
    if let (Some(good), true) = (learned.good, has_words) {
        text += &format!(
            "\ntargets: right places {:.0} % (of lone words {:.0} % for a network of the words of a segment), with another text or \
             without words within {:.0} points of chance, speed {} on beats: {}",
            100.0 * learned::LEAST_PLACES,
            100.0 * learned::LEAST_LONE_PLACES,
            100.0 * learned::MOST_FROM_CHANCE,
            learned::LEAST_BEATS,
            if good { "met" } else { "MISSED" }
        );
    } else if let Some(good) = learned.good {
        text += &format!(
            "\ntargets of the generator: speed {}, PCK {} x that of another sound and of the mean pose, energy {:.0} to {:.0} %: {}",
            learned::LEAST_CORRELATION,
            learned::LEAST_PCK,
            100.0 * learned::ENERGY.start(),
            100.0 * learned::ENERGY.end(),
            if good { "met" } else { "MISSED" }
        );
    }
    if let (Some(path), Some(clip)) = (picture, &learned.first) {
        let image = traces::picture(clip, dataset.info().fps)?;
        workdir::replace(path, |attempt| png::write(attempt, &image))?;
        text += &format!("\nwrote {}", path.display());
    }
    ui.summary(&text, None, serde_json::to_value(&learned)?);
    Ok(if learned.good == Some(false) { Outcome::SomeFailed } else { Outcome::Done })
}
