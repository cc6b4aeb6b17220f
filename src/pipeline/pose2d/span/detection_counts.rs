//! How often each part of the speaker was found.

use orator_base::stage::Report;
use orator_base::types::pose2d::{Keypoint, Pose2d};
use serde::{Deserialize, Serialize};
use serde_json::json;

/// Numbers of frames, and of shots where it was asked who speaks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DetectionCounts {
    n_frames: usize,
    person: usize,
    left_hand: usize,
    right_hand: usize,
    several: usize,
    face: usize,
    /// Shots with several people, and those of them where the one who speaks is followed; none where the largest is.
    pub followed: Option<[usize; 2]>,
}

impl DetectionCounts {
    /// Takes in one frame.
    pub fn count(&mut self, pose: &Pose2d) {
        let any = |points: &[Keypoint]| usize::from(points.iter().any(|point| point.score > 0.0));
        self.n_frames += 1;
        self.person += any(&pose.body);
        self.left_hand += any(&pose.left_hand);
        self.right_hand += any(&pose.right_hand);
        self.several += usize::from(pose.n_people > 1);
        self.face += usize::from(pose.face.is_some());
    }

    /// Adds those of other frames.
    pub fn add(&mut self, other: &Self) {
        self.n_frames = self.n_frames.saturating_add(other.n_frames);
        self.person = self.person.saturating_add(other.person);
        self.left_hand = self.left_hand.saturating_add(other.left_hand);
        self.right_hand = self.right_hand.saturating_add(other.right_hand);
        self.several = self.several.saturating_add(other.several);
        self.face = self.face.saturating_add(other.face);
        if let Some(others) = other.followed {
            let mine = self.followed.unwrap_or_default();
            self.followed = Some([0, 1].map(|at| mine[at].saturating_add(others[at])));
        }
    }

    /// For people and programs.
    pub fn report(&self) -> Report {
        let share = |n: usize| n as f64 / self.n_frames.max(1) as f64;
        let percent = |n: usize| format!("{:.0} %", 100.0 * share(n));
        let line = format!(
            "{} frames: person in {}, left hand {}, right hand {}",
            self.n_frames,
            percent(self.person),
            percent(self.left_hand),
            percent(self.right_hand)
        );
        let facts = json!({
            "n_frames": self.n_frames, "person": share(self.person), "left_hand": share(self.left_hand),
            "right_hand": share(self.right_hand), "several_people": share(self.several),
            "mouth": share(self.face),
        });
        let mut report = Report { line, facts: facts.as_object().cloned().unwrap_or_default() };
        if let Some(followed) = self.followed {
            tell_followed(followed, &mut report);
        }
        report
    }
}

/// Adds in how many shots the one who speaks is followed, and in how many the largest for want of a clear one.
fn tell_followed([several, speaking]: [usize; 2], report: &mut Report) {
    report.facts.insert("followed".to_owned(), json!({ "several": several, "speaking": speaking }));
    if several > speaking {
        let shots = orator_base::stage::counted(several, "shot");
        let rest = several - speaking;
        report.line += &format!(
            "; several people in {shots}: in {rest} nobody's mouth clearly follows the voice, so the largest is followed"
        );
    }
}
