//! Conclusions: sentences on what the votes of a task show and what they do not show.

use super::result::{PairAnalysis, ShareAnalysis, ShareMeasure, StatisticSettings, TaskAnalysis, TestOutcome};
use super::statistic::StatisticMethod;
use super::text::{counted, p_value, percent, percents, points};
use crate::plan::TaskDesign;

/// Maximum number of pairs with individual sentences.
const MAX_PAIRS: usize = 6;

/// Sentences about a task, the most important first.
pub fn conclusions(task: &TaskAnalysis, settings: &StatisticSettings) -> Vec<String> {
    let mut sentences: Vec<String> = Vec::new();
    let shares = task.shares.iter().filter(|share| share.measure != ShareMeasure::JudgedReal);
    sentences.extend(shares.map(|share| share_sentence(share, settings)));
    if task.pairs.len() > MAX_PAIRS {
        sentences.push(many_pairs_sentence(task));
    } else {
        sentences.extend(task.pairs.iter().map(|pair| pair_sentence(pair, task.design)));
    }
    sentences
}

/// Part of the votes that a proportion covers.
pub fn scope(share: &ShareAnalysis) -> String {
    match (&share.speaker, &share.condition) {
        (Some(speaker), _) => format!("speaker {speaker}"),
        (None, Some(condition)) => condition.clone(),
        (None, None) => "all votes".to_owned(),
    }
}

fn share_sentence(share: &ShareAnalysis, settings: &StatisticSettings) -> String {
    let what = match share.measure {
        ShareMeasure::GeneratedChosen => "the generated motion was chosen as the real one in",
        ShareMeasure::MatchedChosen => "the matching motion was chosen in",
        ShareMeasure::Correct => "the response (real or generated) was correct in",
        ShareMeasure::JudgedReal => "the film was judged real in",
    };
    let confidence = format!("{:.0} %", 100.0 * settings.confidence);
    let first = || share.statistics.intervals.first().map(|interval| interval.ends);
    let interval = share.statistics.interval(StatisticMethod::Crossed).or_else(first);
    let interval =
        interval.map(|interval| format!(" ({confidence} interval {})", percents(interval))).unwrap_or_default();
    let (votes, share_of) = (counted(share.n_votes as usize, "vote"), percent(share.share));
    format!(
        "{}: {what} {share_of} of {votes}{interval}. {}{}",
        capitalise(&scope(share)),
        conclusion_sentence(share),
        naive(share, settings.level())
    )
}

fn conclusion_sentence(share: &ShareAnalysis) -> String {
    let p = share.statistics.crossed_p().map(p_value).unwrap_or_default();
    let test = share.statistics.equivalence(StatisticMethod::Crossed);
    let equivalence = test.map(|test| p_value(test.p)).unwrap_or_default();
    let bound = test.map(|test| points(test.bound)).unwrap_or_default();
    let within = format!(
        "The difference from chance lies within the bound of \u{b1}{bound} percentage points (equivalence test, \
         {equivalence})"
    );
    let (above, below) = match share.measure {
        ShareMeasure::GeneratedChosen => (
            "more often than by chance: participants mistook it for the real motion",
            "less often than by chance: it can be distinguished from the real motion",
        ),
        ShareMeasure::MatchedChosen => (
            "more often than by chance: it fits the speech better than the motion of another speech",
            "less often than by chance: the motion of another speech was judged to fit better",
        ),
        ShareMeasure::Correct | ShareMeasure::JudgedReal => (
            "more often than by chance: real and generated motion can be distinguished",
            "less often than by chance: they can be distinguished, but generated motion was judged real and real \
             motion generated",
        ),
    };
    match share.conclusion {
        TestOutcome::Above => format!("That is {above} ({p})."),
        TestOutcome::Below => format!("That is {below} ({p})."),
        TestOutcome::AboveWithinBound => format!("That is {above} ({p}). {within}: it is significant, but small."),
        TestOutcome::BelowWithinBound => format!("That is {below} ({p}). {within}: it is significant, but small."),
        TestOutcome::Equivalent => {
            format!("No difference from chance was found ({p}). {within}: equivalent up to this bound.")
        }
        TestOutcome::Inconclusive => format!(
            "Inconclusive: the tests rule out neither chance ({p}) nor differences of {bound} percentage points or more \
             (equivalence test, {equivalence}). A test that is not significant does not show equality."
        ),
        TestOutcome::Untested => {
            let reason = share.statistics.missing.first().map(|reason| format!(": {reason}")).unwrap_or_default();
            format!("No test that generalises to other participants and clips could be computed{reason}.")
        }
    }
}

/// Sentence on the naive binomial test if it contradicts the crossed test.
fn naive(share: &ShareAnalysis, level: f64) -> String {
    let Some((p, naive)) = share.statistics.crossed_p().zip(share.statistics.test(StatisticMethod::Binomial)) else {
        return String::new();
    };
    match (p < level) == (naive.p < level) {
        true => String::new(),
        false => format!(
            " A binomial test, which wrongly treats the votes as independent, gives the opposite result ({}).",
            p_value(naive.p)
        ),
    }
}

fn pair_sentence(pair: &PairAnalysis, design: TaskDesign) -> String {
    let (high, low, sign) = match pair.difference >= 0.0 {
        true => (&pair.first, &pair.second, 1.0),
        false => (&pair.second, &pair.first, -1.0),
    };
    let (scale, verb, unit) = match design {
        TaskDesign::Sliders => (1.0, "rated above", "points of 100"),
        TaskDesign::TuringSingle => (100.0, "judged real more often than", "percentage points"),
        _ => (1.0, "preferred to", "steps of a scale from -2 to 2"),
    };
    let ends = pair.statistics.interval(StatisticMethod::Crossed).map(|interval| {
        let mut ends = [sign * scale * interval.low, sign * scale * interval.high];
        ends.sort_by(f64::total_cmp);
        format!(", interval {:.2} to {:.2}", ends[0], ends[1])
    });
    let test = pair.statistics.test(StatisticMethod::Crossed);
    let p = test.map(|test| match test.adjusted_p {
        Some(p) => format!(", {} after Holm", p_value(p)),
        None => format!(", {}", p_value(test.p)),
    });
    let size =
        format!("{:.2} {unit}{}{}", scale * pair.difference.abs(), ends.unwrap_or_default(), p.unwrap_or_default());
    match pair.conclusion {
        TestOutcome::Untested => format!("{high} and {low}: not tested ({size})."),
        TestOutcome::Inconclusive | TestOutcome::Equivalent => {
            format!(
                "No difference was found between {high} and {low} ({size}). This does not show that they are equal."
            )
        }
        _ => format!("{high} was {verb} {low} ({size})."),
    }
}

fn many_pairs_sentence(task: &TaskAnalysis) -> String {
    let is_found = |pair: &&PairAnalysis| {
        !matches!(pair.conclusion, TestOutcome::Inconclusive | TestOutcome::Equivalent | TestOutcome::Untested)
    };
    let n_found = task.pairs.iter().filter(is_found).count();
    format!(
        "A difference was found in {n_found} of {} of conditions, after Holm's adjustment. For the others, this does \
         not show that they are equal.",
        counted(task.pairs.len(), "pair")
    )
}

fn capitalise(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
