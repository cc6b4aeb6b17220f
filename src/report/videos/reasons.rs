//! Labels, descriptions, order and CSS classes of the rejection reasons in ledgers, for all pages. Each colour stands
//! for a kind of reason; the second reason of a kind is striped (`page.css`).

use orator_base::stage::ledger::RejectedInterval;
use orator_base::stage::rejection::Rejection;
use orator_base::text::with_unit;

/// Label of a video that no stage has finished.
pub const WAITING: &str = "not processed";

/// Measured quantity of a reason.
const fn quantity(rejection: Rejection) -> &'static str {
    match rejection {
        Rejection::NoSound => "share of frames with audio",
        Rejection::Quiet => "loudness",
        Rejection::NoSpeech => "share of speech",
        Rejection::OffScreenSpeaker => "probability that the visible mouth speaks",
        Rejection::Static => "duration",
        Rejection::NoPerson => "highest score of face and arms",
        Rejection::Small => "distance between the shoulders",
        Rejection::Face => "score of nose and eyes",
        Rejection::Turned => "shoulder width",
        Rejection::NoseOff => "horizontal distance from nose to neck",
        Rejection::Arms => "lowest score of shoulders and elbows",
        Rejection::OtherHand => "gap",
        Rejection::HandGap => "gap",
        Rejection::HandShare => "share of frames in which the hand is visible",
        Rejection::Jump => "neck movement per frame",
        Rejection::Cut => "remaining length",
        Rejection::Identity => "remaining length",
        Rejection::TooShort => "length",
        Rejection::Crowd => "share of frames with too many persons",
        Rejection::Bones => "deviation",
        Rejection::MissingJoints => "count",
        _ => "measured",
    }
}

fn find(reason: &str) -> Option<usize> {
    Rejection::JUDGED.iter().position(|known| known.reason() == reason)
}

/// Rank of a reason in the order of the page; unknown reasons come last.
pub fn order(reason: &str) -> usize {
    find(reason).unwrap_or(Rejection::JUDGED.len())
}

/// Heading of a reason; empty for unknown reasons.
pub fn heading(reason: &str) -> &'static str {
    find(reason).map_or("", |at| Rejection::JUDGED[at].heading())
}

/// Heading of the reason, the measured value and the threshold; the ledger's message for unknown reasons.
pub fn description(rejected: &RejectedInterval) -> String {
    let [measured, threshold] = [rejected.measured, rejected.threshold].map(|value| with_unit(value, &rejected.unit));
    match Rejection::find(&rejected.reason, &rejected.unit) {
        Some(rejection) => {
            format!("{}: {} {measured}, threshold {threshold}", rejection.heading(), quantity(rejection))
        }
        None => format!("{}: measured {measured}, threshold {threshold}", rejected.message),
    }
}

/// CSS class of a reason.
pub fn class(reason: &str) -> String {
    if find(reason).is_some() { format!("r-{}", reason.replace(' ', "-")) } else { "r-unknown".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::stage::rejection::FrameRejection;

    #[test]
    fn every_reason_has_a_label_a_heading_and_a_colour() {
        let style = include_str!("page.css");
        for rejection in Rejection::JUDGED {
            let reason = rejection.reason();
            assert!(quantity(rejection) != "measured", "{reason}");
            assert!(!heading(reason).is_empty(), "{reason}");
            assert!(style.contains(&format!(".{} ", class(reason))), "{reason} has no colour");
        }
        assert_eq!(
            (class("<b>").as_str(), order("new"), Rejection::label("new")),
            ("r-unknown", Rejection::JUDGED.len(), "new")
        );
        let quiet = RejectedInterval::new(0.0, 1.0, FrameRejection::new(Rejection::Quiet, -62.0, -50.0));
        assert!(description(&quiet).ends_with(": loudness -62 dB, threshold -50 dB"));
        let other = RejectedInterval { reason: "new".to_owned(), message: "new rule".to_owned(), ..quiet };
        assert_eq!(description(&other), "new rule: measured -62 dB, threshold -50 dB");
    }
}
