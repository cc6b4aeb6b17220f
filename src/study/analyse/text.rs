//! Summary of an analysis for the terminal, and formatting of its numbers.

use super::conclusions::scope;
use super::result::{ClipShare, StrengthEstimate, StudyAnalysis, TaskAnalysis};
use super::statistic::{StatisticMethod, StatisticRow};
use crate::stats::bradley_terry::elo;
use crate::stats::estimate::ConfidenceInterval;
use orator_base::text::number;
use std::fmt::Write as _;

/// Maximum number of rejected rows that are listed.
const MAX_REJECTED: usize = 20;

/// Summary: conclusions with the headline statistics, exclusions and notes.
pub fn text(analysis: &StudyAnalysis) -> String {
    let mut text = String::new();
    let summary = &analysis.exclusions;
    let votes = counted(summary.n_votes_analysed, "vote");
    let participants = counted(summary.n_participants_analysed, "participant");
    let _ = writeln!(text, "{}: {votes} from {participants}", analysis.title);
    if !analysis.hypotheses.is_empty() {
        text += "\nregistered hypotheses\n";
        for hypothesis in &analysis.hypotheses {
            let _ = writeln!(text, "  {}: {}", hypothesis.task, hypothesis.claim);
            for claim in &hypothesis.claims {
                let p = claim.p.map(|p| format!(", {}", p_value(p))).unwrap_or_default();
                let _ = writeln!(text, "    {}: {}{p}", claim.scope, claim.outcome());
            }
        }
    }
    for task in &analysis.tasks {
        let _ = writeln!(text, "\n{}", task.task);
        for conclusion in &task.conclusions {
            let _ = writeln!(text, "  {conclusion}");
        }
        text += &rows(task);
    }
    if analysis.tasks.iter().any(|task| task.origins().any(|origin| origin.exploratory)) {
        text += "\n* exploratory: not registered before data collection\n";
    }
    if summary.any_excluded() {
        text += "\nexcluded by each rule alone\n";
        for rule in &summary.rules {
            let (participants, votes) = (counted(rule.n_participants, "participant"), counted(rule.n_votes, "vote"));
            let _ = writeln!(text, "  {:<44} {participants:>19} {votes:>14}", rule.rule);
        }
        for (task, all) in analysis.tasks.iter().zip(&analysis.without_exclusions) {
            if let Some((analysed, all)) = task.pooled().zip(all.pooled()) {
                let [analysed, all] = [analysed, all]
                    .map(|of| format!("{} of {}", percent(of.share), counted(of.n_votes as usize, "vote")));
                let _ = writeln!(text, "  {}: {analysed}, {all} without exclusions", task.task);
            }
        }
    }
    if !analysis.notes.is_empty() {
        text += "\nnotes\n";
        for note in &analysis.notes {
            let _ = writeln!(text, "  {note}");
        }
    }
    if !analysis.rejected.is_empty() {
        let _ = writeln!(text, "\nrejected rows: {}", count(analysis.rejected.len()));
        for row in analysis.rejected.iter().take(MAX_REJECTED) {
            let _ = writeln!(text, "  line {}: {}", row.line, row.reason);
        }
        if analysis.rejected.len() > MAX_REJECTED {
            text += "  ... (--json lists all)\n";
        }
    }
    text
}

fn rows(task: &TaskAnalysis) -> String {
    let mut text = String::new();
    let mark = |is_exploratory: bool| if is_exploratory { "*" } else { " " };
    for share in &task.shares {
        let (scope, percent, votes) = (scope(share), percent(share.share), count(share.n_votes as usize));
        let _ = writeln!(text, "\n  {scope:<46} {percent:>8} of {votes:>8} votes");
        if let Some(sd) = share.participant_sd {
            let (name, sd) = ("standard deviation over participants", format!("{:.1} points", 100.0 * sd));
            let _ = writeln!(text, "    {name:<44} {sd:>16}");
        }
        for StatisticRow { origin, interval, test } in share.statistics.rows() {
            let name = format!("{}{}", origin.method.name(), if origin.naive { ", naive" } else { "" });
            let interval = interval.map(percents).unwrap_or_default();
            let p = test.map(|test| format!("  p {}", bare_p(test.p))).unwrap_or_default();
            let _ = writeln!(text, "    {name:<44} {interval:>16}{p}{}", mark(origin.exploratory));
        }
        if let Some(model) = &share.model {
            let _ = writeln!(
                text,
                "    mixed model: standard deviations of log odds: participants {:.2}, clips {:.2}",
                model.sd_participants, model.sd_clips
            );
        }
        for test in &share.statistics.equivalence {
            let naive = if test.origin.naive { ", naive" } else { "" };
            let name = format!("equivalence within \u{b1}{} points{naive}", points(test.bound));
            let outcome = if test.passes { "shown" } else { "not shown" };
            let _ =
                writeln!(text, "    {name:<44} {outcome:>16}  p {}{}", bare_p(test.p), mark(test.origin.exploratory));
        }
    }
    if !task.clips.is_empty() {
        text += "\n  shares per clip\n";
    }
    for ClipShare { speaker, clip, n_votes, share, .. } in &task.clips {
        let _ = writeln!(
            text,
            "    {speaker:<20} {clip:<23} {:>16} of {:>8} votes",
            percent(*share),
            count(*n_votes as usize)
        );
    }
    for row in &task.scores {
        let interval = row.statistics.interval(StatisticMethod::Median);
        let interval = interval.map(|interval| format!("[{}, {}]", number(interval.low), number(interval.high)));
        let (interval, median) = (interval.unwrap_or_default(), number(row.median));
        let _ = writeln!(text, "  {:<24} median {median:>5} {interval:<12} mean {:>6.2}", row.condition, row.mean);
    }
    for row in &task.strengths {
        let ends = row.interval.as_ref().map(|interval| [interval.ends.low, interval.ends.high].map(elo));
        let interval = ends.map(|[low, high]| format!(" [{low:.0}, {high:.0}]")).unwrap_or_default();
        let StrengthEstimate { condition, log_strength, elo, .. } = row;
        let _ = writeln!(text, "  {condition:<24} strength {log_strength:>+6.2}  Elo {elo:>6.0}{interval}");
    }
    if let Some(test) = &task.overall {
        let _ =
            writeln!(text, "  {}: p {}{}", test.origin.method.name(), bare_p(test.p), mark(test.origin.exploratory));
    }
    if let Some(alpha) = task.agreement {
        let _ = writeln!(text, "  Krippendorff's alpha {alpha:.3}");
    }
    text
}

/// Count with thousands separators.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (idx, digit) in digits.chars().enumerate() {
        if idx > 0 && (digits.len() - idx).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Count with thousands separators and its noun: `1 vote`, `2,000 votes`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(n), if n == 1 { "" } else { "s" })
}

/// `p = 0.027`, `p = 6.5e-12`.
pub fn p_value(p: f64) -> String {
    format!("p = {}", bare_p(p))
}

/// p value without `p =`.
pub fn bare_p(p: f64) -> String {
    match p {
        p if p >= 0.9995 => "1".to_owned(),
        p if p >= 0.001 => format!("{p:.3}"),
        p if p >= 1e-99 => format!("{p:.1e}"),
        _ => "< 1e-99".to_owned(),
    }
}

/// Proportion in percent with one decimal.
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Interval of a proportion: `50.3 to 54.7 %`.
pub fn percents(interval: ConfidenceInterval) -> String {
    format!("{:.1} to {:.1} %", 100.0 * interval.low, 100.0 * interval.high)
}

/// Equivalence bound of a proportion in percentage points: `10`.
pub fn points(bound: f64) -> String {
    let points = (1000.0 * bound).round() / 10.0;
    format!("{points}")
}

/// Names joined by commas and a final `and`.
pub fn list(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
