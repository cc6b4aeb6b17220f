//! Check of a speaker trained on the rule: its motion for the audio of the test split is compared with the synthetic
//! speaker's motion and the predictable part of the rule, and with simpler predictors.

use super::positions::{self, PositionShare, WordPositions};
use super::traces;
use crate::demo::host;
use anyhow::{Result, ensure};
use ndarray::{Array1, Array2, Array3, ArrayView3, Axis};
use orator_base::stage::progress::Progress;
use orator_base::text::counted;
use orator_base::types::skeleton::{NECK, is_duplicate};
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Sample, Split};
use orator_formats::transcript::Word;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_gesture::metrics::movement::derivatives::MotionEnergy;
use orator_gesture::metrics::position::pck::{CorrectKeypoints, PckAxes};
use orator_test_support::rule::baselines::{RuleBaselines, frame_log_mel};
use orator_test_support::rule::dataset::{RULE_OF_WORDS, SpokenClip};
use orator_test_support::rule::ridge::correlation;
use orator_test_support::rule::rule::RuleGestures;
use orator_test_support::rule::rule::wrist_speeds;
use orator_test_support::rule::speech_dataset::{is_by_speech, predictable};
use serde::Serialize;
use std::path::Path;

/// Metrics of a predictor on the test split.
#[derive(Clone, Debug, Serialize)]
pub struct LearnedRow {
    pub predictor: &'static str,
    /// Pearson correlation of the speeds of the left and the right wrist with those of the predictable part, without
    /// smoothing, over all frames of all clips in which no word moves the hand.
    pub speed_correlation: [f64; 2],
    /// Pose metrics; `None` if no poses are predicted.
    pub poses: Option<PoseQuality>,
    /// Positions to which words move the hands; `None` if the rule has no words, or no poses are predicted.
    pub positions: Option<WordPositions>,
}

/// Agreement of the poses with the speaker's.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PoseQuality {
    /// Share of keypoints within 0.2 of the pose's extent, 48 joints.
    pub pck: f64,
    /// Mean squared speed of the joints, as a share of the data's.
    pub energy: f64,
    /// Energy over the frames in which the rule moves neither wrist, so that only unpredictable variation remains; it
    /// is the first metric to drop when a predictor regresses to the mean.
    pub pauses: f64,
    /// Mean absolute error of coordinates, each in standard deviations of the training split (of 1 cm at least).
    pub l1: f64,
}

/// Metrics of all predictors.
#[derive(Clone, Debug, Serialize)]
pub struct Learned {
    pub n_clips: usize,
    pub secs: f64,
    pub rows: Vec<LearnedRow>,
    /// Penalties of the ridge regressions (one frame, one second of context), to speeds and to poses.
    pub ridge_strengths: [[f64; 2]; 2],
    /// Whether the generator reaches the targets; `None`: no generator.
    pub targets_met: Option<bool>,
    /// Whether these are the targets for words.
    #[serde(skip)]
    pub has_word_targets: bool,
    /// First clip, for the plot.
    #[serde(skip)]
    pub first: Option<traces::TraceClip>,
}

/// Targets of the generator: correlation of each wrist's speed (for videos, as a share of the correlation of the lifted
/// motion, which contains errors of lifting), PCK as a multiple of the mean pose's and of the mismatched prediction's,
/// motion energy as a share of the data's.
pub const MIN_CORRELATION: f64 = 0.7;
pub const MIN_SHARE_OF_LIFTED: f64 = 0.8;
pub const MIN_PCK: f64 = 1.5;
pub const ENERGY: std::ops::RangeInclusive<f64> = 0.7..=1.3;

/// Targets for a rule with words: share of correct positions of all words for the contextual network and for the GAN,
/// and of isolated words for the network that reads the words of a segment; largest deviation from chance of a network
/// without word input; correlation on beats. With the second rule, whose words are audible, the interval with the words
/// of another clip must be below that with the own words.
pub const MIN_POSITIONS: f64 = 0.8;
pub const MIN_GAN_POSITIONS: f64 = 0.85;
pub const MIN_ISOLATED_POSITIONS: f64 = 0.7;
pub const MAX_FROM_CHANCE: f64 = 0.1;
pub const MIN_BEATS: f64 = 0.6;

/// Row of the generator conditioned on the words of another clip.
const OTHER_WORDS: &str = "generator, mismatched words";
const GROUND_TRUTH: &str = "ground truth";
/// Speed below which a wrist of the rule counts as static, m/s.
const STATIC_SPEED: f64 = 0.05;

/// A clip of the test split.
struct TestClip {
    sample: Sample,
    /// `None` for the second rule, and for videos.
    clip: Option<SpokenClip>,
    predictable: Array3<f32>,
    audio: Array2<f64>,
    /// Steps [T - 1, 2] in which no word moves the left or the right hand.
    without_word_strokes: Array2<bool>,
}

/// Evaluates `speaker` on the test split of the synthetic speaker's `dataset`; without a speaker, only the baselines.
/// `truth`: folder with the ground truth of the videos that the dataset was built from.
///
/// # Errors
/// A test split of fewer than two clips; a speaker with another frame rate; a sample that cannot be read.
pub fn measure(
    dataset: &Dataset,
    truth: Option<&Path>,
    speaker: Option<&EvaluatedCheckpoint>,
    progress: &dyn Progress,
) -> Result<Learned> {
    let tests: Vec<TestClip> =
        dataset.samples(Split::Test).iter().map(|s| TestClip::new(dataset.read(s)?, truth)).collect::<Result<_>>()?;
    ensure!(
        tests.len() > 1,
        "the test split of {} has {}: expected at least 2",
        dataset.dir().display(),
        counted(tests.len(), "clip")
    );
    let fps = dataset.info().fps;
    let judge = Judge { tests: &tests, std: dataset.stats().std(), fps };
    let task = progress.begin("predict", 0);
    let baselines = RuleBaselines::fit(dataset)?;
    let row = |predictor, predicted: Vec<Array3<f32>>| judge.row(predictor, &predicted);
    let each = |predict: &dyn Fn(&TestClip) -> Array3<f32>| tests.iter().map(predict).collect::<Vec<_>>();
    let (mut rows, mut first) = (Vec::new(), None);
    if let Some(speaker) = speaker {
        task.detail("generating");
        let with_words = |shift: Option<usize>| -> Result<Vec<Array3<f32>>> {
            let one = |n: usize| {
                let words = shift.map(|shift| tests[(n + shift) % tests.len()].words()).unwrap_or_default();
                let sample = &tests[n].sample;
                Ok(speaker.motion(&sample.sound, words, sample.n_frames(), fps)?.0.joints)
            };
            (0..tests.len()).map(one).collect()
        };
        ensure!(
            speaker.speaker.fps() == fps,
            "the checkpoint has {}, {} has {fps}: use the dataset that the checkpoint was trained on",
            speaker.speaker.fps(),
            dataset.dir().display()
        );
        let predicted = with_words(Some(0))?;
        first = predicted.first().zip(tests.first()).map(|(predicted, test)| traces::TraceClip {
            rule: test.predictable.clone(),
            data: test.sample.motion.joints.clone(),
            predicted: predicted.clone(),
        });
        rows.push(row("generator", predicted.clone()));
        // Clips of videos differ in length: a shorter one is repeated.
        let mismatched = (0..tests.len()).map(|n| {
            let other = &predicted[(n + 1) % tests.len()];
            let frames: Vec<usize> = (0..tests[n].sample.n_frames()).map(|t| t % other.shape()[0].max(1)).collect();
            other.select(Axis(0), &frames)
        });
        rows.push(row("generator, mismatched audio", mismatched.collect()));
        if speaker.speaker.reads_words() {
            rows.push(row(OTHER_WORDS, with_words(Some(1))?));
            rows.push(row("generator, without words", with_words(None)?));
        }
    }
    rows.push(row("mean pose", each(&|test| baselines.mean_pose(test.sample.n_frames()))));
    let names = [
        ["ridge, 1 frame of audio, poses", "ridge, 1 frame of audio, speeds"],
        ["ridge, 1 s of audio, poses", "ridge, 1 s of audio, speeds"],
    ];
    for (ridge, [to_poses, to_speeds]) in baselines.ridges.iter().zip(names) {
        rows.push(row(to_poses, each(&|test| ridge.poses(&test.audio))));
        let speeds: Vec<Array2<f64>> = tests.iter().map(|test| ridge.speeds(&test.audio)).collect();
        let speed_correlation = judge.correlation(&speeds);
        rows.push(LearnedRow { predictor: to_speeds, speed_correlation, poses: None, positions: None });
    }
    rows.push(row("nearest neighbour by audio", each(&|test| baselines.nearest(&test.audio))));
    rows.push(row(GROUND_TRUTH, each(&|test| test.sample.motion.joints.clone())));
    if truth.is_none() {
        // For videos, the rule is known in the axes of the body, not of the camera.
        rows.push(row("rule without variation", each(&|test| test.predictable.clone())));
    }
    if judge.has_words() {
        rows.push(row("rule without words", each(&|test| test.rule_without_words(fps))));
    }
    let n_frames: usize = tests.iter().map(|test| test.sample.n_frames()).sum();
    let reads_words = speaker.is_some_and(|speaker| speaker.speaker.reads_words());
    let has_word_targets = judge.has_words() || (reads_words && judge.is_by_speech());
    Ok(Learned {
        n_clips: tests.len(),
        secs: fps.secs(n_frames),
        targets_met: speaker.map(|speaker| match has_word_targets {
            true => word_targets_met(&rows, speaker, judge.is_by_speech()),
            false => targets_met(&rows, truth.is_some()),
        }),
        has_word_targets,
        rows,
        ridge_strengths: baselines.ridges.each_ref().map(|ridge| ridge.strengths),
        first,
    })
}

/// Whether the first row (the generator) reaches the targets relative to the second (mismatched) and the third (mean
/// pose). For data of videos, the correlation is compared with that of the lifted motion.
fn targets_met(rows: &[LearnedRow], of_videos: bool) -> bool {
    let [predicted, others @ ..] = rows else { return false };
    let Some(poses) = predicted.poses else { return false };
    let beats = |other: &LearnedRow| other.poses.is_some_and(|other| poses.pck >= MIN_PCK * other.pck);
    let lifted = rows.iter().find(|row| of_videos && row.predictor == GROUND_TRUTH);
    let least = lifted.map_or([MIN_CORRELATION; 2], |row| row.speed_correlation.map(|of| MIN_SHARE_OF_LIFTED * of));
    predicted.speed_correlation.iter().zip(least).all(|(correlation, least)| *correlation >= least)
        && others.iter().take(2).all(beats)
        && ENERGY.contains(&poses.energy)
}

/// Whether the generator's row reaches the targets for words, which may be audible.
fn word_targets_met(rows: &[LearnedRow], speaker: &EvaluatedCheckpoint, are_audible: bool) -> bool {
    let Some((row, positions)) = rows.first().and_then(|row| Some((row, row.positions?))) else { return false };
    let is_chance = |share: PositionShare| (share.share() - PositionShare::CHANCE).abs() <= MAX_FROM_CHANCE;
    let others = rows.iter().find(|row| row.predictor == OTHER_WORDS).and_then(|row| row.positions);
    let uses_words = match speaker.speaker.architecture() {
        Some(Architecture::Contextual) => positions.all.share() >= MIN_POSITIONS,
        Some(Architecture::Words) => positions.isolated.share() >= MIN_ISOLATED_POSITIONS,
        None if speaker.speaker.reads_words() => positions.all.share() >= MIN_GAN_POSITIONS,
        _ => return is_chance(positions.all),
    };
    let Some(others) = others.filter(|_| uses_words) else { return false };
    if are_audible {
        return others.all.interval()[1] < positions.all.interval()[0];
    }
    is_chance(others.all) && row.speed_correlation.iter().all(|correlation| *correlation >= MIN_BEATS)
}

impl TestClip {
    fn new(sample: Sample, truth: Option<&Path>) -> Result<Self> {
        let has_clip = truth.is_none() && !is_by_speech(&sample);
        let clip = has_clip.then(|| SpokenClip::from_sample(&sample)).transpose()?;
        let predictable = match truth {
            Some(truth) => host::predictable(truth, &sample)?,
            None => clip.map_or_else(|| predictable(&sample), |clip| clip.predictable()).joints,
        };
        let audio = frame_log_mel(&sample.sound, sample.n_frames(), sample.motion.fps);
        let all = || Array2::from_elem((sample.n_frames().saturating_sub(1), 2), true);
        let without_word_strokes = clip.map_or_else(all, |clip| positions::without_words(&clip, sample.motion.fps));
        Ok(Self { sample, clip, predictable, audio, without_word_strokes })
    }

    fn words(&self) -> &[Word] {
        self.sample.words.as_deref().unwrap_or_default()
    }

    /// The rule's motion for the same audio without words.
    fn rule_without_words(&self, fps: FrameRate) -> Array3<f32> {
        let of_clip = |clip: SpokenClip| {
            RuleGestures::of_habits(&clip.habits(), &clip.speech(), &[]).motion(clip.n_frames, fps).joints
        };
        self.clip.map_or_else(|| self.predictable.clone(), of_clip)
    }
}

struct Judge<'a> {
    tests: &'a [TestClip],
    /// Standard deviations [49, 3], metres.
    std: Array2<f32>,
    fps: FrameRate,
}

impl Judge<'_> {
    fn has_words(&self) -> bool {
        self.tests.iter().filter_map(|test| test.clip).any(|clip| clip.rule == RULE_OF_WORDS)
    }

    /// Whether the clips follow the second rule, whose words are audible.
    fn is_by_speech(&self) -> bool {
        self.tests.iter().all(|test| test.clip.is_none() && is_by_speech(&test.sample))
    }

    fn positions(&self, predicted: &[Array3<f32>]) -> WordPositions {
        let mut positions = WordPositions::default();
        for (joints, test) in predicted.iter().zip(self.tests) {
            match &test.clip {
                Some(clip) => positions.count(clip, joints.view(), self.fps),
                None => positions.count_speech(&test.sample, joints.view(), self.fps),
            }
        }
        positions
    }

    fn row(&self, predictor: &'static str, predicted: &[Array3<f32>]) -> LearnedRow {
        let mut correct = CorrectKeypoints::default();
        let (mut energy, mut reference_energy) = (MotionEnergy::default(), MotionEnergy::default());
        let (mut pauses, mut reference_pauses) = (MotionEnergy::default(), MotionEnergy::default());
        let mut errors = (0.0, 0.0);
        for (predicted, test) in predicted.iter().zip(self.tests) {
            let ground_truth = &test.sample.motion;
            correct.count(PckAxes::Xyz, predicted.view(), ground_truth.joints.view(), ground_truth.mask.view());
            energy.add(predicted.view(), ground_truth.mask.view(), self.fps);
            reference_energy.add(ground_truth.joints.view(), ground_truth.mask.view(), self.fps);
            let paused = paused(test, self.fps);
            pauses.add(predicted.view(), paused.view(), self.fps);
            reference_pauses.add(ground_truth.joints.view(), paused.view(), self.fps);
            let of_clip = self.error(predicted.view(), ground_truth.joints.view());
            errors = (errors.0 + of_clip.0, errors.1 + of_clip.1);
        }
        let speeds: Vec<Array2<f64>> =
            predicted.iter().map(|predicted| wrist_speeds(predicted.view(), self.fps)).collect();
        LearnedRow {
            predictor,
            speed_correlation: self.correlation(&speeds),
            poses: Some(PoseQuality {
                pck: correct.share(),
                energy: energy.relative_to(&reference_energy),
                pauses: pauses.relative_to(&reference_pauses),
                l1: errors.0 / f64::max(errors.1, 1.0),
            }),
            positions: (self.has_words() || self.is_by_speech()).then(|| self.positions(predicted)),
        }
    }

    fn correlation(&self, speeds: &[Array2<f64>]) -> [f64; 2] {
        let truth: Vec<Array2<f64>> =
            self.tests.iter().map(|test| wrist_speeds(test.predictable.view(), self.fps)).collect();
        std::array::from_fn(|hand| {
            let without_word_strokes = |parts: &[Array2<f64>]| -> Array1<f64> {
                let steps = parts.iter().zip(self.tests).flat_map(|(part, test)| {
                    part.column(hand)
                        .into_iter()
                        .zip(test.without_word_strokes.column(hand))
                        .filter(|(_, is_beat)| **is_beat)
                });
                steps.map(|(speed, _)| *speed).collect()
            };
            correlation(without_word_strokes(speeds).view(), without_word_strokes(&truth).view())
        })
    }

    /// Sum and number of the normalised errors.
    fn error(&self, predicted: ArrayView3<f32>, ground_truth: ArrayView3<f32>) -> (f64, f64) {
        let mut sum = (0.0, 0.0);
        for ((t, joint, k), ground_truth) in ground_truth.indexed_iter() {
            if joint != NECK && !is_duplicate(joint) {
                sum.0 += f64::from((predicted[[t, joint, k]] - ground_truth).abs() / self.std[[joint, k]].max(0.01));
                sum.1 += 1.0;
            }
        }
        sum
    }
}

/// Mask of the frames in which both wrists of the rule are slower than `STATIC_SPEED`.
fn paused(test: &TestClip, fps: FrameRate) -> Array2<bool> {
    let speeds = wrist_speeds(test.predictable.view(), fps);
    let is_static = |t: usize| speeds.row(t.min(speeds.nrows() - 1)).iter().all(|speed| *speed < STATIC_SPEED);
    let mask = &test.sample.motion.mask;
    Array2::from_shape_fn(mask.dim(), |(t, joint)| mask[[t, joint]] && is_static(t.saturating_sub(1)) && is_static(t))
}
