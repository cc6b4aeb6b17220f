//! Labels, descriptions, order and CSS classes of the rejection reasons in ledgers, for all pages. Each colour stands
//! for a kind of reason; the second reason of a kind is striped (`page.css`).

use orator_base::stage::ledger::Refused;
use orator_base::stage::refusal::Refusal;
use orator_base::text::with_unit;

/// Label of a video that no stage has finished.
pub const WAITING: &str = "not processed";

/// Measured quantity of a reason.
const fn quantity(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::NoSound => "share of frames with audio",
        Refusal::Quiet => "loudness",
        Refusal::NoSpeech => "share of speech",
        Refusal::OffScreenSpeaker => "correlation of mouth and voice",
        Refusal::Static => "duration",
        Refusal::NoPerson => "highest score of face and arms",
        Refusal::Small => "distance between the shoulders",
        Refusal::Face => "score of nose and eyes",
        Refusal::Turned => "shoulder width",
        Refusal::NoseOff => "horizontal distance from nose to neck",
        Refusal::Arms => "lowest score of shoulders and elbows",
        Refusal::OtherHand => "gap",
        Refusal::HandGap => "gap",
        Refusal::HandShare => "share of frames in which the hand is visible",
        Refusal::Jump => "neck movement per frame",
        Refusal::Cut => "remaining length",
        Refusal::Identity => "remaining length",
        Refusal::TooShort => "length",
        Refusal::Crowd => "share of frames with too many persons",
        Refusal::Bones => "deviation",
        Refusal::MissingJoints => "count",
        _ => "measured",
    }
}

fn find(reason: &str) -> Option<usize> {
    Refusal::JUDGED.iter().position(|known| known.reason() == reason)
}

/// Rank of a reason in the order of the page; unknown reasons come last.
pub fn order(reason: &str) -> usize {
    find(reason).unwrap_or(Refusal::JUDGED.len())
}

/// Heading of a reason; empty for unknown reasons.
pub fn heading(reason: &str) -> &'static str {
    find(reason).map_or("", |at| Refusal::JUDGED[at].heading())
}

/// Heading of the reason, the measured value and the threshold; the ledger's message for unknown reasons.
pub fn description(refused: &Refused) -> String {
    let [measured, threshold] = [refused.measured, refused.threshold].map(|value| with_unit(value, &refused.unit));
    match Refusal::find(&refused.reason, &refused.unit) {
        Some(refusal) => format!("{}: {} {measured}, threshold {threshold}", refusal.heading(), quantity(refusal)),
        None => format!("{}: measured {measured}, threshold {threshold}", refused.message),
    }
}

/// CSS class of a reason.
pub fn class(reason: &str) -> String {
    if find(reason).is_some() { format!("r-{}", reason.replace(' ', "-")) } else { "r-unknown".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::stage::refusal::FrameRefusal;

    #[test]
    fn every_reason_has_a_label_a_heading_and_a_colour() {
        let style = include_str!("page.css");
        for refusal in Refusal::JUDGED {
            let reason = refusal.reason();
            assert!(quantity(refusal) != "measured", "{reason}");
            assert!(!heading(reason).is_empty(), "{reason}");
            assert!(style.contains(&format!(".{} ", class(reason))), "{reason} has no colour");
        }
        assert_eq!(
            (class("<b>").as_str(), order("new"), Refusal::label("new")),
            ("r-unknown", Refusal::JUDGED.len(), "new")
        );
        let quiet = Refused::new(0.0, 1.0, FrameRefusal::new(Refusal::Quiet, -62.0, -50.0));
        assert!(description(&quiet).ends_with(": loudness -62 dB, threshold -50 dB"));
        let other = Refused { reason: "new".to_owned(), message: "new rule".to_owned(), ..quiet };
        assert_eq!(description(&other), "new rule: measured -62 dB, threshold -50 dB");
    }
}
