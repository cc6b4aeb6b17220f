//! Page of a training, next to its checkpoints, written again after each validation: learning curves with the best
//! checkpoint marked, the metrics of that checkpoint and of the mean pose, and generated and true poses.

use super::charts::{TrainingLog, metrics};
use super::strip::{HeldOutPair, strip};
use crate::html::chart::lines::LineChart;
use crate::html::{Node, Page, Section, jpeg, node};
use anyhow::{Context, Result};
use orator_base::stage::workdir;
use orator_base::text::{counted, number};
use orator_gesture::train::epochs::ValidatedStep;
use orator_gesture::train::gan::score::below_mean_pose;
use orator_gesture::train::log;
use orator_media::ffmpeg;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Function that generates poses of held-out intervals with the best checkpoint, paired with the true ones.
pub type BestPosesFn<'a> = Box<dyn Fn() -> Result<Vec<HeldOutPair>> + 'a>;

/// Page in the folder of a running training. Poses are generated once per best checkpoint.
pub struct LivePage<'a> {
    folder: &'a Path,
    speaker: String,
    poses: BestPosesFn<'a>,
    of_best: Option<(usize, Vec<HeldOutPair>)>,
    written: Option<ValidatedStep>,
}

impl<'a> LivePage<'a> {
    /// Page of the training of `speaker` in `folder`; nothing is written yet.
    pub fn new(folder: &'a Path, speaker: String, poses: BestPosesFn<'a>) -> Self {
        Self { folder, speaker, poses, of_best: None, written: None }
    }

    pub fn path(&self) -> PathBuf {
        self.folder.join(PAGE)
    }

    /// Writes the page after the validation `at`, unless it has already been written for it.
    pub fn write(&mut self, at: ValidatedStep) -> Result<()> {
        if self.written == Some(at) {
            return Ok(());
        }
        if self.of_best.as_ref().is_none_or(|(step, _)| *step != at.best_step) {
            self.of_best = Some((at.best_step, (self.poses)()?));
        }
        let pairs = self.of_best.as_ref().map_or(&[][..], |(_, pairs)| pairs);
        write(self.folder, &self.speaker, pairs)?;
        self.written = Some(at);
        Ok(())
    }
}

pub const PAGE: &str = "training.html";

/// Metrics of a validation: name, key, whether in percent.
const METRICS: [(&str, &str, bool); 6] = [
    ("L1 error (normalised)", "l1", false),
    ("PCK 0.2", "pck", true),
    ("PCK 0.2, arms", "pck_body", true),
    ("PCK 0.2, fingers", "pck_hands", true),
    ("Frechet distance of single poses, cm\u{b2}", "frechet", false),
    ("Motion energy relative to the data", "energy", true),
];

/// Writes `training.html` into the folder of a training run from its log and poses of held-out intervals (may be
/// empty). The bytes depend only on log and poses.
pub fn write(folder: &Path, speaker: &str, pairs: &[HeldOutPair]) -> Result<()> {
    let lines = log::read(folder)?;
    let training_log = TrainingLog::parse(&lines);
    let charts = training_log.charts();
    let is_held_out = training_log.best.is_none_or(|best| best["validation"]["split"] != "train");
    let mut poses = vec![node("p").text(
        "The speaker's motion and, below it, the motion that the best checkpoint generates from the audio alone, in \
         intervals of the named split; the model was trained on those of the split train. The curves show the height \
         of the wrists: the speaker's in grey, the generated one in colour.",
    )];
    let curves = node("div").class("grid").children(charts.iter().map(LineChart::card));
    let note = "Without validation data, the curves named validation are measured on training data.";
    let note = (!is_held_out).then(|| node("p").class("note").text(note));
    if pairs.is_empty() {
        poses = vec![node("p").class("empty").text("No interval with the 49 joints to show.")];
    } else {
        let strip = strip(pairs)?;
        let names: Vec<&str> = pairs.iter().map(|pair| pair.name.as_str()).collect();
        let description = format!("Ground-truth and generated poses of {}", names.join(", "));
        let image = jpeg(&ffmpeg::jpeg::encode(&strip)?, [strip.width, strip.height], &description);
        poses.push(node("div").class("scroll").child(image.class("strip")));
    }
    let section = |id, title, body| Section { id, title, body };
    let page = Page {
        title: format!("Training of {speaker}"),
        lead: lead(&training_log),
        sections: vec![
            section("best", "Best checkpoint", best(&training_log)),
            section("curves", "Curves", note.into_iter().chain([curves]).collect()),
            section("poses", "Generated and ground-truth poses", poses),
        ],
        style: include_str!("page.css"),
        script: "",
        data: Value::Null,
    };
    workdir::write_file(&folder.join(PAGE), page.html().as_bytes()).context("cannot write the training page")
}

fn lead(training_log: &TrainingLog) -> String {
    let Some(best) = training_log.best else { return "No validation yet.".to_owned() };
    let step = |line: &Value| line["step"].as_u64().unwrap_or(0);
    let last = training_log.epochs.last().map_or(0, |line| step(line));
    let (key, of) =
        if best["validation"]["n_segments"].is_u64() { ("n_segments", "sequence") } else { ("n_windows", "window") };
    let split = match best["validation"]["split"].as_str() {
        Some("train") => "training",
        Some(split) => split,
        None => "validation",
    };
    let windows = best["validation"][key].as_u64().unwrap_or(0) as usize;
    format!(
        "{} and {}. The best score is at step {}, measured on {} of the {split} split.",
        counted(last as usize, "step"),
        counted(training_log.epochs.len(), "validation"),
        step(best),
        counted(windows, of),
    )
}

/// Table of the best checkpoint's metrics, with warnings if necessary.
fn best(training_log: &TrainingLog) -> Vec<Node> {
    let Some(best) = training_log.best.map(|line| &line["validation"]) else {
        return vec![node("p").class("empty").text("The log has no validation yet.")];
    };
    let is_sequence = best["n_segments"].is_u64();
    let shown = |value: &Value, in_percent: bool| match value.as_f64() {
        Some(value) if in_percent => format!("{:.1} %", 100.0 * value),
        Some(value) => number(value),
        None if is_sequence => "0".to_owned(),
        None => "too few poses".to_owned(),
    };
    let is_measured = |(_, of, _): &(&str, &str, bool)| !is_sequence || best[*of].is_number();
    let row = |(name, of, in_percent): (&str, &str, bool)| {
        let cells = metrics(best, of).map(|value| shown(value, in_percent));
        let cells = cells.into_iter().map(|text| node("td").class("num").text(text));
        node("tr").child(node("th").attr("scope", "row").text(name)).children(cells)
    };
    let head = ["", "generator", "mean pose"].map(|name| node("th").attr("scope", "col").class("num").text(name));
    let table = node("table")
        .child(node("thead").child(node("tr").children(head)))
        .child(node("tbody").children(METRICS.into_iter().filter(is_measured).map(row)));
    let about = match best["n_poses"].as_u64() {
        Some(poses) => format!(
            "The mean pose is static. Each Frechet distance is computed from {}; fewer poses give larger distances.",
            counted(poses as usize, "pose")
        ),
        None => "The mean pose is static.".to_owned(),
    };
    let pair = |of: &str| {
        let [model, mean_pose] = metrics(best, of).map(Value::as_f64);
        Some([model?, mean_pose?])
    };
    let below = pair("l1").and_then(|l1| below_mean_pose(l1, pair("pck")));
    let below = below.map(|below| node("p").class("note").text(below));
    let alarm = best["alarm"].as_str().map(|alarm| node("p").class("note").text(format!("Warning: {alarm}.")));
    let table = node("div").class("scroll metrics").child(table);
    below.into_iter().chain([table, node("p").class("small").text(about)]).chain(alarm).collect()
}
