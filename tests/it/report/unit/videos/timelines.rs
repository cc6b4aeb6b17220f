//! Tests of `orator_report::videos::timelines`.

use orator_base::stage::ledger::RejectedInterval;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_report::videos::timelines::{class, description, heading, order, quantity};

#[test]
fn every_reason_has_a_label_a_heading_and_a_colour() {
    let style = include_str!("../../../../../src/report/videos/page.css");
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
