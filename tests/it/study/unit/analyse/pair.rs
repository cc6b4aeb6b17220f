//! Tests of `orator_study::analyse::pair`.

use crate::fixtures::study::votes::example_vote;
use orator_study::analyse::outcome::Numbering;
use orator_study::analyse::pair::strengths;
use orator_study::analyse::result::StatisticSettings;
use orator_study::plan::TaskDesign;
use orator_study::vote::{Response, StudyVote};

fn vote(participant: usize, conditions: &[&str], response: Response) -> StudyVote {
    let participant = format!("p{participant}");
    StudyVote { participant, ..example_vote(TaskDesign::Preference, conditions, response) }
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
        pages.push(vote(n, &["bad", "natural", "good"], Response::Scores(vec![30, if turned { 20 } else { 35 }, 30])));
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
