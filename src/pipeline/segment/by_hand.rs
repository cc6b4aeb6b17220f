//! Frames of a video that users accepted or rejected.

use orator_base::types::time::FrameRate;
use orator_dataset::decisions::{Decision, DecisionAction};

/// Decision of a user about a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ByHand<'a> {
    Accepted,
    /// Rejected by `author`, in a range of `secs` seconds.
    Rejected {
        author: &'a str,
        secs: f64,
    },
}

/// Decision about each of `n_frames` frames; the last one of several in `decisions` counts.
pub fn by_hand<'a>(decisions: &[&'a Decision], n_frames: usize, fps: FrameRate) -> Vec<Option<ByHand<'a>>> {
    let mut decided = vec![None; n_frames];
    for decision in decisions {
        let secs = decision.end_secs - decision.start_secs;
        let effect = match decision.action {
            DecisionAction::Accept => ByHand::Accepted,
            DecisionAction::Reject => ByHand::Rejected { author: &decision.author, secs },
            DecisionAction::SwapHands | DecisionAction::Speaker | DecisionAction::Word => continue,
        };
        decided[decision.frames(fps, n_frames)].fill(Some(effect));
    }
    decided
}
