//! Verdicts: sentences on what can be concluded from a task and what cannot.

use super::number_format::{count, p_value, percent, percents, points};
use super::result::{Conclusion, PairAnalysis, ShareAnalysis, ShareMeasure, StatisticSettings, TaskAnalysis};
use super::statistic::StatisticMethod;
use crate::plan::TaskDesign;

/// Maximum number of pairs with individual sentences.
const MAX_PAIRS: usize = 6;

/// Sentences about a task, the most important first.
pub fn verdicts(task: &TaskAnalysis, settings: &StatisticSettings) -> Vec<String> {
    let mut sentences: Vec<String> = Vec::new();
    let shares = task.shares.iter().filter(|share| share.measure != ShareMeasure::TakenForReal);
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
        ShareMeasure::GeneratedChosen => "the generated motion was taken for the real one in",
        ShareMeasure::MatchedChosen => "the motion of the heard speech was chosen in",
        ShareMeasure::Correct => "real and generated motion were told apart in",
        ShareMeasure::TakenForReal => "the film was taken for real in",
    };
    let confidence = format!("{:.0} %", 100.0 * settings.confidence);
    let first = || share.statistics.intervals.first().map(|interval| interval.ends);
    let interval = share.statistics.interval(StatisticMethod::Crossed).or_else(first);
    let interval =
        interval.map(|interval| format!(" ({confidence} interval {})", percents(interval))).unwrap_or_default();
    let (n, share_of) = (count(share.n_votes as usize), percent(share.share));
    format!(
        "{}: {what} {share_of} of {n} votes{interval}. {}{}",
        capitalise(&scope(share)),
        conclusion_sentence(share),
        naive(share, settings.level())
    )
}

/// Sentence that explains a conclusion, with its p values.
fn conclusion_sentence(share: &ShareAnalysis) -> String {
    let p = share.statistics.crossed_p().map(p_value).unwrap_or_default();
    let test = share.statistics.equivalence(StatisticMethod::Crossed);
    let equivalence = test.map(|test| p_value(test.p)).unwrap_or_default();
    let bound = test.map(|test| points(test.bound)).unwrap_or_default();
    let within = format!(
        "The difference from chance lies within the bound of \u{b1}{bound} points (equivalence, {equivalence})"
    );
    let (above, below) = match share.measure {
        ShareMeasure::GeneratedChosen => (
            "more often than by chance: it was preferred to the real motion as the real one",
            "less often than by chance: it can be told from the real motion",
        ),
        ShareMeasure::MatchedChosen => (
            "more often than by chance: the motion fits its speech better than that of another",
            "less often than by chance: the motion of another speech was found more fitting",
        ),
        ShareMeasure::Correct | ShareMeasure::TakenForReal => (
            "more often than by chance: they can be told apart",
            "less often than by chance: they are told apart, with the names exchanged",
        ),
    };
    match share.conclusion {
        Conclusion::Above => format!("That is {above} ({p})."),
        Conclusion::Below => format!("That is {below} ({p})."),
        Conclusion::AboveWithinBound => format!("That is {above} ({p}). {within}: it is there, but small."),
        Conclusion::BelowWithinBound => format!("That is {below} ({p}). {within}: it is there, but small."),
        Conclusion::Equivalent => {
            format!("No difference from chance was found ({p}). {within}: within it, the two are equivalent.")
        }
        Conclusion::Undecided => format!(
            "Nothing can be concluded: chance is not ruled out ({p}), and neither are differences of {bound} points \
             (equivalence, {equivalence}). Failing to reject is not passing."
        ),
        Conclusion::Untested => {
            let why = share.statistics.missing.first().map(|why| format!(": {why}")).unwrap_or_default();
            format!("There is no test that holds for other participants and clips{why}.")
        }
    }
}

/// Remark on the naive binomial test if it contradicts the crossed test.
fn naive(share: &ShareAnalysis, level: f64) -> String {
    let Some((p, naive)) = share.statistics.crossed_p().zip(share.statistics.test(StatisticMethod::Binomial)) else {
        return String::new();
    };
    match (p < level) == (naive.p < level) {
        true => String::new(),
        false => format!(
            " Taken for independent, which they are not, the votes would say the opposite (binomial test, {}).",
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
        TaskDesign::TuringSingle => (100.0, "taken for real more often than", "points of percent"),
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
        Conclusion::Untested => format!("{high} and {low}: there is no test ({size})."),
        Conclusion::Undecided | Conclusion::Equivalent => {
            format!("No difference was found between {high} and {low} ({size}). That does not show that there is none.")
        }
        _ => format!("{high} was {verb} {low} ({size})."),
    }
}

fn many_pairs_sentence(task: &TaskAnalysis) -> String {
    let is_found = |pair: &&PairAnalysis| {
        !matches!(pair.conclusion, Conclusion::Undecided | Conclusion::Equivalent | Conclusion::Untested)
    };
    let n_found = task.pairs.iter().filter(is_found).count();
    format!(
        "A difference was found in {n_found} of {} pairs of conditions, after Holm's adjustment. Of the others it is not \
         shown that they do not differ.",
        task.pairs.len()
    )
}

fn capitalise(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
