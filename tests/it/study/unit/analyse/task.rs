//! Tests of `orator_study::analyse::task`.

use crate::fixtures::study::votes::example_vote;
use orator_study::analyse::result::{StatisticSettings, TaskAnalysis};
use orator_study::analyse::task::task;
use orator_study::plan::TaskDesign;
use orator_study::vote::{Response, ScreenSide, StudyVote};

/// Three participants and two clips of each of two speakers; the right film is chosen in five of eight votes.
#[test]
fn shares_of_participants_and_clips_are_those_computed_by_hand() {
    let side = |is_right: bool| Response::Side(if is_right { ScreenSide::Left } else { ScreenSide::Right });
    let rows = [
        ("a", "x/1", true),
        ("a", "x/2", true),
        ("a", "y/1", false),
        ("a", "y/2", true),
        ("b", "x/1", true),
        ("b", "y/1", false),
        ("c", "x/1", false),
        ("c", "y/2", true),
    ];
    let votes = rows.map(|(participant, clip, is_right)| StudyVote {
        participant: participant.to_owned(),
        clip: clip.to_owned(),
        speaker: clip[..1].to_owned(),
        expected: Some(side(true)),
        ..example_vote(TaskDesign::Mismatch, &["model", "other"], side(is_right))
    });
    let settings = StatisticSettings { n_draws: 0, with_models: false, ..StatisticSettings::default() };
    let of = |votes: &[StudyVote]| task("t", &votes.iter().collect::<Vec<_>>(), &settings).unwrap();
    let found = of(&votes);
    // Participants: 3/4, 1/2, 1/2 of all votes; 2/2, 1/1, 0/1 about x; 1/2, 0/1, 1/1 about y.
    let expected = [(0.625, (1.0f64 / 48.0).sqrt()), (0.75, (1.0f64 / 3.0).sqrt()), (0.5, 0.5)];
    for (share, (value, sd)) in found.shares.iter().zip(expected) {
        assert_eq!(share.share, value);
        assert!((share.participant_sd.unwrap() - sd).abs() < 1e-12, "{:?}", share.participant_sd);
    }
    let clips = |analysis: &TaskAnalysis| -> Vec<(String, u64, u64, f64)> {
        analysis.clips.iter().map(|row| (row.clip.clone(), row.n_successes, row.n_votes, row.share)).collect()
    };
    let expected = [("x/1", 2, 3, 2.0 / 3.0), ("x/2", 1, 1, 1.0), ("y/1", 0, 2, 0.0), ("y/2", 2, 2, 1.0)];
    assert_eq!(clips(&found), expected.map(|(clip, chosen, n, share)| (clip.to_owned(), chosen, n, share)));
    // In a Turing test, the share is that of the generated film.
    let turing = votes.map(|vote| StudyVote { design: TaskDesign::Turing, ..vote });
    let expected = [("x/1", 1, 3, 1.0 / 3.0), ("x/2", 0, 1, 0.0), ("y/1", 2, 2, 1.0), ("y/2", 0, 2, 0.0)];
    assert_eq!(clips(&of(&turing)), expected.map(|(clip, chosen, n, share)| (clip.to_owned(), chosen, n, share)));
}
