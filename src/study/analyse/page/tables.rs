//! Tables of all statistics of a task with their registration status, of the hypotheses and of the exclusions.

use crate::analyse::conclusions::scope;
use crate::analyse::result::{ClipShare, ShareAnalysis, StudyAnalysis, TaskAnalysis};
use crate::analyse::statistic::{StatisticOrigin, StatisticRow, StatisticSet, TestResult};
use crate::analyse::text::{bare_p, count, counted, percent, points};
use crate::analyse::votes::read::RejectedRow;
use crate::stats::estimate::ConfidenceInterval;
use orator_base::text::number;
use orator_report::html::{Node, node, table};

const COLUMNS: [&str; 6] = ["Method", "Interval", "Statistic (df)", "p", "p after Holm", "Status"];

/// Table of a task's statistics, grouped by quantity.
pub(super) fn task(task: &TaskAnalysis) -> Vec<Node> {
    let mut rows = Vec::new();
    for share in &task.shares {
        rows.push(group(&share_title(share)));
        rows.extend(statistic_rows(&share.statistics, 100.0, " %"));
        rows.extend(share.model.as_ref().map(|model| {
            let details = format!(
                "log odds {:.3}, standard error {:.3}; standard deviations: participants {:.2}, clips {:.2}",
                model.log_odds, model.standard_error, model.sd_participants, model.sd_clips
            );
            let name = node("th").attr("scope", "row").text("estimates of the mixed model");
            node("tr").child(name).child(node("td").attr("colspan", 4).text(details)).child(node("td"))
        }));
    }
    for row in &task.scores {
        rows.push(group(&format!(
            "{}: median {}, mean {:.2} of {} ({})",
            row.condition,
            number(row.median),
            row.mean,
            counted(row.n_scores, "score"),
            sizes([row.n_participants, row.n_clips])
        )));
        rows.extend(statistic_rows(&row.statistics, 1.0, ""));
    }
    for pair in &task.pairs {
        let orders = pair
            .orders
            .map(|[above, tied, below]| format!("; {above} for the first, {tied} tied, {below} for the second"));
        let orders = orders.unwrap_or_default();
        let (votes, sizes) = (counted(pair.n_votes, "vote"), sizes([pair.n_participants, pair.n_clips]));
        rows.push(group(&format!(
            "{} minus {}: {:+.3} in {votes} ({sizes}{orders})",
            pair.first, pair.second, pair.difference
        )));
        rows.extend(statistic_rows(&pair.statistics, 1.0, ""));
    }
    if let Some(test) = &task.overall {
        rows.push(group("All conditions"));
        rows.push(statistic_row(test.origin, None, Some(test), None));
    }
    let head = COLUMNS.iter().map(|title| {
        let class = if ["Method", "Status"].contains(title) { "" } else { "num" };
        node("th").attr("scope", "col").class(class).text(title)
    });
    let mut body = vec![node("div").class("scroll").attr("tabindex", "0").child(table("figures", head, rows))];
    if !task.clips.is_empty() {
        body.push(clips(task));
    }
    if let Some(alpha) = task.agreement {
        let text = format!("Agreement of participants: Krippendorff's alpha = {alpha:.3} (1: perfect, 0: chance).");
        body.push(node("p").class("small").text(text));
    }
    body
}

fn clips(task: &TaskAnalysis) -> Node {
    let row = |of: &ClipShare| {
        let cell = |text: String| node("td").class("num").text(text);
        let name = node("th").attr("scope", "row").text(&of.clip);
        let (successes, votes) = (count(of.n_successes as usize), count(of.n_votes as usize));
        let cells = [successes, votes, percent(of.share)].map(cell);
        node("tr").child(name).child(node("td").text(&of.speaker)).children(cells)
    };
    let what = task.shares.first().map_or("", |share| share.measure.name());
    let head = [("Clip", ""), ("Speaker", ""), (what, "num"), ("Votes", "num"), ("Share", "num")]
        .map(|(title, class)| node("th").attr("scope", "col").class(class).text(title));
    let rows = task.clips.iter().map(row);
    node("div").class("scroll").attr("tabindex", "0").child(table("figures clips", head, rows))
}

fn share_title(share: &ShareAnalysis) -> String {
    let (what, scope, percent) = (share.measure.name(), scope(share), percent(share.share));
    let sd = share.participant_sd.map(|sd| format!("; standard deviation over participants {:.1} points", 100.0 * sd));
    let sd = sd.unwrap_or_default();
    let (successes, votes) = (count(share.n_successes as usize), counted(share.n_votes as usize, "vote"));
    let sizes = sizes([share.n_participants, share.n_clips]);
    format!("{scope}: {what} in {successes} of {votes}, {percent} ({sizes}{sd})")
}

fn sizes([participants, clips]: [usize; 2]) -> String {
    format!("{}, {}", counted(participants, "participant"), counted(clips, "clip"))
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
        let (points, method) = (points(test.bound), test.origin.method.name());
        let name = format!("equivalence within \u{b1}{points} percentage points ({method}): {outcome}");
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
    let cell = |text: String| node("td").class("num").text(text);
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
        .child(cell(interval.unwrap_or_default()))
        .child(cell(statistic.unwrap_or_default()))
        .child(cell(test.map(|test| bare_p(test.p)).unwrap_or_default()))
        .child(cell(test.and_then(|test| test.adjusted_p).map(bare_p).unwrap_or_default()))
        .child(node("td").class("mark").child(mark))
}

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
    let head = [("Scope", ""), ("p", "num"), ("Outcome", "")]
        .map(|(title, class)| node("th").attr("scope", "col").class(class).text(title));
    let seal = analysis.seal.as_ref().map(|seal| format!(" (BLAKE3 {seal})")).unwrap_or_default();
    let about = format!(
        "Fixed and sealed before the first participant{seal}. \"Not shown\" does not mean refuted: a test that is not \
         significant shows nothing."
    );
    vec![node("p").text(about), node("div").class("scroll").attr("tabindex", "0").child(table("figures", head, rows))]
}

/// Number of votes that each rule alone excludes, and rejected rows.
pub(super) fn exclusions(analysis: &StudyAnalysis) -> Vec<Node> {
    let summary = &analysis.exclusions;
    let number_cell = |n: usize| node("td").class("num").text(count(n));
    let cells = |name: &str, participants: usize, votes: usize, details: &str| {
        let name = node("th").attr("scope", "row").text(name);
        node("tr")
            .child(name)
            .child(number_cell(participants))
            .child(number_cell(votes))
            .child(node("td").text(details))
    };
    let mut rows = vec![cells("recorded", summary.n_participants, summary.n_votes, "")];
    for rule in &summary.rules {
        let unknown = rule.unknown.as_deref().unwrap_or_default();
        rows.push(cells(&rule.rule, rule.n_participants, rule.n_votes, unknown));
    }
    rows.push(cells("analysed", summary.n_participants_analysed, summary.n_votes_analysed, ""));
    let head = ["", "Participants", "Votes", ""]
        .map(|title| node("th").attr("scope", "col").class(if title.is_empty() { "" } else { "num" }).text(title));
    let about = match (summary.registered, summary.rules.is_empty()) {
        (true, _) => {
            "Registered rules, with the number that each excludes by itself; a vote may be excluded by several."
        }
        (false, false) => {
            "Rules of the study, which do not count as registered, with the number that each excludes by itself."
        }
        (false, true) => "No exclusion rules were registered; all votes are analysed.",
    };
    let mut body = vec![node("p").text(about), node("div").class("scroll").child(table("figures", head, rows))];
    if !analysis.rejected.is_empty() {
        let max_shown = 200;
        body.push(node("h3").text(counted(analysis.rejected.len(), "rejected row")));
        let line = |row: &RejectedRow| node("li").text(format!("line {}: {}", row.line, row.reason));
        body.push(node("ul").class("notes").children(analysis.rejected.iter().take(max_shown).map(line)));
        if analysis.rejected.len() > max_shown {
            body.push(
                node("p").class("small").text(format!("The first {max_shown} are listed; the JSON result lists all.")),
            );
        }
    }
    body
}
