//! Table of all metrics of all predictors with confidence intervals, computed on the same clips and the same draws.

use super::blocks::{self, BlockLength};
use super::bootstrap::{self, BlockGroups};
use super::sign_flips::{self, TestedDifference};
use crate::evaluate::baseline::baselines::{NumberedCheckpoint, Predictor, PredictorKind};
use crate::evaluate::clips::clips::EvalClips;
use crate::metrics::catalogue::{Better, Catalogue, Definition, IntervalSums};
use crate::metrics::settings::MetricSettings;
use anyhow::{Result, ensure};
use ndarray::{Array2, s};
use orator_base::math::estimate::Estimate;
use orator_base::stage::progress::Task;

pub const N_DRAWS: usize = 1000;
/// Number of draws for costly metrics (Frechet distances, correlations).
pub const N_COSTLY_DRAWS: usize = 100;
/// Number of blocks below which bootstrap intervals are unreliable.
pub const FEW_BLOCKS: usize = 10;

#[derive(Clone, Debug)]
pub struct PredictorRow {
    pub kind: PredictorKind,
    /// Checkpoint that generated the motion, if several are evaluated.
    pub checkpoint: Option<NumberedCheckpoint>,
    /// Description in one sentence.
    pub description: String,
    pub values: Vec<Estimate>,
    /// Reasons for missing values; empty where there is a value.
    pub reasons: Vec<String>,
    /// Values without each group of blocks [groups, definitions]; empty if blocks are missing.
    without_group: Array2<f64>,
}

#[derive(Clone, Debug)]
pub struct Table {
    pub settings: MetricSettings,
    pub definitions: Vec<Definition>,
    /// For metrics that should match the ground truth: index of the metric with the ground truth's value.
    pub truth_of: Vec<Option<usize>>,
    pub n_clips: usize,
    pub n_blocks: usize,
    /// Approximate length of the blocks; each clip is divided into equal blocks of about this length.
    pub block_length: BlockLength,
    groups: BlockGroups,
    pub n_frames: usize,
    pub secs: f64,
    pub with_sound: bool,
    /// Whether the model was trained on these clips.
    pub trained_on: bool,
    /// Hash of the ground truth and of its compared joints.
    pub truth: String,
    /// Rows: predictions first, ground truth last.
    pub rows: Vec<PredictorRow>,
    pub notes: Vec<String>,
}

/// Measures the predictions, the baselines and the ground truth itself, one predictor at a time to bound memory. The
/// results do not depend on the number of threads.
///
/// # Errors
/// Settings that the catalogue rejects; no frame to measure.
pub fn measure(
    clips: &EvalClips,
    settings: &MetricSettings,
    predictors: &[Predictor],
    task: &dyn Task,
) -> Result<Table> {
    let (has_fingers, channels) = (clips.have_fingers(), clips.channels.clone());
    let settings = MetricSettings { fps: clips.fps, has_fingers, channels, ..settings.clone() };
    let catalogue = Catalogue::new(&settings)?;
    ensure!(clips.n_frames() > 0, "no frames to evaluate");
    let fps = clips.fps.per_sec();
    let block_length = BlockLength::new(clips.secs(), fps, &differences(clips, predictors));
    let frames = blocks::frames(clips, block_length.frames(fps));
    let groups = BlockGroups::new(&frames);
    let mut rows = Vec::new();
    for predictor in predictors {
        task.detail(&NumberedCheckpoint::name_of(predictor.kind, predictor.checkpoint.as_ref()));
        let measured = blocks::measure(&catalogue, clips, predictor, block_length.frames(fps));
        let row = row(&catalogue, predictor.kind, &predictor.description, &measured);
        let without_group = if measured.blocks.len() == frames.len() {
            let counts = groups.counts_without();
            let mut values = catalogue.draw_cheap(&measured.blocks, counts.view());
            let costly = catalogue.draw_costly(&measured.blocks, counts.view());
            for index in (0..values.ncols()).filter(|index| catalogue.is_costly(*index)) {
                values.column_mut(index).assign(&costly.column(index));
            }
            values
        } else {
            Array2::default((0, 0))
        };
        rows.push(PredictorRow { checkpoint: predictor.checkpoint.clone(), without_group, ..row });
        task.advance(1);
    }
    task.detail("truth");
    rows.extend(halves(&catalogue, clips));
    let truth = Predictor::truth(clips);
    // The ground truth is measured without blocks, since it needs no bootstrap draws.
    let total = blocks::measure(&catalogue, clips, &truth, usize::MAX).total;
    rows.push(row(&catalogue, PredictorKind::Truth, &truth.description, &IntervalSums { total, blocks: Vec::new() }));
    task.advance(1);
    let definitions = catalogue.definitions().to_vec();
    let truth_of = (0..definitions.len()).map(|index| catalogue.truth_of(index)).collect();
    Ok(Table {
        settings,
        definitions,
        truth_of,
        n_clips: clips.clips.len(),
        n_blocks: frames.len(),
        block_length,
        groups,
        n_frames: clips.n_frames(),
        secs: clips.secs(),
        with_sound: clips.have_sound(),
        trained_on: clips.trained_on,
        truth: clips.truth(),
        rows,
        notes: clips.notes.clone(),
    })
}

/// Differences in metres, for every frame of every clip, between the errors of a prediction and those of each predictor
/// that conclusions compare it with.
fn differences(clips: &EvalClips, predictors: &[Predictor]) -> Vec<Vec<Vec<f64>>> {
    use PredictorKind::{LatePrediction, MeanPose, MedianPose, MismatchedPrediction, Prediction};
    let errors: Vec<_> = predictors.iter().map(|predictor| blocks::frame_errors(clips, predictor)).collect();
    let is_compared = |own: &Predictor, other: &Predictor| match other.kind {
        MeanPose | MedianPose => true,
        LatePrediction | MismatchedPrediction => own.checkpoint == other.checkpoint,
        _ => false,
    };
    let less = |(own, other): (&Vec<f64>, &Vec<f64>)| own.iter().zip(other).map(|(a, b)| a - b).collect();
    let mut differences = Vec::new();
    for (own, of_own) in predictors.iter().zip(&errors).filter(|(own, _)| own.kind == Prediction) {
        let others = predictors.iter().zip(&errors).filter(|(other, _)| is_compared(own, other));
        differences.extend(others.map(|(_, of_other)| of_own.iter().zip(of_other).map(less).collect()));
    }
    differences
}

/// Row that compares one half of the ground truth with the other; only for metrics of sets of frames, since the frames
/// of the halves do not correspond.
fn halves(catalogue: &Catalogue, clips: &EvalClips) -> Option<PredictorRow> {
    let measured = blocks::halves(catalogue, clips);
    if measured.blocks.is_empty() {
        return None;
    }
    let description = "every second block of the truth compared with the others: the distance between two halves of the real \
                motion; only for metrics of sets of frames";
    let mut row = row(catalogue, PredictorKind::TruthHalves, description, &measured);
    for (index, definition) in catalogue.definitions().iter().enumerate().filter(|(_, d)| !is_of_sets(d)) {
        row.values[index] = Estimate::new(f64::NAN, f64::NAN, f64::NAN);
        row.reasons[index] = format!("{} needs two motions of the same frames", definition.name);
    }
    Some(row)
}

/// Whether a metric compares two sets of frames regardless of their order.
fn is_of_sets(definition: &Definition) -> bool {
    ["frechet", "hellinger"].iter().any(|start| definition.name.starts_with(start))
}

fn row(catalogue: &Catalogue, kind: PredictorKind, description: &str, measured: &IntervalSums) -> PredictorRow {
    let values = catalogue.values(&measured.total);
    let n_blocks = measured.blocks.len();
    let drawn = if n_blocks == 0 {
        Array2::from_elem((0, values.len()), f64::NAN)
    } else {
        let counts = bootstrap::counts(n_blocks, N_DRAWS);
        let mut drawn = catalogue.draw_cheap(&measured.blocks, counts.view());
        // Costly metrics use a prefix of the same draws.
        let costly = catalogue.draw_costly(&measured.blocks, counts.slice(s![..N_COSTLY_DRAWS, ..]));
        for index in (0..values.len()).filter(|index| catalogue.is_costly(*index)) {
            drawn.column_mut(index).fill(f64::NAN);
            drawn.slice_mut(s![..N_COSTLY_DRAWS, index]).assign(&costly.column(index));
        }
        drawn
    };
    let estimate = |(index, value): (usize, &f64)| {
        let Estimate { value, interval } = bootstrap::estimate(*value, &drawn.column(index).to_vec());
        // Metrics are never below 0.
        Estimate::new(value, interval.low.max(0.0 * interval.low), interval.high)
    };
    let reason = |(index, value): (usize, &f64)| {
        if value.is_finite() { String::new() } else { catalogue.reason(&measured.total, index) }
    };
    PredictorRow {
        kind,
        checkpoint: None,
        description: description.to_owned(),
        reasons: values.iter().enumerate().map(reason).collect(),
        values: values.iter().enumerate().map(estimate).collect(),
        without_group: Array2::default((0, 0)),
    }
}

impl PredictorRow {
    pub fn name(&self) -> String {
        NumberedCheckpoint::name_of(self.kind, self.checkpoint.as_ref())
    }

    pub fn key(&self) -> String {
        NumberedCheckpoint::key_of(self.kind, self.checkpoint.as_ref())
    }
}

impl Table {
    /// Rows of the motions under test, one per checkpoint.
    pub fn predictions(&self) -> impl Iterator<Item = &PredictorRow> {
        self.rows.iter().filter(|row| row.kind == PredictorKind::Prediction)
    }

    /// Row of a predictor, if it was measured; that of the first checkpoint if there are several.
    pub fn row(&self, kind: PredictorKind) -> Option<&PredictorRow> {
        self.rows.iter().find(|row| row.kind == kind)
    }

    /// Whether a metric of the prediction has a value in any row.
    pub fn is_shown(&self, index: usize) -> bool {
        let has_value = self.rows.iter().any(|row| row.values[index].value.is_finite());
        self.definitions[index].better != Better::Neither && has_value
    }

    /// Gain of `a` over `b` in a metric, in its unit, positive if `a` is better. NaN if neither direction is better.
    pub fn gain(&self, a: &PredictorRow, b: &PredictorRow, index: usize) -> f64 {
        let value = |row: &PredictorRow, index: usize| row.values[index].value;
        self.quality(index, |index| value(a, index)) - self.quality(index, |index| value(b, index))
    }

    /// Gains of `a` over other rows, each `(metric index, row)`, tested together: the level holds for all of them.
    pub fn tested_gains(&self, a: &PredictorRow, others: &[(usize, &PredictorRow)]) -> Vec<TestedDifference> {
        let n = self.groups.len();
        let contributions = |(index, b): &(usize, &PredictorRow)| {
            if a.without_group.nrows() != n || b.without_group.nrows() != n {
                return vec![f64::NAN; n];
            }
            let quality =
                |row: &PredictorRow, group: usize| self.quality(*index, |index| row.without_group[[group, index]]);
            let without: Vec<f64> = (0..n).map(|group| quality(a, group) - quality(b, group)).collect();
            self.groups.contributions(self.gain(a, b, *index), &without)
        };
        let inflation = self.block_length.variance_inflation(self.secs / n.max(1) as f64);
        sign_flips::test(&others.iter().map(contributions).collect::<Vec<_>>(), inflation)
    }

    /// Quality of a value in a metric, where higher is better.
    fn quality(&self, index: usize, value: impl Fn(usize) -> f64) -> f64 {
        let truth = self.truth_of.get(index).copied().flatten().unwrap_or(index);
        match self.definitions.get(index).map(|definition| definition.better) {
            Some(Better::Higher) => value(index),
            Some(Better::Lower) => -value(index),
            Some(Better::NearerTruth) => -(value(index) - value(truth)).abs(),
            Some(Better::Neither) | None => f64::NAN,
        }
    }
}
