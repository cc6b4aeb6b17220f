//! Tables of all statistics of a task with their registration status, of the hypotheses and of the exclusions.

use crate::analyse::number_format::{bare_p, count, percent};
use crate::analyse::result::{ShareAnalysis, ShareMeasure, StudyAnalysis, TaskAnalysis};
use crate::analyse::statistic::{StatisticOrigin, StatisticRow, StatisticSet, TestResult};
use crate::analyse::verdict::scope;
use crate::analyse::votes::read::RefusedRow;
use crate::stats::estimate::ConfidenceInterval;
use orator_report::html::{Node, node, table};

/// Columns of the table of statistics.
const COLUMNS: [&str; 6] = ["Method", "Interval", "Statistic", "p", "p after Holm", "Mark"];

/// Table of a task's statistics, grouped by quantity.
pub(super) fn task(task: &TaskAnalysis) -> Vec<Node> {
    let mut rows = Vec::new();
    for share in &task.shares {
        rows.push(group(&share_title(share)));
        rows.extend(statistic_rows(&share.statistics, 100.0, " %"));
        rows.extend(share.model.as_ref().map(|model| {
            let details = format!(
                "log odds {:.3} \u{b1} {:.3}; standard deviations of participants {:.2}, of clips {:.2}",
                model.log_odds, model.standard_error, model.sd_participants, model.sd_clips
            );
            let name = node("th").attr("scope", "row").text("mixed model's estimates");
            node("tr").child(name).child(node("td").attr("colspan", 4).text(details)).child(node("td"))
        }));
    }
    for row in &task.scores {
        let [scores, participants, clips] = [row.n_scores, row.n_participants, row.n_clips].map(count);
        rows.push(group(&format!(
            "{}: median {}, mean {:.2} of {scores} scores ({participants} participants, {clips} clips)",
            row.condition, row.median, row.mean
        )));
        rows.extend(statistic_rows(&row.statistics, 1.0, ""));
    }
    for pair in &task.pairs {
        let orders = pair.orders.map(|[above, tied, below]| format!("; {above} above, {tied} neither, {below} below"));
        let orders = orders.unwrap_or_default();
        let [votes, participants, clips] = [pair.n_votes, pair.n_participants, pair.n_clips].map(count);
        rows.push(group(&format!(
            "{} less {}: {:+.3} in {votes} votes ({participants} participants, {clips} clips{orders})",
            pair.first, pair.second, pair.difference
        )));
        rows.extend(statistic_rows(&pair.statistics, 1.0, ""));
    }
    if let Some(test) = &task.overall {
        rows.push(group("All conditions"));
        rows.push(statistic_row(test.origin, None, Some(test), None));
    }
    let head = COLUMNS.iter().map(|title| {
        let class = if ["Method", "Mark"].contains(title) { "" } else { "num" };
        node("th").attr("scope", "col").class(class).text(title)
    });
    let mut body = vec![node("div").class("scroll").attr("tabindex", "0").child(table("figures", head, rows))];
    if let Some(alpha) = task.agreement {
        let text = format!("Agreement of participants: Krippendorff's alpha = {alpha:.3} (1: perfect, 0: chance).");
        body.push(node("p").class("small").text(text));
    }
    body
}

fn share_title(share: &ShareAnalysis) -> String {
    let what = match share.measure {
        ShareMeasure::GeneratedChosen => "generated chosen",
        ShareMeasure::MatchedChosen => "matched chosen",
        ShareMeasure::Correct => "right",
        ShareMeasure::TakenForReal => "taken for real",
    };
    let (scope, percent) = (scope(share), percent(share.share));
    let [successes, votes] = [share.n_successes, share.n_votes].map(|n| count(n as usize));
    let [participants, clips] = [share.n_participants, share.n_clips].map(count);
    format!("{scope}: {what} in {successes} of {votes} votes, {percent} ({participants} participants, {clips} clips)")
}

fn group(title: &str) -> Node {
    node("tr").class("group").child(node("th").attr("colspan", COLUMNS.len()).attr("scope", "rowgroup").text(title))
}

/// Rows of a set: one per method with its interval and test, then equivalence tests.
fn statistic_rows(set: &StatisticSet, factor: f64, unit: &str) -> Vec<Node> {
    let ends = |ends: ConfidenceInterval| format!("{:.2} to {:.2}{unit}", factor * ends.low, factor * ends.high);
    let row = |StatisticRow { origin, interval, test }| statistic_row(origin, interval.map(ends), test, None);
    let mut rows: Vec<Node> = set.rows().map(row).collect();
    rows.extend(set.equivalence.iter().map(|test| {
        let shown = TestResult { origin: test.origin, ..TestResult::new(test.origin.method, test.p) };
        let outcome = if test.passes { "shown" } else { "not shown" };
        let (points, method) = (100.0 * test.bound, test.origin.method.name());
        let name = format!("equivalence within \u{b1}{points} points ({method}): {outcome}");
        let interval = format!("90 %: {}", ends(test.ends));
        statistic_row(test.origin, Some(interval), Some(&shown), Some(name))
    }));
    rows
}

fn statistic_row(
    origin: StatisticOrigin,
    interval: Option<String>,
    test: Option<&TestResult>,
    name: Option<String>,
) -> Node {
    let number = |text: String| node("td").class("num").text(text);
    let statistic = test.and_then(|test| {
        let freedom = test.degrees_of_freedom.map(|freedom| format!(" ({freedom:.1})")).unwrap_or_default();
        test.statistic.map(|statistic| format!("{statistic:.2}{freedom}"))
    });
    let mark = match (origin.exploratory, origin.naive) {
        (false, _) => node("span").class("registered").text("registered"),
        (true, false) => node("span").text("exploratory"),
        (true, true) => node("span").text("exploratory, naive"),
    };
    let row = if origin.naive { node("tr").class("is-naive") } else { node("tr") };
    row.child(node("th").attr("scope", "row").text(name.unwrap_or_else(|| origin.method.name().to_owned())))
        .child(number(interval.unwrap_or_default()))
        .child(number(statistic.unwrap_or_default()))
        .child(number(test.map(|test| bare_p(test.p)).unwrap_or_default()))
        .child(number(test.and_then(|test| test.adjusted_p).map(bare_p).unwrap_or_default()))
        .child(node("td").class("mark").child(mark))
}

/// Registered hypotheses with their outcomes.
pub(super) fn hypotheses(analysis: &StudyAnalysis) -> Vec<Node> {
    let rows = analysis.hypotheses.iter().flat_map(|hypothesis| {
        let title = group(&format!("{}: {} ({}).", hypothesis.task, hypothesis.claim, hypothesis.statistic));
        let rows = hypothesis.claims.iter().map(|claim| {
            let name = node("th").attr("scope", "row").text(&claim.scope);
            let p = node("td").class("num").text(claim.p.map(bare_p).unwrap_or_default());
            node("tr").child(name).child(p).child(node("td").text(claim.outcome()))
        });
        std::iter::once(title).chain(rows).collect::<Vec<_>>()
    });
    let head = [("About", ""), ("p", "num"), ("Outcome", "")]
        .map(|(title, class)| node("th").attr("scope", "col").class(class).text(title));
    let about = "Written down and sealed before the first participant. What is not shown is not refuted: a test that does \
                 not reject says nothing.";
    vec![node("p").text(about), node("div").class("scroll").attr("tabindex", "0").child(table("figures", head, rows))]
}

/// Rules with what each alone excludes, and refused rows.
pub(super) fn exclusions(analysis: &StudyAnalysis) -> Vec<Node> {
    let summary = &analysis.exclusions;
    let number = |n: usize| node("td").class("num").text(count(n));
    let cells = |name: &str, participants: usize, votes: usize, details: &str| {
        let name = node("th").attr("scope", "row").text(name);
        node("tr").child(name).child(number(participants)).child(number(votes)).child(node("td").text(details))
    };
    let mut rows = vec![cells("answered", summary.n_participants, summary.n_votes, "")];
    for rule in &summary.rules {
        let unknown = rule.unknown.as_deref().unwrap_or_default();
        rows.push(cells(&rule.rule, rule.n_participants, rule.n_votes, unknown));
    }
    rows.push(cells("analysed", summary.n_participants_kept, summary.n_votes_kept, ""));
    let head = ["", "Participants", "Votes", ""]
        .map(|title| node("th").attr("scope", "col").class(if title.is_empty() { "" } else { "num" }).text(title));
    let about = match (summary.registered, summary.rules.is_empty()) {
        (true, _) => "Rules that were registered, with what each leaves out by itself; a vote may fall under several.",
        (false, false) => "Rules of the study, which do not count as registered, with what each leaves out by itself.",
        (false, true) => "No rules were registered; every vote is analysed.",
    };
    let mut body = vec![node("p").text(about), node("div").class("scroll").child(table("figures", head, rows))];
    if !analysis.refused.is_empty() {
        let most = 200;
        body.push(node("h3").text(format!("{} rows that are no votes", count(analysis.refused.len()))));
        let line = |row: &RefusedRow| node("li").text(format!("line {}: {}", row.line, row.reason));
        body.push(node("ul").class("notes").children(analysis.refused.iter().take(most).map(line)));
        if analysis.refused.len() > most {
            body.push(node("p").class("small").text(format!("The first {most} are shown; the JSON result has all.")));
        }
    }
    body
}
