//! Speed, acceleration and jerk of predicted and real motion: mean norms of the first three differences over time. They
//! reveal predictions that hardly move, which have a small position error; the ratio of predicted to real motion
//! energy, the mean squared speed of the joints, detects those that collapse to the mean pose.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::windows;
use ndarray::{ArrayView2, ArrayView3};
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use orator_base::types::time::FrameRate;

/// Number of differentiations of the positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DerivativeOrder {
    Speed,
    Acceleration,
    Jerk,
}

impl DerivativeOrder {
    pub(crate) const ALL: [Self; 3] = [Self::Speed, Self::Acceleration, Self::Jerk];

    /// Finite-difference weights of the frames, first to last.
    const fn weights(self) -> &'static [f64] {
        match self {
            Self::Speed => &[-1.0, 1.0],
            Self::Acceleration => &[1.0, -2.0, 1.0],
            Self::Jerk => &[-1.0, 3.0, -3.0, 1.0],
        }
    }

    const fn names(self) -> [&'static str; 2] {
        match self {
            Self::Speed => ["speed", "speed_of_real"],
            Self::Acceleration => ["acceleration", "acceleration_of_real"],
            Self::Jerk => ["jerk", "jerk_of_real"],
        }
    }
}

/// Metric that averages over all frames and joints.
pub(crate) fn metric(order: DerivativeOrder, part: BodyPart) -> MetricFamily {
    let (unit, formula) = match order {
        DerivativeOrder::Speed => ("m/s", "mean over t and j of |x(t+1) - x(t)| * fps, x seen in both frames"),
        DerivativeOrder::Acceleration => {
            ("m/s^2", "mean over t and j of |x(t+2) - 2 x(t+1) + x(t)| * fps^2, x seen in all three frames")
        }
        DerivativeOrder::Jerk => {
            ("m/s^3", "mean over t and j of |x(t+3) - 3 x(t+2) + 3 x(t+1) - x(t)| * fps^3, x seen in all four frames")
        }
    };
    family(order, part, unit, formula, false)
}

/// Metric of GENEA: mean over intervals of the mean of each interval, so that all have the same weight; in centimetres.
pub(crate) fn by_interval(order: DerivativeOrder) -> MetricFamily {
    let unit = ["cm/s", "cm/s^2", "cm/s^3"][order.weights().len() - 2];
    let formula = "|n-th difference of x| * fps^n (n = 2 acceleration, 3 jerk) in centimetres, mean over the frames \
                   and joints of an interval, then mean over intervals, long or short alike; 49 joints, the neck that \
                   stands still among them";
    family(order, BodyPart::WithNeck, unit, formula, true)
}

fn family(
    order: DerivativeOrder,
    part: BodyPart,
    unit: &'static str,
    formula: &'static str,
    by_interval: bool,
) -> MetricFamily {
    let (points, weights) = (part.points(), order.weights());
    let [name, of_real] = order.names();
    let definition = Definition {
        formula,
        undefined: "no joint of the part is visible in enough frames in a row (2 for speed, 3 for acceleration, 4 for \
                    jerk)",
        ..Definition::new(name, part.name(), unit, Better::NearerTruth)
    };
    let family = MetricFamily::mean_of_both(definition.with_truth(of_real), move |pair, blocks| {
        let windows = || windows(pair, &points, weights.len(), 0);
        let n = if by_interval { windows().count() as f64 } else { 1.0 };
        let scale = pair.fps.powi(weights.len() as i32 - 1);
        let norm = |at: &dyn Fn(usize) -> Vec3| {
            let mut sum = [0.0; 3];
            for (frame, weight) in weights.iter().enumerate() {
                let at = at(frame);
                (0..3).for_each(|k| sum[k] += weight * at[k]);
            }
            vec3::norm(sum) * scale
        };
        for window in windows() {
            let sums = blocks.at(window.t);
            sums[0] += norm(&|frame| window.predicted(frame)) / n;
            sums[1] += norm(&|frame| window.ground_truth(frame)) / n;
            sums[2] += 1.0 / n;
        }
    });
    let unit = if by_interval { 100.0 } else { 1.0 };
    let values = move |sums: &[f64]| vec![unit * sums[0] / sums[2], unit * sums[1] / sums[2]];
    MetricFamily { values: Box::new(values), ..family }
}

/// Accumulated squared speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionEnergy {
    /// Sum of squared speeds, (m/s)^2.
    pub sum: f64,
    /// Number of speeds: joints times steps between frames.
    pub n: usize,
}

impl MotionEnergy {
    /// Adds the steps between consecutive frames of `joints` [T, 49, 3] in metres, for all joints but the neck and the
    /// hand roots, where `mask` [T, 49] is true in both frames. The mask of a prediction is that of its ground truth,
    /// so that both are measured on the same joints and frames.
    pub fn add(&mut self, joints: ArrayView3<f32>, mask: ArrayView2<bool>, fps: FrameRate) {
        let per_sec = fps.per_sec();
        for t in 1..joints.shape()[0] {
            for joint in (NECK + 1..N_JOINTS).filter(|joint| !is_duplicate(*joint)) {
                if mask[[t - 1, joint]] && mask[[t, joint]] {
                    let step = |k: usize| f64::from(joints[[t, joint, k]] - joints[[t - 1, joint, k]]) * per_sec;
                    self.sum += (0..3).map(|k| step(k).powi(2)).sum::<f64>();
                    self.n += 1;
                }
            }
        }
    }

    /// Mean squared speed, (m/s)^2; 0 if nothing was added.
    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }

    /// Ratio of this energy to that of the ground truth; NaN if the ground truth is static.
    pub fn relative_to(&self, ground_truth: &Self) -> f64 {
        if ground_truth.sum > 0.0 { self.mean() / ground_truth.mean() } else { f64::NAN }
    }
}
