//! Charts of a task: proportions and differences with intervals, scores, preference steps, strengths.

use crate::analyse::conclusions::scope;
use crate::analyse::result::{PairAnalysis, ShareAnalysis, ShareMeasure, StudyAnalysis, TaskAnalysis};
use crate::analyse::statistic::StatisticMethod;
use crate::analyse::text::{bare_p, counted};
use crate::plan::TaskDesign;
use crate::stats::estimate::ConfidenceInterval;
use orator_base::text::number;
use orator_report::html::chart::forest::{ForestRow, ForestScale, forest};
use orator_report::html::{Node, legend, node, table};

/// Names of the five preference steps, from the second condition to the first.
const STEPS: [&str; 5] = ["second, clearly", "second, slightly", "no preference", "first, slightly", "first, clearly"];

pub(super) fn task(task: &TaskAnalysis, analysis: &StudyAnalysis) -> Vec<Node> {
    let parts = [
        (!task.shares.is_empty()).then(|| shares(task, analysis)),
        (!task.scores.is_empty()).then(|| scores(task)),
        task.pairs.iter().any(|pair| pair.steps.is_some()).then(|| steps(task)),
        (!task.pairs.is_empty()).then(|| pairs(task)),
        (!task.strengths.is_empty()).then(|| strengths(task)),
    ];
    parts.into_iter().flatten().flatten().collect()
}

fn card(chart: Node) -> Node {
    node("div").class("card scroll wide").attr("tabindex", "0").child(chart)
}

/// Axis limits with a margin around all finite values.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    if low > high {
        return [0.0, 1.0];
    }
    let room = (0.06 * (high - low)).max(1e-6);
    [low - room, high + room]
}

fn scaled(interval: Option<ConfidenceInterval>, factor: f64) -> Option<[f64; 2]> {
    interval.map(|ends| [factor * ends.low, factor * ends.high])
}

fn shares(task: &TaskAnalysis, analysis: &StudyAnalysis) -> Vec<Node> {
    let percent = |share: f64| 100.0 * share;
    let row = |share: &ShareAnalysis, class: &'static str, more: &str, method: StatisticMethod| {
        let p = share.statistics.test(method).map(|test| format!(", p {}", equal(test.final_p())));
        ForestRow {
            name: format!("{}{more}", scope(share)),
            class,
            value: percent(share.share),
            interval: scaled(share.statistics.interval(method), 100.0),
            value_text: format!("{:.1} %{}", percent(share.share), p.unwrap_or_default()),
        }
    };
    let mut rows = Vec::new();
    let chance = task.shares.iter().filter(|share| share.measure != ShareMeasure::JudgedReal);
    for (index, share) in chance.enumerate() {
        rows.push(row(share, if index == 0 { "own" } else { "part" }, "", StatisticMethod::Crossed));
        if index == 0 {
            rows.push(row(share, "naive", ", naive", StatisticMethod::Wilson));
            let other = analysis.without_exclusions.iter().find(|other| other.task == task.task);
            let other = other.and_then(TaskAnalysis::pooled);
            rows.extend(other.map(|other| row(other, "unfiltered", ", without exclusions", StatisticMethod::Crossed)));
        }
    }
    let bound =
        task.pooled().and_then(|share| share.statistics.equivalence(StatisticMethod::Crossed)).map(|test| test.bound);
    let band = bound.map(|bound| [percent(0.5 - bound), percent(0.5 + bound)]);
    let values = rows.iter().flat_map(|row| row.interval.unwrap_or([row.value; 2])).chain(band.into_iter().flatten());
    let [low, high] = ends(values);
    let scale = ForestScale { low, high, middle: Some(50.0), band, unit: "% of votes" };
    let (what, label) = match task.design {
        TaskDesign::Turing => ("Share of votes that chose the generated motion as the real one.", "Generated chosen"),
        TaskDesign::Mismatch => ("Share of votes for the matching motion.", "Matched chosen"),
        _ => ("Share of correct responses.", "Correct responses"),
    };
    let about = format!("{what} Dashed: chance. Shaded: equivalence bound around chance.");
    let mut keys =
        vec![("line own", "participants and clips crossed"), ("line naive", "votes treated as independent (Wilson)")];
    keys.extend((task.shares.len() > 1).then_some(("line part", "speakers or conditions, p after Holm")));
    keys.extend((!analysis.without_exclusions.is_empty()).then_some(("line unfiltered", "without exclusions")));
    keys.extend(band.map(|_| ("band", "equivalence bound")));
    let mut body = vec![node("p").text(about), legend(keys), card(forest(label, &rows, &scale))];
    let single: Vec<ForestRow> = task
        .shares
        .iter()
        .filter(|share| share.measure == ShareMeasure::JudgedReal)
        .map(|share| row(share, "part", "", StatisticMethod::Crossed))
        .collect();
    if !single.is_empty() {
        let scale = ForestScale { low: 0.0, high: 100.0, middle: None, band: None, unit: "% of votes" };
        body.push(node("p").text("Share of votes that judged the motion of each condition real."));
        body.push(card(forest("Judged real", &single, &scale)));
    }
    body
}

fn scores(task: &TaskAnalysis) -> Vec<Node> {
    let rows: Vec<ForestRow> = task
        .scores
        .iter()
        .map(|row| ForestRow {
            name: row.condition.clone(),
            class: "own",
            value: row.mean,
            interval: scaled(row.statistics.interval(StatisticMethod::Crossed), 1.0),
            value_text: match row.statistics.interval(StatisticMethod::Median) {
                Some(interval) => {
                    format!("median {} [{}, {}]", number(row.median), number(interval.low), number(interval.high))
                }
                None => format!("median {}", number(row.median)),
            },
        })
        .collect();
    let scale = ForestScale { low: 0.0, high: 100.0, middle: None, band: None, unit: "mean score" };
    let about = "Mean scores, with intervals that generalise to other participants and clips. Right: medians with the \
        intervals of the GENEA challenges, which treat scores as independent.";
    vec![node("p").text(about), card(forest("Scores", &rows, &scale))]
}

fn pairs(task: &TaskAnalysis) -> Vec<Node> {
    let factor = if task.design == TaskDesign::TuringSingle { 100.0 } else { 1.0 };
    let row = |pair: &PairAnalysis| {
        let p = pair.statistics.crossed_p().map(|p| format!(", p {}", equal(p)));
        ForestRow {
            name: format!("{} \u{2212} {}", pair.first, pair.second),
            class: "own",
            value: factor * pair.difference,
            interval: scaled(pair.statistics.interval(StatisticMethod::Crossed), factor),
            value_text: format!("{:+.2}{}", factor * pair.difference, p.unwrap_or_default()),
        }
    };
    let rows: Vec<ForestRow> = task.pairs.iter().map(row).collect();
    let values = rows.iter().flat_map(|row| row.interval.unwrap_or([row.value; 2]));
    let [low, high] = ends(values.chain([0.0]));
    let unit = match task.design {
        TaskDesign::Sliders => "points of 100",
        TaskDesign::TuringSingle => "percentage points",
        _ => "steps",
    };
    let scale = ForestScale { low, high, middle: Some(0.0), band: None, unit };
    let about = "Differences between conditions (first minus second), with intervals that generalise to other \
        participants and clips; p values of several pairs are adjusted by Holm's method.";
    vec![node("p").text(about), card(forest("Differences", &rows, &scale))]
}

fn steps(task: &TaskAnalysis) -> Vec<Node> {
    let row = |pair: &PairAnalysis| {
        let steps = pair.steps.unwrap_or_default();
        let total = steps.iter().sum::<u64>().max(1) as f64;
        let parts = steps.iter().enumerate().map(|(step, n)| {
            let share = 100.0 * *n as f64 / total;
            let label = if share >= 8.0 { format!("{share:.0} %") } else { String::new() };
            let part = node("span").class(format!("step{step}")).attr("style", format!("width:{share:.3}%"));
            part.attr("title", format!("{}: {}, {share:.1} %", STEPS[step], counted(*n as usize, "vote"))).text(label)
        });
        let name = node("th").attr("scope", "row").text(format!("{} (first), {}", pair.first, pair.second));
        node("tr").child(name).child(node("td").child(node("div").class("steps").children(parts)))
    };
    let keys = STEPS.iter().enumerate().map(|(step, name)| (format!("step{step}"), *name));
    let head = ["Pair", "Votes per step"].map(|text| node("th").attr("scope", "col").text(text));
    let chart = table("preference", head, task.pairs.iter().map(row));
    vec![
        node("p").text("Distribution of the votes over the steps of the preference scale."),
        legend(keys),
        node("div").class("scroll").child(chart),
    ]
}

fn strengths(task: &TaskAnalysis) -> Vec<Node> {
    let rows: Vec<ForestRow> = task
        .strengths
        .iter()
        .map(|row| ForestRow {
            name: row.condition.clone(),
            class: "own",
            value: row.log_strength,
            interval: scaled(row.interval.as_ref().map(|interval| interval.ends), 1.0),
            value_text: format!("{:+.2}, Elo {:.0}", row.log_strength, row.elo),
        })
        .collect();
    let [low, high] = ends(rows.iter().flat_map(|row| row.interval.unwrap_or([row.value; 2])));
    let scale = ForestScale { low, high, middle: Some(0.0), band: None, unit: "log odds" };
    let about = "Strength of each condition: log odds of being preferred to a condition of mean strength \
        (Bradley-Terry), and Elo rating.";
    vec![node("p").text(about), card(forest("Strengths", &rows, &scale))]
}

/// p value with its relation sign: `= 0.027`, `< 1e-99`.
fn equal(p: f64) -> String {
    let text = bare_p(p);
    if text.starts_with('<') { text } else { format!("= {text}") }
}
