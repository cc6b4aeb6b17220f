//! Animated previews of accepted intervals: a few seconds of the joints from the front, in whole millimetres to bound
//! the size of the page. Report section on the persons in the videos: one face per video, in a row per person if the
//! videos seem to show several.

use crate::evaluation::player::{bones, to_millimetres};
use crate::html::{Node, jpeg, node};
use anyhow::Result;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::interval::Interval;
use orator_base::types::pose3d::Motion;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_media::ffmpeg;
use orator_media::opencv::png;
use orator_pipeline::dataset::persons::{self, VideoPerson};
use serde_json::{Value, json};
use std::path::Path;

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
    /// Preview of the longest of `intervals`; `None` without intervals. `anchor`: that of the video on the page.
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

/// Maximum number of faces shown per person.
const MAX_FACES: usize = 24;

/// Content of the section on the persons; empty if no face was detected.
pub fn faces(settings: &Settings, videos: &[Videos]) -> Vec<Node> {
    let work = &settings.work.dir;
    videos
        .iter()
        .flat_map(|of| {
            let is_declared = settings.speaker.iter().any(|entry| entry.name == of.speaker && entry.same_person);
            let persons: Vec<VideoPerson> = of.units.iter().map(|unit| VideoPerson::read(work, unit)).collect();
            let groups = if is_declared { vec![persons.iter().collect()] } else { persons::groups(&persons) };
            of_speaker(work, &of.speaker, &groups, is_declared)
        })
        .collect()
}

fn of_speaker(work: &Path, speaker: &str, groups: &[Vec<&VideoPerson>], is_declared: bool) -> Vec<Node> {
    let about = match (is_declared, groups.len()) {
        (true, _) => format!("{speaker}: all videos show the same person (`same_person = true` in the configuration)."),
        (false, 0 | 1) => format!("{speaker}: all videos appear to show the same person."),
        (false, n) => format!(
            "{speaker}: the videos appear to show {n} persons, an estimate from faces, shoulder width and the colours \
             of skin and hair. Check the faces: exclude videos of another person with `exclude`, or set `same_person = \
             true` under [[speaker]] if all videos show the same person."
        ),
    };
    let rows = groups.iter().enumerate().filter_map(|(at, group)| {
        let cards: Vec<Node> =
            group.iter().take(MAX_FACES).filter_map(|video| card(work, video).ok().flatten()).collect();
        let title = node("h3").class("rule").child(node("span").text(format!("{speaker}, person {}", at + 1)));
        (!cards.is_empty())
            .then(|| node("div").class("gallery").child(title).child(node("div").class("shots").children(cards)))
    });
    let rows: Vec<Node> = rows.collect();
    if rows.is_empty() { Vec::new() } else { std::iter::once(node("p").text(about)).chain(rows).collect() }
}

fn card(work: &Path, video: &VideoPerson) -> Result<Option<Node>> {
    let path = Artifact::FacePicture.path(work, &video.unit);
    if !path.exists() {
        return Ok(None);
    }
    let face = png::read(&path)?;
    let shown = jpeg(&ffmpeg::jpeg::encode(&face)?, [face.width, face.height], &format!("Face in {}", video.file));
    Ok(Some(node("figure").class("card shot").child(shown).child(node("figcaption").text(&video.file))))
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
