//! Learning curves of a training run from its log.

use crate::html::chart::lines::{ChartLevel, ChartLine, LineChart};
use serde_json::Value;

/// Maximum number of points of a curve; neighbouring points of a longer one are averaged.
pub const MAX_POINTS: usize = 240;

pub struct TrainingLog<'a> {
    steps: Vec<&'a Value>,
    pub epochs: Vec<&'a Value>,
    /// Log line of the validation with the best (smallest) score.
    pub best: Option<&'a Value>,
}

impl<'a> TrainingLog<'a> {
    pub fn parse(lines: &'a [Value]) -> Self {
        let (epochs, steps): (Vec<&Value>, Vec<&Value>) = lines.iter().partition(|line| line["validation"].is_object());
        let score = |line: &Value| line["validation"]["score"].as_f64().unwrap_or(f64::INFINITY);
        let best = epochs.iter().copied().min_by(|a, b| score(a).total_cmp(&score(b)));
        Self { steps, epochs, best }
    }

    /// Charts of all curves that are not 0 throughout.
    pub fn charts(&self) -> Vec<LineChart> {
        let training = |name: &str, colour, of: &str| curve(&self.steps, name, colour, |line| line[of].as_f64());
        let generated = |name: &str, colour, of: &str| {
            curve(&self.epochs, name, colour, |line| metrics(&line["validation"], of)[0].as_f64())
        };
        let level = |name: &str, colour, value| ChartLevel { name: name.to_owned(), colour, value };
        // Value of the mean pose, which is the same in all validations.
        let mean_pose = |name: &str, colour, of: &str| {
            let last = self.epochs.last().and_then(|line| metrics(&line["validation"], of)[1].as_f64());
            level(name, colour, last.unwrap_or(f64::NAN))
        };
        let chart = |title: &str, description: &str, lines: Vec<ChartLine>, levels: Vec<ChartLevel>| LineChart {
            title: title.to_owned(),
            description: description.to_owned(),
            lines,
            levels,
            marked: self.best.and_then(|line| line["step"].as_f64()),
        };
        let charts = vec![
            chart(
                "L1 error",
                "Error of the normalised coordinates; lower is better.",
                vec![training("training", 2, "l1"), generated("validation", 0, "l1")],
                vec![mean_pose("mean pose, validation", 0, "l1")],
            ),
            chart(
                "Correct keypoints (PCK 0.2)",
                "Share of joints within 0.2 of the pose's extent; higher is better.",
                vec![generated("arms", 0, "pck_body"), generated("fingers", 1, "pck_hands")],
                vec![mean_pose("arms, mean pose", 0, "pck_body"), mean_pose("fingers, mean pose", 1, "pck_hands")],
            ),
            chart(
                "Frechet distance, cm\u{b2}",
                "Between the distributions of single poses; lower is better; overestimated from few poses.",
                vec![generated("validation", 0, "frechet")],
                vec![mean_pose("mean pose", 0, "frechet")],
            ),
            chart(
                "Motion energy",
                "Relative to the data: 1 moves as much as the speaker, 0 is static.",
                vec![generated("validation", 0, "energy")],
                vec![level("data", 2, 1.0), level("collapse threshold", 1, 0.3)],
            ),
            chart(
                "Score",
                "Selects the best checkpoint (vertical dashed line); lower is better.",
                vec![curve(&self.epochs, "validation", 0, |line| line["validation"]["score"].as_f64())],
                vec![],
            ),
            chart(
                "Adversarial losses",
                "Adversarial loss of the generator and loss of the discriminator.",
                vec![training("generator", 0, "adversarial"), training("discriminator", 1, "discriminator")],
                vec![],
            ),
            chart(
                "Bone and velocity losses",
                "",
                vec![training("bone lengths", 0, "bone"), training("velocity", 1, "velocity")],
                vec![],
            ),
            chart("Gradient norm", "Norm before clipping.", vec![training("generator", 0, "gradient_norm")], vec![]),
        ];
        let is_nonzero =
            |chart: &LineChart| chart.lines.iter().flat_map(|line| &line.points).any(|[_, value]| *value != 0.0);
        let mut charts: Vec<LineChart> = charts.into_iter().filter(is_nonzero).collect();
        for chart in &mut charts {
            chart.lines.retain(|line| !line.points.is_empty());
            chart.levels.retain(|level| level.value.is_finite());
        }
        charts
    }
}

/// Metric of the network and of the mean pose in a validation. Logs of sequence networks have no objects `generator`
/// and `mean_pose` but prefixed keys.
pub fn metrics<'v>(validation: &'v Value, of: &str) -> [&'v Value; 2] {
    if validation["generator"].is_object() {
        return ["generator", "mean_pose"].map(|row| &validation[row][of]);
    }
    [&validation[of], &validation[format!("mean_pose_{of}")]]
}

fn curve(lines: &[&Value], name: &str, colour: usize, value: impl Fn(&Value) -> Option<f64>) -> ChartLine {
    let points = lines.iter().filter_map(|line| Some([line["step"].as_f64()?, value(line)?]));
    ChartLine { name: name.to_owned(), colour, points: thinned(&points.collect::<Vec<_>>()) }
}

fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n_averaged = points.len().div_ceil(MAX_POINTS).max(1);
    let mean = |points: &[[f64; 2]]| [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    points.chunks(n_averaged).map(mean).collect()
}
