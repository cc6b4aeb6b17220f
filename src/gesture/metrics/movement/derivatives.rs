//! Speed, acceleration and jerk of predicted and real motion: mean norms of the first three differences over time. They
//! reveal predictions that hardly move, which have a small position error.

use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::per_frame::windows;
use orator_base::math::vec3::{self, Vec3};

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
