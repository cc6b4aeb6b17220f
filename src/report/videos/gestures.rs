//! Report section on the gesture phases of each hand in accepted frames.

use crate::html::{self, Node, node};
use ndarray::s;
use orator_base::text::{number, percent};
use orator_base::types::interval::Interval;
use orator_base::types::pose3d::Motion;
use orator_gesture::phases::{HANDS, PhaseKind, PhaseTotals, WristTrack, find_phases};

/// Frames `start..end` of a motion.
pub fn part(motion: &Motion, start: usize, end: usize) -> Motion {
    Motion {
        fps: motion.fps,
        joints: motion.joints.slice(s![start..end, .., ..]).to_owned(),
        mask: motion.mask.slice(s![start..end, ..]).to_owned(),
    }
}

/// Adds the phases of the accepted intervals of a video to the totals of the left and the right hand.
pub fn add(hands: &mut [PhaseTotals; 2], motion: &Motion, intervals: &[Interval]) {
    let intervals = intervals.iter().filter(|interval| interval.end <= motion.n_frames());
    let parts: Vec<Motion> = intervals.map(|interval| part(motion, interval.start, interval.end)).collect();
    for (hand, (side, _)) in hands.iter_mut().zip(HANDS) {
        let tracks: Vec<WristTrack> = parts.iter().map(|part| WristTrack::new(part, side)).collect();
        for (part, phases) in parts.iter().zip(find_phases(&tracks)) {
            hand.add(&phases, motion.fps.secs(part.n_frames()));
        }
    }
}

/// Section with a table of both hands.
pub fn gestures(hands: &[PhaseTotals; 2]) -> Vec<Node> {
    if hands.iter().all(|hand| hand.secs <= 0.0) {
        return vec![node("p").class("empty").text("No accepted and lifted frames: no gestures to show.")];
    }
    let about = "Strokes, retractions, holds and rests of the wrists relative to the shoulders, found by speed and \
                 by the position at which the hand pauses longest. The command orator dataset annotate writes each with \
                 its times.";
    let columns = ["hand", "strokes", "a minute", "median amplitude", "median duration"];
    let titles = columns.into_iter().chain(PhaseKind::ALL.map(PhaseKind::name));
    let class = |title: &str| if title == columns[0] { "" } else { "num" };
    let heads = titles.map(|title| node("th").class(class(title)).attr("scope", "col").text(title));
    let rows = hands.iter().zip(HANDS).map(|(hand, (_, name))| {
        let median = hand.median_stroke();
        let shown = |value: Option<f64>, unit: &str, digits: f64| {
            value.map_or("\u{2013}".to_owned(), |value| format!("{} {unit}", number((value * digits).round() / digits)))
        };
        let cells = [
            hand.n_strokes().to_string(),
            number((10.0 * hand.strokes_per_minute()).round() / 10.0),
            shown(median.map(|(amplitude, _)| amplitude), "m", 100.0),
            shown(median.map(|(_, secs)| secs), "s", 100.0),
        ];
        let shares = PhaseKind::ALL.map(|kind| percent(hand.share(kind), 1.0));
        let cells = cells.into_iter().chain(shares).map(|cell| node("td").class("num").text(cell));
        node("tr").child(node("th").attr("scope", "row").text(name)).children(cells)
    });
    let table = html::table("videos", heads, rows);
    vec![node("p").text(about), node("div").class("scroll").attr("tabindex", "0").child(table)]
}
