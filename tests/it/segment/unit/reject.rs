//! Unit tests of `orator_pipeline::lift::reject`.

use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::time::FrameRate;
use orator_pipeline::lift::reject::exclude_frames;

#[test]
fn rejected_frames_are_removed_and_every_second_is_accounted_for() {
    let fps = FrameRate::new(15, 1);
    let intervals = Intervals::new(fps, 300, vec![Interval { start: 0, end: 100 }, Interval { start: 120, end: 300 }]);
    let silent = RejectedInterval::new(fps.secs(100), 8.0, FrameRejection::new(Rejection::Quiet, -70.0, -50.0));
    let accepted =
        [(0.0, fps.secs(100)), (8.0, 19.99)].map(|(start_secs, end_secs)| AcceptedInterval { start_secs, end_secs });
    let ledger =
        Ledger { duration_secs: 19.99, accepted: accepted.to_vec(), rejected: vec![silent], ..Ledger::default() };
    let mut rejections = vec![None; 300];
    let same = exclude_frames(&intervals, &ledger, &rejections, 64).unwrap();
    assert_eq!(same, (intervals.clone(), ledger.clone()));
    rejections[150..160].fill(Some(FrameRejection::new(Rejection::Bones, 0.75, 0.5)));
    rejections[299] = Some(FrameRejection::new(Rejection::MissingJoints, 3.0, 0.0));
    let (left, reduced) = exclude_frames(&intervals, &ledger, &rejections, 64).unwrap();
    assert_eq!(left.intervals, [Interval { start: 0, end: 100 }, Interval { start: 160, end: 299 }]);
    assert!(reduced.is_complete());
    let reasons: Vec<(&str, f64)> = reduced.rejected.iter().map(|r| (r.reason.as_str(), r.measured)).collect();
    assert_eq!(reasons, [("quiet", -70.0), ("too short", 2.0), ("bones", 0.75), ("open", 3.0)]);
    assert!(exclude_frames(&intervals, &Ledger { accepted: vec![], ..ledger }, &rejections, 64).is_err());
}
