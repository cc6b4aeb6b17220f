//! Reasons of a ledger in display order, each with the CSS class of its colour and a sentence. A colour stands for a
//! kind of reason; of two reasons of a kind one is striped (`page.css`).

/// Label of a video that no stage has finished.
pub const WAITING: &str = "not done";

/// Reason and sentence.
const REASONS: [(&str, &str); 16] = [
    ("no sound", "no sound track, or it has ended"),
    ("quiet", "the sound is too quiet for speech"),
    ("still", "the picture stands still"),
    ("no person", "nobody is seen"),
    ("too small", "the speaker is too small in the picture"),
    ("face", "the face is not visible"),
    ("turned", "the speaker is turned sideways or away"),
    ("arms", "shoulders or elbows are not visible"),
    ("hands", "a hand is not visible for too long"),
    ("jump", "the speaker jumps from frame to frame"),
    ("cut", "a cut leaves too short a stretch"),
    ("other person", "a change of person leaves too short a stretch"),
    ("too short", "too short between other refusals"),
    ("crowd", "too many people are in view"),
    ("bones", "a lifted bone is far off its length"),
    ("open", "joints stay unseen for too long"),
];

/// Index in the order; unknown reasons come last.
pub fn order(reason: &str) -> usize {
    REASONS.iter().position(|(known, _)| *known == reason).unwrap_or(REASONS.len())
}

/// Sentence of a reason; empty for unknown ones.
pub fn description(reason: &str) -> &'static str {
    REASONS.iter().find(|(known, _)| *known == reason).map_or("", |(_, description)| description)
}

/// CSS class of a reason.
pub fn class(reason: &str) -> String {
    let known = REASONS.iter().any(|(known, _)| *known == reason);
    if known { format!("r-{}", reason.replace(' ', "-")) } else { "r-unknown".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::segment::Refusal;

    #[test]
    fn every_reason_has_its_sentence_and_its_colour() {
        let style = include_str!("page.css");
        for reason in Refusal::ALL.map(Refusal::reason).into_iter().chain(["bones", "open"]) {
            assert!(!description(reason).is_empty(), "{reason}");
            assert!(style.contains(&format!(".{} ", class(reason))), "{reason} has no colour");
        }
        assert_eq!((class("<b>").as_str(), order("new")), ("r-unknown", REASONS.len()));
    }
}
