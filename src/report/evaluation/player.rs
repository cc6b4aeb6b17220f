//! Excerpts of an evaluation for the player: the best, a typical and the worst by joint error, with ground truth and
//! prediction side by side, audio, and charts of wrists and beats over time. The excerpts last at most a minute in
//! total, and motion is in whole millimetres, which bounds the size of the page.

use super::charts::colour_legend;
use crate::html::chart::timeline::{Track, tracks};
use crate::html::{Node, node};
use anyhow::Result;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use ndarray::ArrayView3;
use orator_base::text::clock;
use orator_base::types::skeleton::{self, L_WRIST, N_JOINTS, R_WRIST, is_duplicate};
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_formats::wav;
use orator_gesture::evaluate::clips::clips::{EvalClip, EvalClips};
use orator_gesture::evaluate::table::table::Table;
use orator_gesture::metrics::beat;
use serde_json::{Value, json};
use std::ops::Range;

/// Maximum duration of an excerpt, seconds.
const MAX_SECS: f64 = 20.0;
/// Maximum frame rate of an excerpt.
const MAX_FPS: f64 = 30.0;
/// Coordinate value of a missing joint.
pub const MISSING: i16 = i16::MIN;
/// Half window of a motion beat, seconds, as in beat consistency: a speed minimum over 7 frames at 30 fps each way.
const BEAT_SECS: f64 = 7.0 / 30.0;

/// Part of a clip that the player shows.
pub struct Excerpt {
    pub name: String,
    pub secs: f64,
    fps: f64,
    /// Joints [T, 49, 3] in millimetres, i16 little endian.
    ground_truth: Vec<u8>,
    predicted: Vec<u8>,
    /// Audio as the bytes of a wav file.
    audio: Option<Vec<u8>>,
    tracks: Vec<Track>,
}

/// Excerpts with the smallest, median and largest joint error among all parts of clips of at most `MAX_SECS`.
pub fn choose(clips: &EvalClips) -> Result<Vec<Excerpt>> {
    let mut candidates: Vec<(f64, usize, Range<usize>)> = Vec::new();
    for (i, clip) in clips.clips.iter().enumerate() {
        let n = (clips.fps.secs(clip.n_frames()) / MAX_SECS).ceil().max(1.0) as usize;
        for k in 0..n {
            let frames = k * clip.n_frames() / n..(k + 1) * clip.n_frames() / n;
            let error = error_mm(clip, frames.clone());
            if error.is_finite() && frames.len() > 1 {
                candidates.push((error, i, frames));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2.start).cmp(&(b.1, b.2.start))));
    let n = candidates.len();
    let chosen: &[(&str, usize)] = match n {
        0 => &[],
        1 => &[("only excerpt", 0)],
        2 => &[("better", 0), ("worse", 1)],
        n => &[("best", 0), ("median", n / 2), ("worst", n - 1)],
    };
    let chosen = chosen.iter().map(|(word, at)| {
        let (error, clip, frames) = &candidates[*at];
        excerpt(word, *error, &clips.clips[*clip], frames.clone(), clips.fps.per_sec())
    });
    chosen.collect()
}

/// Mean joint error, mm; NaN if no joint is visible.
fn error_mm(clip: &EvalClip, frames: Range<usize>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for t in frames {
        for joint in (1..N_JOINTS).filter(|joint| clip.mask[[t, *joint]]) {
            let squared_difference =
                |k: usize| f64::from(clip.predicted[[t, joint, k]] - clip.ground_truth[[t, joint, k]]).powi(2);
            sum += 1000.0 * (0..3).map(squared_difference).sum::<f64>().sqrt();
            n += 1.0;
        }
    }
    sum / n
}

fn excerpt(word: &str, error: f64, clip: &EvalClip, frames: Range<usize>, fps: f64) -> Result<Excerpt> {
    let (start, end) = (frames.start as f64 / fps, frames.end as f64 / fps);
    let step = (fps / MAX_FPS).ceil().max(1.0) as usize;
    let samples = clip.audio.as_ref().map(|audio| audio.samples(start, end)).transpose()?;
    let shown: Vec<usize> = frames.clone().step_by(step).collect();
    Ok(Excerpt {
        name: format!("{word}: {}, {} to {} (mean joint error {error:.0} mm)", clip.name, clock(start), clock(end)),
        secs: end - start,
        fps: fps / step as f64,
        ground_truth: millimetres(clip.ground_truth.view(), &shown),
        predicted: millimetres(clip.predicted.view(), &shown),
        tracks: tracks_of(clip, frames, fps, samples.as_deref()),
        audio: samples.map(|samples| to_wav(&samples)).transpose()?,
    })
}

/// Coordinate in whole millimetres; `MISSING` if it is not finite.
pub fn to_millimetres(metres: f32) -> i16 {
    if metres.is_finite() { (1000.0 * metres).round().clamp(-32_000.0, 32_000.0) as i16 } else { MISSING }
}

fn millimetres(joints: ArrayView3<f32>, frames: &[usize]) -> Vec<u8> {
    let numbers = frames.iter().flat_map(|t| joints.index_axis_move(ndarray::Axis(0), *t));
    numbers.flat_map(|v| to_millimetres(*v).to_le_bytes()).collect()
}

fn to_wav(samples: &[i16]) -> Result<Vec<u8>> {
    wav::to_bytes(&Sound { rate: SAMPLE_RATE, samples: samples.iter().map(|s| f32::from(*s) / 32_768.0).collect() })
}

/// Tracks of wrist height and speed, loudness, and motion beats with onsets over time.
fn tracks_of(clip: &EvalClip, frames: Range<usize>, fps: f64, samples: Option<&[i16]>) -> Vec<Track> {
    let secs = |t: usize| (t - frames.start) as f64 / fps;
    let both: [(&str, ArrayView3<f32>); 2] =
        [("truth", clip.ground_truth.view()), ("predicted", clip.predicted.view())];
    let height = |name: &str, joint: usize| Track {
        name: name.to_owned(),
        lines: both
            .map(|(class, joints)| {
                let value = |t: usize| if clip.mask[[t, joint]] { -f64::from(joints[[t, joint, 1]]) } else { f64::NAN };
                (class, frames.clone().map(|t| [secs(t), value(t)]).collect())
            })
            .to_vec(),
        marks: Vec::new(),
    };
    let mut all = vec![height("height of the right wrist", R_WRIST), height("height of the left wrist", L_WRIST)];
    if let Some(samples) = samples {
        let per_point = (SAMPLE_RATE / 25) as usize;
        let loudness = samples.chunks(per_point).enumerate().map(|(i, chunk)| {
            let power = chunk.iter().map(|s| (f64::from(*s) / 32_768.0).powi(2)).sum::<f64>() / chunk.len() as f64;
            [i as f64 / 25.0, power.sqrt()]
        });
        all.push(Track { name: "loudness".to_owned(), lines: vec![("audio", loudness.collect())], marks: Vec::new() });
    }
    let order = ((BEAT_SECS * fps).round() as usize).max(1);
    let (mut lines, mut marks) = (Vec::new(), Vec::new());
    for (class, joints) in both {
        let speeds: Vec<f64> = frames.clone().map(|t| wrist_speed(clip, joints, &frames, t, fps)).collect();
        marks.push((class, beat::minima(&speeds, order).into_iter().map(|i| i as f64 / fps).collect()));
        lines.push((class, speeds.iter().enumerate().map(|(i, speed)| [i as f64 / fps, *speed]).collect()));
    }
    all.push(Track { name: "wrist speed".to_owned(), lines, marks: Vec::new() });
    if let Some(features) = clip.features.as_ref().filter(|_| samples.is_some()) {
        let (start, end) = (frames.start as f64 / fps, frames.end as f64 / fps);
        let onsets = features.onsets.iter().filter(|onset| (start..end).contains(*onset)).map(|onset| onset - start);
        marks.push(("onset", onsets.collect()));
    }
    let name = match marks.len() {
        3 => {
            "beats, top to bottom: audio onsets; speed minima of the predicted wrists; speed minima of the true wrists"
        }
        _ => "beats: speed minima of the predicted wrists (top) and of the true wrists (bottom)",
    };
    all.push(Track { name: name.to_owned(), lines: Vec::new(), marks });
    all
}

/// Mean speed of the two wrists by central differences, m/s.
fn wrist_speed(clip: &EvalClip, joints: ArrayView3<f32>, frames: &Range<usize>, t: usize, fps: f64) -> f64 {
    let (before, after) = (t.saturating_sub(1).max(frames.start), (t + 1).min(frames.end - 1));
    let of = |joint: usize| {
        if !(clip.mask[[before, joint]] && clip.mask[[after, joint]]) {
            return f64::NAN;
        }
        let squared_difference = |k: usize| f64::from(joints[[after, joint, k]] - joints[[before, joint, k]]).powi(2);
        (0..3).map(squared_difference).sum::<f64>().sqrt() * fps / (after - before).max(1) as f64
    };
    (of(R_WRIST) + of(L_WRIST)) / 2.0
}

impl Excerpt {
    pub fn data(&self) -> Value {
        json!({
            "secs": self.secs,
            "fps": self.fps,
            "truth": STANDARD.encode(&self.ground_truth),
            "predicted": STANDARD.encode(&self.predicted),
            "audio": self.audio.as_ref().map(|audio| STANDARD.encode(audio)),
        })
    }
}

/// Child joint, parent joint and side (0 centre, 1 left, 2 right) of every bone.
pub fn bones() -> Vec<[usize; 3]> {
    let bone = |joint: usize| {
        let side = match skeleton::side(joint) {
            skeleton::Side::Centre => 0,
            skeleton::Side::Left => 1,
            skeleton::Side::Right => 2,
        };
        skeleton::parent(joint).map(|parent| [joint, parent, side])
    };
    (0..N_JOINTS).filter(|joint| !is_duplicate(*joint)).filter_map(bone).collect()
}

pub fn body(excerpts: &[Excerpt], table: &Table) -> Vec<Node> {
    if excerpts.is_empty() {
        return vec![
            node("p").class("empty").text("No clip has visible joints in both the ground truth and the prediction."),
        ];
    }
    let option = |(i, excerpt): (usize, &Excerpt)| node("option").attr("value", i).text(&excerpt.name);
    let select = node("select").id("excerpt").children(excerpts.iter().enumerate().map(option));
    let stage = |id: &str, name: &str| {
        let canvas =
            node("canvas").id(id).attr("width", 480).attr("height", 400).attr("role", "img").attr("aria-label", name);
        node("figure").class(id).child(node("figcaption").text(name)).child(canvas)
    };
    let range = |id: &str, label: &str, [low, high, at, step]: [&str; 4]| {
        let slider = node("input").attr("type", "range").id(id).attr("aria-label", label);
        slider.attr("min", low).attr("max", high).attr("value", at).attr("step", step)
    };
    let controls = node("div").class("controls").children([
        node("button").id("play").attr("type", "button").text("Play"),
        range("at", "Position in the excerpt", ["0", "1", "0", "0.01"]),
        node("output").id("clock").text("0.0 s"),
    ]);
    let turn = node("div").class("controls").children([
        node("label").attr("for", "turn").text("Rotate"),
        range("turn", "Rotate the figures", ["-90", "90", "0", "1"]),
        node("output").id("degrees").text("0\u{b0}"),
    ]);
    let player = node("div").class("card player").id("player").children([
        node("div").class("controls").child(node("label").attr("for", "excerpt").text("Excerpt")).child(select),
        node("div").class("stages").child(stage("truth", "ground truth")).child(stage("predicted", "prediction")),
        controls,
        turn,
        node("p").id("message").class("small").attr("role", "status"),
    ]);
    let charts = excerpts.iter().enumerate().map(|(i, excerpt)| {
        let chart = tracks(&format!("Wrists and beats, {}", excerpt.name), excerpt.secs, &excerpt.tracks);
        let card =
            node("div").class("card scroll wide over-time").attr("data-excerpt", i).attr("data-secs", excerpt.secs);
        card.child(chart)
    });
    let about = format!(
        "Excerpts with the smallest, median and largest mean joint error. Both figures are shown from \
         the camera{}. The curves below belong to the selected excerpt; each chart is scaled to its own range.",
        if table.with_sound { "" } else { "; the evaluation has no audio" }
    );
    [node("p").text(about), player, colour_legend()].into_iter().chain(charts).collect()
}
