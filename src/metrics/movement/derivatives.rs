//! How fast, how accelerated and how jerky a motion is: mean norms of its first three differences over time, of the made
//! and of the ground truth. A predicted motion that stands still has the least error of a poor one; here it shows.

use crate::math::vec3;
use crate::math::vec3::Vec3;
use crate::metrics::body_part::{BodyPart, MeasuredPoint};
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use crate::types::skeleton::N_JOINTS;
use serde_json::json;

/// How often positions are differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DerivativeOrder {
    Speed,
    Acceleration,
    Jerk,
}

impl DerivativeOrder {
    pub const ALL: [Self; 3] = [Self::Speed, Self::Acceleration, Self::Jerk];

    /// Weights of the frames, first to last.
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

struct Derivative {
    order: DerivativeOrder,
    part: BodyPart,
    points: Vec<MeasuredPoint>,
    /// The genea convention: every interval weighs the same, in centimetres.
    by_interval: bool,
}

/// Mean over frames and joints.
pub(crate) fn metric(order: DerivativeOrder, part: BodyPart) -> Box<dyn MetricFamily> {
    Box::new(Derivative { order, part, points: part.points(), by_interval: false })
}

/// Mean over intervals of the means of each (GENEA).
pub(crate) fn by_interval(order: DerivativeOrder) -> Box<dyn MetricFamily> {
    let part = BodyPart::WithNeck;
    Box::new(Derivative { order, part, points: part.points(), by_interval: true })
}

impl Derivative {
    /// `[predicted, ground_truth]` norms at frame `t`, or nothing where the point is not seen throughout.
    fn norms(&self, pair: &PairedFrames, t: usize, point: MeasuredPoint) -> Option<[f64; 2]> {
        let weights = self.order.weights();
        let seen = |joint| pair.sees(t, weights.len(), joint);
        if !seen(point.joint) || !point.origin.is_none_or(seen) {
            return None;
        }
        let scale = pair.fps.powi(weights.len() as i32 - 1);
        let of = |poses: &[[Vec3; N_JOINTS]]| {
            let mut sum = [0.0; 3];
            for (weight, pose) in weights.iter().zip(&poses[t..]) {
                let at = point.origin.map_or(pose[point.joint], |origin| vec3::sub(pose[point.joint], pose[origin]));
                (0..3).for_each(|k| sum[k] += weight * at[k]);
            }
            vec3::norm(sum) * scale
        };
        Some([of(&pair.predicted), of(&pair.ground_truth)])
    }
}

impl MetricFamily for Derivative {
    fn definitions(&self) -> Vec<Definition> {
        let units = if self.by_interval { ["cm/s", "cm/s^2", "cm/s^3"] } else { ["m/s", "m/s^2", "m/s^3"] };
        let definition = |name, better| Definition {
            name,
            part: self.part.name(),
            unit: units[self.order.weights().len() - 2],
            better,
            formula: match (self.by_interval, self.order) {
                (false, DerivativeOrder::Speed) => "mean over t and j of |x(t+1) - x(t)| * fps, x seen in both frames",
                (false, DerivativeOrder::Acceleration) => {
                    "mean over t and j of |x(t+2) - 2 x(t+1) + x(t)| * fps^2, x seen in all three frames"
                }
                (false, DerivativeOrder::Jerk) => {
                    "mean over t and j of |x(t+3) - 3 x(t+2) + 3 x(t+1) - x(t)| * fps^3, x seen in all four frames"
                }
                (true, _) => {
                    "|n-th difference of x| * fps^n (n = 2 acceleration, 3 jerk) in centimetres, mean over the frames \
                     and joints of an interval, then mean over intervals, long or short alike; 49 joints, the neck that \
                     stands still among them"
                }
            },
            undefined: "no joint of the part is seen in enough frames in a row (2 for speed, 3 for acceleration, 4 for \
                        jerk)",
            parameters: json!({}),
        };
        let [of_made, of_real] = self.order.names();
        vec![definition(of_made, Better::NearerTruth), definition(of_real, Better::Neither)]
    }

    fn n_sums(&self) -> usize {
        3
    }

    fn measure(&self, pair: &PairedFrames, blocks: &mut BlockSums) {
        let windows = 0..(pair.n_frames() + 1).saturating_sub(self.order.weights().len());
        let n = match self.by_interval {
            true => {
                let seen = |t| self.points.iter().filter(move |point| self.norms(pair, t, **point).is_some());
                windows.clone().flat_map(seen).count() as f64
            }
            false => 1.0,
        };
        for t in windows {
            let sums = blocks.at(t);
            for [predicted, ground_truth] in self.points.iter().filter_map(|point| self.norms(pair, t, *point)) {
                sums[0] += predicted / n;
                sums[1] += ground_truth / n;
                sums[2] += 1.0 / n;
            }
        }
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        let unit = if self.by_interval { 100.0 } else { 1.0 };
        vec![unit * sums[0] / sums[2], unit * sums[1] / sums[2]]
    }
}
