//! Generates a paragraph for the methods section of a paper from an analysis: plain text with citations in parentheses.

use super::exclusion::{ExclusionCount, ExclusionSummary};
use super::result::{ShareMeasure, StudyAnalysis, TaskAnalysis};
use super::statistic::StatisticMethod;
use super::text::{counted, list, p_value, percent, percents, points};
use crate::plan::TaskDesign;
use orator_base::text::number;
use std::fmt::Write as _;

/// References, one per line: the citation as used in the text, and the full reference.
const SOURCES: &str = include_str!("sources.txt");

pub fn methods(analysis: &StudyAnalysis) -> String {
    let mut text = participants(analysis);
    text += &exclusions(&analysis.exclusions);
    for task in &analysis.tasks {
        text += &of_task(task);
    }
    text += &statistics(analysis);
    text += &registration_status(analysis);
    text += &results(analysis);
    let sources = SOURCES.lines().filter_map(|line| line.split_once(": "));
    let cited: Vec<&str> = sources.filter(|(name, _)| text.contains(name)).map(|(_, source)| source).collect();
    format!("{}\n\nReferences: {}", text.trim_end(), cited.join(" "))
}

fn participants(analysis: &StudyAnalysis) -> String {
    let summary = &analysis.exclusions;
    let mut text = format!(
        "{} gave {} in {}. ",
        counted(summary.n_participants, "participant"),
        counted(summary.n_votes, "vote"),
        counted(analysis.tasks.len(), "task")
    );
    if !analysis.rejected.is_empty() {
        let rows = counted(analysis.rejected.len(), "invalid row");
        let _ = write!(text, "{rows} of the table of votes could not be used. ");
    }
    text
}

fn exclusions(summary: &ExclusionSummary) -> String {
    if summary.rules.is_empty() {
        return "No votes were excluded. ".to_owned();
    }
    let rule = |count_of: &ExclusionCount| match &count_of.unknown {
        Some(_) => format!("{} (not applicable: not recorded)", count_of.rule),
        None if count_of.n_participants > 0 => {
            let participants = counted(count_of.n_participants, "participant");
            format!("{} ({participants}, {})", count_of.rule, counted(count_of.n_votes, "vote"))
        }
        None => format!("{} ({})", count_of.rule, counted(count_of.n_votes, "vote")),
    };
    let applied = match summary.registered {
        true => "Exclusion rules fixed before the study were applied",
        false => "Exclusion rules were applied that do not count as registered in advance",
    };
    format!(
        "{applied}: {}; {} from {} remain. ",
        list(&summary.rules.iter().map(rule).collect::<Vec<_>>()),
        counted(summary.n_votes_analysed, "vote"),
        counted(summary.n_participants_analysed, "participant")
    )
}

fn of_task(task: &TaskAnalysis) -> String {
    let procedure = match task.design {
        TaskDesign::Turing => {
            "participants saw a real and a generated motion for the same speech side by side and chose the real one"
        }
        TaskDesign::TuringSingle => "participants saw one video at a time and judged whether its motion was real",
        TaskDesign::Preference => {
            "participants saw two motions for the same speech side by side and rated their preference in five steps"
        }
        TaskDesign::Sliders => {
            "participants rated all conditions of a speech on one page from 0 to 100 (Jonell et al. 2021)"
        }
        TaskDesign::Mismatch => {
            "participants saw two motions, one of which belonged to the speech in the video, and chose the matching one"
        }
    };
    let speakers = match task.speakers.len() {
        0 | 1 => String::new(),
        n => format!(" of {n} speakers"),
    };
    format!(
        "In the task {}, {procedure} ({} from {} on {}{speakers}). ",
        task.task,
        counted(task.n_votes, "vote"),
        counted(task.n_participants, "participant"),
        counted(task.n_clips, "clip")
    )
}

fn statistics(analysis: &StudyAnalysis) -> String {
    let settings = &analysis.settings;
    let is_used = |method: StatisticMethod| {
        analysis.tasks.iter().any(|task| task.origins().any(|origin| origin.method == method))
    };
    let mut text = format!(
        "Votes of one participant, and votes about one clip, are not independent (Clark 1973); standard errors \
         therefore treat participants and clips as crossed factors (Cameron et al. 2011), with a t distribution and \
         Satterthwaite's degrees of freedom. Intervals are {:.0} % confidence intervals. ",
        100.0 * settings.confidence
    );
    if analysis.tasks.iter().any(|task| !task.shares.is_empty()) {
        let _ = write!(
            text,
            "Equivalence with chance within \u{b1}{} percentage points was tested by two one-sided tests at 5 % \
             (Schuirmann 1987). ",
            list(&bounds(analysis))
        );
    }
    if is_used(StatisticMethod::SignFlip) {
        text += "Sign flips of participants or of clips, whichever are fewer, test the same hypothesis without a t \
            distribution (MacKinnon et al. 2021). ";
    }
    if is_used(StatisticMethod::Sides) {
        text += "The permutation test of sides is exact, over all assignments of the real motion to left and right \
            within a participant. ";
    }
    if analysis.tasks.iter().flat_map(|task| &task.shares).any(|share| share.model.is_some()) {
        text += "Mixed logistic regressions have random intercepts of participants and clips (Laplace approximation, \
            as in Bates et al. 2015). ";
    }
    if is_used(StatisticMethod::Wilcoxon) {
        text += "Pairs of conditions were also compared by Wilcoxon's signed-rank test of participants' mean \
            differences (Wilcoxon 1945). ";
    }
    if is_used(StatisticMethod::Friedman) {
        text +=
            "All conditions were compared jointly by Friedman's test of participants' mean scores (Friedman 1937). ";
    }
    if analysis.tasks.iter().any(|task| !task.strengths.is_empty()) {
        text += "Strengths of conditions are those of a Bradley-Terry model (Bradley and Terry 1952). ";
    }
    if analysis.tasks.iter().flat_map(TaskAnalysis::tests).any(|test| test.adjusted_p.is_some()) {
        text += "p values of several speakers, conditions or pairs were adjusted by Holm's method (Holm 1979). ";
    }
    if analysis.tasks.iter().any(|task| task.agreement.is_some()) {
        text += "Agreement between participants is Krippendorff's alpha (Krippendorff 2011). ";
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

fn registration_status(analysis: &StudyAnalysis) -> String {
    match &analysis.seal {
        Some(seal) => format!(
            "Hypotheses, exclusion rules and analysis were registered and sealed before the first participant (BLAKE3 \
             {seal}); all other statistics are exploratory. "
        ),
        None => "The analysis was not pre-registered: all statistics are exploratory. ".to_owned(),
    }
}

fn results(analysis: &StudyAnalysis) -> String {
    let mut text = String::new();
    for task in &analysis.tasks {
        for share in task.shares.iter().filter(|share| share.measure != ShareMeasure::JudgedReal) {
            let statistics = &share.statistics;
            let Some((interval, test)) =
                statistics.interval(StatisticMethod::Crossed).zip(statistics.test(StatisticMethod::Crossed))
            else {
                continue;
            };
            let freedom = test.degrees_of_freedom.map(|freedom| format!("({freedom:.1})")).unwrap_or_default();
            let statistic = test.statistic.map(|t| format!("t{freedom} = {t:.2}, ")).unwrap_or_default();
            let adjusted = test.adjusted_p.map(|p| format!(", {} after Holm", p_value(p))).unwrap_or_default();
            let equivalence = statistics.equivalence(StatisticMethod::Crossed).map(|test| {
                format!("; equivalence within \u{b1}{} percentage points: {}", points(test.bound), p_value(test.p))
            });
            let _ = write!(
                text,
                "{}, {}: {} in {} of the votes [{}], {statistic}{}{adjusted}{}. ",
                task.task,
                super::conclusions::scope(share),
                share.measure.name(),
                percent(share.share),
                percents(interval),
                p_value(test.p),
                equivalence.unwrap_or_default()
            );
        }
        for row in &task.scores {
            let interval = row.statistics.interval(StatisticMethod::Median);
            let interval = interval.map(|interval| format!(" [{}, {}]", number(interval.low), number(interval.high)));
            let (interval, median) = (interval.unwrap_or_default(), number(row.median));
            let _ = write!(text, "{}, {}: median {median}{interval}, mean {:.1}. ", task.task, row.condition, row.mean);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_count_as_fixed_in_advance_only_with_an_intact_seal() {
        let rule = ExclusionCount { rule: "failed 1 check".to_owned(), n_participants: 1, n_votes: 2, unknown: None };
        let mut summary = ExclusionSummary {
            registered: true,
            n_participants_analysed: 1,
            n_votes_analysed: 3,
            rules: vec![rule],
            ..ExclusionSummary::default()
        };
        let text = exclusions(&summary);
        assert!(
            text.contains("fixed before the study were applied: failed 1 check (1 participant, 2 votes)"),
            "{text}"
        );
        assert!(text.contains("3 votes from 1 participant remain"), "{text}");
        summary.registered = false;
        let text = exclusions(&summary);
        assert!(text.contains("do not count as registered") && !text.contains("before the study"), "{text}");
    }
}
