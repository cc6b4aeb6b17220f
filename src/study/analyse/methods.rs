//! Generates a paragraph for the methods section of a paper from an analysis: plain text with citations in parentheses.

use super::number_format::{count, list, p_value, percent, percents, points};
use super::result::{ShareMeasure, StudyAnalysis, TaskAnalysis};
use super::statistic::StatisticMethod;
use crate::plan::TaskDesign;
use std::fmt::Write as _;

/// References, one per line: the citation as used in the text, and the full reference.
const SOURCES: &str = include_str!("sources.txt");

/// Methods paragraph with its list of references.
pub fn methods(analysis: &StudyAnalysis) -> String {
    let mut text = participants(analysis);
    text += &exclusions(analysis);
    for task in &analysis.tasks {
        text += &of_task(task);
    }
    text += &statistics(analysis);
    text += &registered(analysis);
    text += &results(analysis);
    let sources = SOURCES.lines().filter_map(|line| line.split_once(": "));
    let cited: Vec<&str> = sources.filter(|(name, _)| text.contains(name)).map(|(_, source)| source).collect();
    format!("{}\n\nSources: {}", text.trim_end(), cited.join(" "))
}

fn participants(analysis: &StudyAnalysis) -> String {
    let summary = &analysis.exclusions;
    let mut text = format!(
        "{} participants gave {} votes in {}. ",
        count(summary.n_participants),
        count(summary.n_votes),
        match analysis.tasks.len() {
            1 => "one task".to_owned(),
            n => format!("{n} tasks"),
        }
    );
    if !analysis.refused.is_empty() {
        let _ =
            write!(text, "{} rows of the table could not be read as votes and were left out. ", analysis.refused.len());
    }
    text
}

fn exclusions(analysis: &StudyAnalysis) -> String {
    let summary = &analysis.exclusions;
    if summary.rules.is_empty() {
        return "No vote was excluded. ".to_owned();
    }
    let rule = |count_of: &super::exclusion::ExclusionCount| match &count_of.unknown {
        Some(_) => format!("{} (not applicable: not recorded)", count_of.rule),
        None if count_of.n_participants > 0 => {
            let [participants, votes] = [count_of.n_participants, count_of.n_votes].map(count);
            format!("{} ({participants} participants, {votes} votes)", count_of.rule)
        }
        None => format!("{} ({} votes)", count_of.rule, count(count_of.n_votes)),
    };
    format!(
        "By rules fixed before the study, votes were excluded of participants or trials that {}; {} participants and {} \
         votes remain. ",
        list(&summary.rules.iter().map(rule).collect::<Vec<_>>()),
        count(summary.n_participants_kept),
        count(summary.n_votes_kept)
    )
}

fn of_task(task: &TaskAnalysis) -> String {
    let asked = match task.design {
        TaskDesign::Turing => {
            "participants saw a real and a generated motion of one speech side by side and chose the real one"
        }
        TaskDesign::TuringSingle => "participants saw one film at a time and said whether its motion was real",
        TaskDesign::Preference => {
            "participants saw two motions of one speech side by side and gave their preference in five steps"
        }
        TaskDesign::Sliders => {
            "participants scored the conditions of one speech on one page from 0 to 100 (Jonell et al. 2021)"
        }
        TaskDesign::Mismatch => {
            "participants saw two motions, one of which belonged to the speech that was heard, and chose the fitting one"
        }
    };
    let speakers = match task.speakers.len() {
        0 | 1 => String::new(),
        n => format!(" of {n} speakers"),
    };
    format!(
        "In the task {}, {asked} ({} votes of {} participants on {} clips{speakers}). ",
        task.task,
        count(task.n_votes),
        count(task.n_participants),
        count(task.n_clips)
    )
}

fn statistics(analysis: &StudyAnalysis) -> String {
    let settings = &analysis.settings;
    let is_used = |method: StatisticMethod| {
        analysis.tasks.iter().any(|task| task.origins().any(|origin| origin.method == method))
    };
    let mut text = format!(
        "Votes of one participant, and votes about one clip, are not independent (Clark 1973); estimates have standard \
         errors with participants and clips crossed (Cameron et al. 2011), judged by the t distribution with \
         Satterthwaite's degrees of freedom; intervals are {:.0} % ones. ",
        100.0 * settings.confidence
    );
    if analysis.tasks.iter().any(|task| !task.shares.is_empty()) {
        let _ = write!(
            text,
            "Equivalence with chance within \u{b1}{} points was tested by two one-sided tests at 5 % (Schuirmann 1987). ",
            list(&bounds(analysis))
        );
    }
    if is_used(StatisticMethod::SignFlip) {
        text += "Sign flips of whole participants or clips, whichever are fewer, test the same without a t distribution (MacKinnon et al. 2021). ";
    }
    if is_used(StatisticMethod::Sides) {
        text += "The permutation test of sides is exact, over all assignments of the real film to left and right within a participant. ";
    }
    if analysis.tasks.iter().flat_map(|task| &task.shares).any(|share| share.model.is_some()) {
        text += "Mixed logistic regressions have random intercepts of participants and clips (Laplace approximation, as in Bates et al. 2015). ";
    }
    if is_used(StatisticMethod::Wilcoxon) {
        text += "Pairs of conditions were also compared by Wilcoxon's signed ranks of participants' mean differences (Wilcoxon 1945). ";
    }
    if is_used(StatisticMethod::Friedman) {
        text +=
            "All conditions together were compared by Friedman's test of participants' mean scores (Friedman 1937). ";
    }
    if analysis.tasks.iter().any(|task| !task.strengths.is_empty()) {
        text += "Strengths of conditions are those of a Bradley-Terry model (Bradley and Terry 1952). ";
    }
    if analysis.tasks.iter().flat_map(TaskAnalysis::tests).any(|test| test.adjusted_p.is_some()) {
        text += "p values of several speakers, conditions or pairs were adjusted by Holm's method (Holm 1979). ";
    }
    if analysis.tasks.iter().any(|task| task.agreement.is_some()) {
        text += "Agreement of participants is Krippendorff's alpha (Krippendorff 2011). ";
    }
    text
}

/// Bounds of the equivalence tests, percentage points.
fn bounds(analysis: &StudyAnalysis) -> Vec<String> {
    let tests = analysis.tasks.iter().flat_map(|task| &task.shares).flat_map(|share| &share.statistics.equivalence);
    let mut bounds: Vec<String> = tests.map(|test| points(test.bound)).collect();
    bounds.sort();
    bounds.dedup();
    bounds
}

fn registered(analysis: &StudyAnalysis) -> String {
    match &analysis.seal {
        Some(seal) => format!(
            "Hypotheses, exclusion rules and analysis were registered before the first participant (BLAKE3 {seal}); all \
             other figures are exploratory. "
        ),
        None => "The analysis was not pre-registered: all figures are exploratory. ".to_owned(),
    }
}

/// Sentences with the headline statistics.
fn results(analysis: &StudyAnalysis) -> String {
    let mut text = String::new();
    for task in &analysis.tasks {
        for share in task.shares.iter().filter(|share| share.measure != ShareMeasure::TakenForReal) {
            let statistics = &share.statistics;
            let Some((interval, test)) =
                statistics.interval(StatisticMethod::Crossed).zip(statistics.test(StatisticMethod::Crossed))
            else {
                continue;
            };
            let freedom = test.degrees_of_freedom.map(|freedom| format!("({freedom:.1})")).unwrap_or_default();
            let statistic = test.statistic.map(|t| format!("t{freedom} = {t:.2}, ")).unwrap_or_default();
            let adjusted = test.adjusted_p.map(|p| format!(", {} after Holm", p_value(p))).unwrap_or_default();
            let equivalence = statistics
                .equivalence(StatisticMethod::Crossed)
                .map(|test| format!("; equivalence within \u{b1}{} points {}", points(test.bound), p_value(test.p)));
            let _ = write!(
                text,
                "{}, {}: {} [{}], {statistic}{}{adjusted}{}. ",
                task.task,
                super::verdict::scope(share),
                percent(share.share),
                percents(interval),
                p_value(test.p),
                equivalence.unwrap_or_default()
            );
        }
        for row in &task.scores {
            let interval = row.statistics.interval(StatisticMethod::Median);
            let interval =
                interval.map(|interval| format!(" [{}, {}]", interval.low, interval.high)).unwrap_or_default();
            text +=
                &format!("{}, {}: median {}{interval}, mean {:.1}. ", task.task, row.condition, row.median, row.mean);
        }
    }
    text
}
