//! Animated previews of accepted intervals: a few seconds of the joints from the front, in whole millimetres to bound
//! the size of the page.

use crate::evaluation::player::{bones, to_millimetres};
use crate::html::{Node, node};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use orator_base::types::interval::Interval;
use orator_base::types::pose3d::Motion;
use serde_json::{Value, json};

/// Maximum duration of a preview, seconds.
const MAX_SECS: f64 = 8.0;
/// Maximum frame rate of a preview.
const MAX_FPS: f64 = 10.0;
/// Maximum number of previews on a page; 12 take 0.5 MB.
pub const MAX_PREVIEWS: usize = 12;

/// Start of the longest accepted interval of a video.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPreview {
    name: String,
    anchor: String,
    fps: f64,
    /// x and y of the joints, [T, 49, 2] in millimetres, i16, little endian.
    joints: Vec<u8>,
}

impl MotionPreview {
    /// Preview of the longest of `intervals`; `None` without intervals. `anchor` is the anchor of the video on the
    /// page.
    pub fn new(name: &str, anchor: String, motion: &Motion, intervals: &[Interval]) -> Option<Self> {
        let longest = intervals.iter().max_by_key(|interval| (interval.n_frames(), usize::MAX - interval.start))?;
        let fps = motion.fps.per_sec();
        let step = (fps / MAX_FPS).ceil().max(1.0) as usize;
        let max_frames = (MAX_SECS * fps) as usize;
        let end = longest.end.min(longest.start + max_frames).min(motion.n_frames());
        let mut joints = Vec::new();
        for frame in (longest.start..end).step_by(step) {
            for (joint, is_visible) in
                motion.joints.index_axis(ndarray::Axis(0), frame).outer_iter().zip(motion.mask.row(frame))
            {
                let [x, y] = if *is_visible { [joint[0], joint[1]] } else { [f32::NAN; 2] }.map(to_millimetres);
                joints.extend([x, y].map(i16::to_le_bytes).concat());
            }
        }
        Some(Self { name: name.to_owned(), anchor, fps: fps / step as f64, joints })
    }

    fn data(&self) -> Value {
        json!({ "fps": self.fps, "joints": STANDARD.encode(&self.joints) })
    }
}

pub fn data(previews: &[MotionPreview]) -> Value {
    json!({ "bones": bones(), "motions": previews.iter().map(MotionPreview::data).collect::<Vec<_>>() })
}

/// Section of previews; each is animated while it is visible, and static if the reader prefers reduced motion.
pub fn section(previews: &[MotionPreview]) -> Vec<Node> {
    if previews.is_empty() {
        return vec![node("p").class("empty").text("No accepted and lifted interval yet.")];
    }
    let figure = |(i, preview): (usize, &MotionPreview)| {
        let label = format!("Accepted motion of {}", preview.name);
        let canvas =
            node("canvas").attr("width", 240).attr("height", 240).attr("role", "img").attr("aria-label", label);
        let link = node("a").attr("href", format!("#{}", preview.anchor)).text(&preview.name);
        node("figure").class("preview card").child(canvas.attr("data-preview", i)).child(node("figcaption").child(link))
    };
    let about = format!(
        "The first {MAX_SECS} s of the longest accepted interval of each video (at most {MAX_PREVIEWS} videos), seen \
         from the camera. Joints that are not visible are omitted."
    );
    let shown = node("div").class("previews").children(previews.iter().enumerate().map(figure));
    vec![node("p").text(about), shown]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::player::MISSING;
    use ndarray::{Array2, Array3};
    use orator_base::types::time::FrameRate;

    #[test]
    fn the_longest_interval_is_shown_from_its_start() {
        let mut motion = Motion {
            fps: FrameRate::new(20, 1),
            joints: Array3::from_shape_fn(
                (400, 49, 3),
                |(t, joint, k)| if (joint, k) == (2, 1) { t as f32 / 1000.0 } else { 0.1 },
            ),
            mask: Array2::from_elem((400, 49), true),
        };
        motion.mask[[52, 3]] = false;
        let intervals = [Interval { start: 0, end: 40 }, Interval { start: 50, end: 400 }];
        let preview = MotionPreview::new("a.mp4", "a".into(), &motion, &intervals).unwrap();
        let number = |i: usize| i16::from_le_bytes([preview.joints[2 * i], preview.joints[2 * i + 1]]);
        assert_eq!((preview.fps, preview.joints.len()), (10.0, 80 * 49 * 4));
        assert_eq!([number(5), number(4), number(98 + 5)], [50, 100, 52]);
        assert_eq!([number(98 + 6), number(98 + 7), number(6)], [MISSING, MISSING, 100]);
        assert_eq!(MotionPreview::new("a.mp4", "a".into(), &motion, &[]), None);
    }
}
