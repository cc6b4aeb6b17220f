//! Summary of an analysis for the terminal.

use super::conclusions::scope;
use super::number_format::{bare_p, count, counted, p_value, percent, percents, points};
use super::result::{ClipShare, StudyAnalysis, TaskAnalysis};
use super::statistic::{StatisticMethod, StatisticRow};
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

/// Lines with the headline statistics of a task.
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
        let _ = writeln!(text, "  {:<24} strength {:>+6.2}  Elo {:>6.0}", row.condition, row.log_strength, row.elo);
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
