//! Report of an animation as text.

use orator_avatar::animate::performance::{AnimationReport, DetectedFrames, Jerk, MAX_FINGER_CLAMPS};
use orator_avatar::animate::retarget::captured_body::CapturedPart;
use orator_base::text::counted;

/// Lines about jerk, head, detected frames and clamped angles.
pub(super) fn text(report: &AnimationReport) -> String {
    let number = |jerk: Option<f64>| jerk.map_or("-".to_owned(), |jerk| format!("{jerk:.0}"));
    let jerk = |jerk: Jerk| format!("{} -> {}", number(jerk.before), number(jerk.after));
    let mut text = format!("jerk, m/s\u{b3}: arms {}, hands {}\n", jerk(report.arms), jerk(report.hands));
    text += &match report.face_frames {
        Some(n) if n > 0 => format!("head: detected in {n} of {}\n", counted(report.n_frames, "frame")),
        _ if report.captured.contains(&CapturedPart::Head) => String::new(),
        _ => "head: at rest\n".to_owned(),
    };
    if !report.captured.is_empty() {
        let parts: Vec<_> = report.captured.iter().map(|part| part.name()).collect();
        text += &format!("from the capture: {}\n", parts.join(", "));
    }
    text += &detected(report);
    let clamped: Vec<_> = report.clamps.iter().filter(|clamps| clamps.joint_frames > 0).collect();
    match (report.clamps.is_empty(), clamped.is_empty()) {
        (true, _) => text += "joint angles: not limited\n",
        (_, true) => text += "joint angles: none clamped\n",
        _ => text += "clamped                      angles   share    excess in degrees: mean, maximum\n",
    }
    for clamps in clamped {
        text += &format!(
            "  {:26}{:>7}  {:>5.1} %  {:>6.1}  {:>6.1}\n",
            clamps.kind,
            clamps.joint_frames,
            100.0 * clamps.share,
            clamps.mean_excess_degrees,
            clamps.largest_excess_degrees
        );
    }
    if report.fingers_unusable {
        text += &format!(
            "fingers: unusable, {:.0} % of their angles exceed the joint limits (usable: up to {:.0} %)\n",
            100.0 * report.finger_clamps,
            100.0 * MAX_FINGER_CLAMPS
        );
    }
    text
}

/// Parts of the body that were not detected in all frames; empty if all were.
fn detected(report: &AnimationReport) -> String {
    let DetectedFrames { left_arm, right_arm, left_hand, right_hand } = report.detected;
    let arms = match left_arm == right_arm {
        true => vec![("arms", left_arm)],
        false => vec![("left arm", left_arm), ("right arm", right_arm)],
    };
    let parts = || arms.iter().copied().chain([("left hand", left_hand), ("right hand", right_hand)]);
    if parts().all(|(_, n)| n == report.n_frames) {
        return String::new();
    }
    let parts: Vec<_> = parts().map(|(part, n)| format!("{part} in {n}")).collect();
    format!("detected, of {} frames: {}; other frames are interpolated or held\n", report.n_frames, parts.join(", "))
}
