//! Check of a speaker trained on the rule: its motion for the sound of the test split against the synthetic speaker's
//! motion and the rule's predictable part, beside simpler predictors.

use super::traces;
use crate::dataset::{Dataset, Sample, Split};
use crate::demo::rule::baselines::{RuleBaselines, sound_of_frames, wrist_speeds};
use crate::demo::rule::dataset::SpokenClip;
use crate::demo::rule::ridge::correlation;
use crate::generate::GestureGenerator;
use crate::metrics::movement::energy::MotionEnergy;
use crate::metrics::position::pck::{CorrectKeypoints, PckAxes};
use crate::stage::progress::Progress;
use crate::types::skeleton::{NECK, is_duplicate};
use crate::types::time::FrameRate;
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3, ArrayView2, ArrayView3, Axis, concatenate};
use serde::Serialize;

/// Metrics of a predictor on the whole test split.
#[derive(Clone, Debug, Serialize)]
pub struct LearnedRow {
    pub predictor: &'static str,
    /// Pearson correlation of the left and of the right wrist's speed with the predictable part's, over all frames of
    /// all clips, without smoothing.
    pub speed_correlation: [f64; 2],
    /// Pose metrics; `None`: no poses are predicted.
    pub poses: Option<PoseQuality>,
}

/// Agreement of the poses with the speaker's.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PoseQuality {
    /// Share of keypoints within 0.2 of the pose's extent, 48 joints.
    pub pck: f64,
    /// Mean squared speed of the joints, as a share of the data's.
    pub energy: f64,
    /// Energy over the frames in which the rule holds both wrists still, where only variation moves that no sound
    /// predicts; a predictor that regresses to the mean loses this first.
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
    /// Penalties of the ridge regressions to speeds and to poses.
    pub ridge_strengths: [f64; 2],
    /// Whether the generator reaches the targets; `None`: no generator.
    pub good: Option<bool>,
    /// First clip, for the picture.
    #[serde(skip)]
    pub first: Option<traces::TraceClip>,
}

/// Targets of the generator: correlation of each wrist's speed, PCK as a multiple of the mean pose's and of the
/// mismatched prediction's, motion energy as a share of the data's.
pub const LEAST_CORRELATION: f64 = 0.7;
pub const LEAST_PCK: f64 = 1.5;
pub const ENERGY: std::ops::RangeInclusive<f64> = 0.7..=1.3;

/// Speed below which a wrist of the rule is held, m/s.
const HELD: f64 = 0.05;

/// Clip of the test split.
struct TestClip {
    sample: Sample,
    predictable: Array3<f32>,
    sound: Array2<f64>,
}

/// Measures `speaker` on the test split of the synthetic speaker's `dataset`; without one, the baselines alone.
pub fn measure(dataset: &Dataset, speaker: Option<&GestureGenerator>, progress: &dyn Progress) -> Result<Learned> {
    let tests: Vec<TestClip> =
        dataset.samples(Split::Test).iter().map(|s| TestClip::new(dataset.read(s)?)).collect::<Result<_>>()?;
    ensure!(tests.len() > 1, "{}: the test split needs two clips at least", dataset.dir().display());
    let fps = dataset.info().fps;
    let judge = Judge { tests: &tests, std: dataset.stats().std(), fps };
    let task = progress.begin("listen", 0);
    let baselines = RuleBaselines::learn(dataset)?;
    let row = |predictor, predicted: Vec<Array3<f32>>| judge.row(predictor, &predicted);
    let each = |predict: &dyn Fn(&TestClip) -> Array3<f32>| tests.iter().map(predict).collect::<Vec<_>>();
    let (mut rows, mut first) = (Vec::new(), None);
    if let Some(speaker) = speaker {
        task.detail("generating");
        let predicted: Vec<Array3<f32>> =
            tests.iter().map(|test| Ok(speaker.motion(&test.sample.sound)?.joints)).collect::<Result<_>>()?;
        for (predicted, test) in predicted.iter().zip(&tests) {
            ensure!(
                predicted.shape() == test.predictable.shape(),
                "the speaker has another frame rate than the dataset"
            );
        }
        first = predicted.first().zip(tests.first()).map(|(predicted, test)| traces::TraceClip {
            rule: test.predictable.clone(),
            data: test.sample.motion.joints.clone(),
            predicted: predicted.clone(),
        });
        rows.push(row("generator", predicted.clone()));
        let mut other = predicted;
        other.rotate_left(1);
        rows.push(row("generator, another test sound", other));
    }
    rows.push(row("mean pose", each(&|test| baselines.still(test.sample.n_frames()))));
    rows.push(row("ridge of the frame, to poses", each(&|test| baselines.ridge_poses(&test.sound))));
    let speeds: Vec<Array2<f64>> = tests.iter().map(|test| baselines.ridge_speeds(&test.sound)).collect();
    rows.push(LearnedRow {
        predictor: "ridge of the frame, to speeds",
        speed_correlation: judge.correlation(&speeds),
        poses: None,
    });
    rows.push(row("nearest training window by sound", each(&|test| baselines.nearest(&test.sound))));
    rows.push(row("the data itself", each(&|test| test.sample.motion.joints.clone())));
    rows.push(row("the rule without variation", each(&|test| test.predictable.clone())));
    let n_frames: usize = tests.iter().map(|test| test.sample.n_frames()).sum();
    Ok(Learned {
        n_clips: tests.len(),
        secs: fps.secs(n_frames),
        good: speaker.map(|_| good(&rows)),
        rows,
        ridge_strengths: baselines.strengths,
        first,
    })
}

/// Whether the first row (the generator) reaches the targets against the second (mismatched) and the third (mean pose).
fn good(rows: &[LearnedRow]) -> bool {
    let [predicted, others @ ..] = rows else { return false };
    let Some(poses) = predicted.poses else { return false };
    let beats = |other: &LearnedRow| other.poses.is_some_and(|other| poses.pck >= LEAST_PCK * other.pck);
    predicted.speed_correlation.iter().all(|correlation| *correlation >= LEAST_CORRELATION)
        && others.iter().take(2).all(beats)
        && ENERGY.contains(&poses.energy)
}

impl TestClip {
    fn new(sample: Sample) -> Result<Self> {
        let predictable = SpokenClip::from_sample(&sample)?.predictable().joints;
        let sound = sound_of_frames(&sample.sound, sample.n_frames(), sample.motion.fps);
        Ok(Self { sample, predictable, sound })
    }
}

struct Judge<'a> {
    tests: &'a [TestClip],
    /// Standard deviations [49, 3], metres.
    std: Array2<f32>,
    fps: FrameRate,
}

impl Judge<'_> {
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
            let held = held(test, self.fps);
            pauses.add(predicted.view(), held.view(), self.fps);
            reference_pauses.add(ground_truth.joints.view(), held.view(), self.fps);
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
        }
    }

    fn correlation(&self, speeds: &[Array2<f64>]) -> [f64; 2] {
        let truth: Vec<Array2<f64>> =
            self.tests.iter().map(|test| wrist_speeds(test.predictable.view(), self.fps)).collect();
        let joined = |parts: &[Array2<f64>]| {
            let views: Vec<ArrayView2<f64>> = parts.iter().map(|part| part.view()).collect();
            concatenate(Axis(0), &views).unwrap_or_default()
        };
        let (predicted, truth) = (joined(speeds), joined(&truth));
        std::array::from_fn(|hand| correlation(predicted.column(hand), truth.column(hand)))
    }

    /// Sum and number of normalised errors.
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

/// Mask of the frames with wrist speeds of the rule below `HELD` on both sides.
fn held(test: &TestClip, fps: FrameRate) -> Array2<bool> {
    let speeds = wrist_speeds(test.predictable.view(), fps);
    let still = |t: usize| speeds.row(t.min(speeds.nrows() - 1)).iter().all(|speed| *speed < HELD);
    let mask = &test.sample.motion.mask;
    Array2::from_shape_fn(mask.dim(), |(t, joint)| mask[[t, joint]] && still(t.saturating_sub(1)) && still(t))
}
