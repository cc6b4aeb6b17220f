//! Bradley-Terry strengths of conditions from votes that rank them.

use super::outcome::Numbering;
use super::result::{StatisticSettings, StrengthEstimate};
use super::statistic::{IntervalEstimate, StatisticMethod, StatisticOrigin};
use crate::stats::bradley_terry::{self, PairedVote, elo, strength_intervals};
use crate::stats::estimate::StatisticsError;
use crate::vote::{Response, StudyVote};

/// Maximum number of bootstrap draws of participants for the intervals.
const MAX_DRAWS: usize = 2000;

/// Strengths of the conditions, highest first, with bootstrap intervals over participants.
///
/// # Errors
/// There are fewer than two conditions, or chains of wins do not connect every condition to every other.
pub fn strengths(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    settings: &StatisticSettings,
) -> Result<Vec<StrengthEstimate>, StatisticsError> {
    let paired: Vec<PairedVote> = votes.iter().flat_map(|vote| paired(vote, numbering, conditions)).collect();
    let n = conditions.len();
    let strengths = bradley_terry::strengths(&paired, n)?;
    let n_draws = settings.n_draws.min(MAX_DRAWS);
    let intervals = match n_draws {
        0 => None,
        // If too few draws have finite strengths, strengths are reported without intervals.
        _ => strength_intervals(&paired, n, settings.confidence, n_draws, settings.seed).ok(),
    };
    let origin = StatisticOrigin::new(StatisticMethod::BradleyTerry);
    let row = |k: usize| StrengthEstimate {
        condition: conditions[k].clone(),
        log_strength: strengths[k],
        interval: intervals.as_ref().map(|all| IntervalEstimate { origin, ends: all[k] }),
        elo: elo(strengths[k]),
    };
    let mut rows: Vec<StrengthEstimate> = (0..n).map(row).collect();
    rows.sort_by(|a, b| b.log_strength.total_cmp(&a.log_strength));
    Ok(rows)
}

/// Pairwise comparisons of a vote: its preference step as a share of a win, or which of two scores is higher.
fn paired(vote: &StudyVote, numbering: &Numbering, conditions: &[String]) -> Vec<PairedVote> {
    let index = |name: &String| conditions.iter().position(|condition| condition == name);
    let Some(shown) = vote.conditions.iter().map(index).collect::<Option<Vec<usize>>>() else { return Vec::new() };
    let participant = numbering.vote(vote, 0.0).participant;
    let pair = |a: usize, b: usize, share: f64| PairedVote { participant, first: shown[a], second: shown[b], share };
    match &vote.response {
        // Steps range from -2 for the left film to 2 for the right film.
        Response::Step(step) if shown.len() == 2 => vec![pair(0, 1, (2.0 - f64::from(*step)) / 4.0)],
        Response::Scores(scores) if scores.len() == shown.len() => {
            let pairs = (0..shown.len()).flat_map(|a| (a + 1..scores.len()).map(move |b| (a, b)));
            pairs.map(|(a, b)| pair(a, b, 0.5 + 0.5 * f64::from(scores[a].cmp(&scores[b]) as i8))).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::TaskDesign;

    fn vote(participant: usize, conditions: &[&str], response: Response) -> StudyVote {
        let participant = format!("p{participant}");
        StudyVote { participant, ..StudyVote::example(TaskDesign::Preference, conditions, response) }
    }

    #[test]
    fn steps_and_scores_rank_conditions() {
        let names = ["bad", "good", "natural"].map(str::to_owned);
        let settings = StatisticSettings { n_draws: 200, ..StatisticSettings::default() };
        let mut steps = Vec::new();
        let mut pages = Vec::new();
        for n in 0..30 {
            let turned = n % 5 == 0;
            for (worse, better) in [("bad", "good"), ("good", "natural"), ("bad", "natural")] {
                steps.push(vote(n, &[worse, better], Response::Step(if turned { -1 } else { 2 })));
                steps.push(vote(n, &[better, worse], Response::Step(-1)));
            }
            let scores = if turned { vec![50, 60, 40] } else { vec![20, 90, 60] };
            pages.push(vote(n, &["bad", "natural", "good"], Response::Scores(scores)));
            pages.push(vote(
                n,
                &["bad", "natural", "good"],
                Response::Scores(vec![30, if turned { 20 } else { 35 }, 30]),
            ));
        }
        for votes in [steps, pages] {
            let votes: Vec<&StudyVote> = votes.iter().collect();
            let rows = strengths(&votes, &Numbering::new(&votes), &names, &settings).unwrap();
            let ranked: Vec<&str> = rows.iter().map(|row| row.condition.as_str()).collect();
            assert_eq!(ranked, ["natural", "good", "bad"]);
            assert!(rows.is_sorted_by(|a, b| a.elo >= b.elo));
            let interval = rows[0].interval.as_ref().unwrap();
            assert!(interval.ends.low < rows[0].log_strength && rows[0].log_strength < interval.ends.high);
        }
        let one_way = vote(0, &["bad", "good"], Response::Step(2));
        let votes = [&one_way];
        assert!(strengths(&votes, &Numbering::new(&votes), &names, &settings).is_err());
    }
}
