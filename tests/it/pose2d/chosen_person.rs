//! The person whom a user chose is followed through the detections of a shot.

use crate::dataset::decisions::decision;
use orator_base::stage::{Stage, Unit};
use orator_base::types::pose2d::PersonBox;
use orator_dataset::config::Settings;
use orator_dataset::decisions::{Decision, DecisionAction};
use orator_pipeline::pose2d::Pose2dStage;
use orator_pipeline::pose2d::chosen_person::ChosenPath;

#[test]
fn the_person_at_the_point_is_followed_while_it_moves() {
    let at = |x: f32| PersonBox { x, y: 0.0, width: 100.0, height: 200.0, score: 0.9 };
    let mut chosen = ChosenPath::new([330.0, 100.0]);
    assert_eq!((chosen.find(0, &[at(0.0), at(500.0)]), chosen.is_found()), (None, false));
    assert_eq!(chosen.find(0, &[]), None);
    // Both boxes contain the point, the second more centrally.
    assert_eq!((chosen.find(1, &[at(240.0), at(290.0)]), chosen.is_found()), (Some(1), true));
    assert_eq!(chosen.find(5, &[at(320.0), at(240.0)]), Some(0));
    assert_eq!(chosen.find(10, &[at(240.0), at(350.0)]), Some(1));
    assert_eq!(chosen.find(15, &[at(0.0)]), None);
}

#[test]
fn only_a_choice_of_the_person_changes_the_settings_of_its_video() {
    let unit = |video: &str| Unit { speaker: "host".into(), video: video.into(), source: "a.mp4".into() };
    let settings = Settings::default();
    let stated = |decisions: &[Decision], video: &str| {
        Pose2dStage::new(&settings).unwrap().with_decisions(decisions.to_vec()).settings(&unit(video)).to_string()
    };
    let choice = Decision { x: Some(1.0), y: Some(2.0), ..decision("a", DecisionAction::Speaker, (0.0, 1.0)) };
    let others = [DecisionAction::Reject, DecisionAction::SwapHands].map(|action| decision("a", action, (0.0, 1.0)));
    assert_eq!(stated(&others, "a"), stated(&[], "a"));
    assert_eq!(stated(std::slice::from_ref(&choice), "b"), stated(&[], "b"));
    assert_ne!(stated(&[choice], "a"), stated(&[], "a"));
}
