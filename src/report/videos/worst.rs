//! Choice of the frames that best illustrate a rule: in each rejected span the frame furthest from the threshold, and
//! for each rule the worst spans; ties follow the order of the videos. Thumbnails of these moments: small frames
//! overlaid with their keypoints; a video is read once, up to its last moment, and keypoints of other programs are
//! drawn on an empty picture.

use super::timelines;
use anyhow::{Context, Result, ensure};
use orator_avatar::animate::draw::overlay::{self, ImageTransform};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::ledger::{Ledger, RejectedInterval};
use orator_base::stage::rejection::Rejection;
use orator_base::text::number;
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_dataset::config::SegmentConfig;
use orator_formats::keypoints_npz;
use orator_formats::media_json::MediaInfo;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::jpeg;
use orator_media::opencv::draw;
use orator_pipeline::extract::picture_options;
use orator_pipeline::segment::Measures;
use orator_pipeline::segment::table::{Bound, frame_rules, segment_rules};
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    pub video: usize,
    /// Frame, preceded by the previous frame if the rule compares two.
    pub frames: Vec<usize>,
    pub secs: f64,
    /// Distance from the threshold.
    beyond: f64,
    /// Reason, measured value and threshold.
    pub description: String,
    /// Text with the value in this frame; empty for rules that are not about frames.
    pub frame_value: String,
}

/// Rank of the reason, reason and unit; the unit distinguishes the two rules each of `turned` and `hands`.
type Rule = (usize, String, String);

pub struct Worst {
    pub rules: BTreeMap<Rule, Vec<Moment>>,
    max_moments: usize,
}

impl Worst {
    pub fn new(max_moments: usize) -> Self {
        Self { rules: BTreeMap::new(), max_moments }
    }

    /// Adds the rejected spans of a video; `bone_change` is empty if the video is not lifted.
    pub fn add(
        &mut self,
        video: usize,
        ledger: &Ledger,
        (measures, bone_change): (&Measures, &[f32]),
        judged: &MediaInfo,
        rules: &SegmentConfig,
    ) {
        for span in &ledger.rejected {
            let Some(moment) = moment(video, span, (measures, bone_change), judged, rules) else { continue };
            let rule = (timelines::order(&span.reason), span.reason.clone(), span.unit.clone());
            let moments = self.rules.entry(rule).or_default();
            let at = moments.partition_point(|other| other.beyond >= moment.beyond);
            moments.insert(at, moment);
            moments.truncate(self.max_moments);
        }
        self.rules.retain(|_, moments| !moments.is_empty());
    }

    /// Frames of a video that pictures need, in ascending order.
    pub fn frames_of(&self, video: usize) -> Vec<usize> {
        let moments = self.rules.values().flatten().filter(|moment| moment.video == video);
        let mut frames: Vec<usize> = moments.flat_map(|moment| moment.frames.iter().copied()).collect();
        frames.sort_unstable();
        frames.dedup();
        frames
    }
}

fn moment(
    video: usize,
    span: &RejectedInterval,
    (measures, bone_change): (&Measures, &[f32]),
    judged: &MediaInfo,
    rules: &SegmentConfig,
) -> Option<Moment> {
    let n_frames = measures.n_frames();
    let frame = |secs: f64| (secs * judged.fps.per_sec()).round() as usize;
    let start = frame(span.start_secs).min(n_frames.checked_sub(1)?);
    let end = frame(span.end_secs).clamp(start + 1, n_frames);
    let mean = (span.measured - span.threshold).abs();
    let rejection = Rejection::find(&span.reason, &span.unit);
    let (t, beyond, frame_value) = match rejection {
        Some(rejection @ (Rejection::Cut | Rejection::Identity)) => {
            let score = if rejection == Rejection::Cut { &measures.shot_score } else { &measures.identity };
            let ends = [start, end.min(n_frames - 1)].into_iter().filter(|t| *t > 0);
            let t = ends.max_by(|a, b| score[*a].total_cmp(&score[*b]).then(b.cmp(a)))?;
            (t, mean, value_text(rejection, f64::from(score[t])))
        }
        Some(Rejection::Bones) if bone_change.len() == n_frames => {
            let (t, value) = extreme(bone_change, start..end, false);
            (t, (value - span.threshold).abs(), format!("deviation {} in this frame", number(value)))
        }
        Some(rejection) => match farthest(rejection, measures, rules, start..end) {
            Some((t, value, bound, is_mean)) => {
                (t, if is_mean { (value - bound.threshold()).abs() } else { mean }, value_text(rejection, value))
            }
            None => (start.midpoint(end - 1), mean, String::new()),
        },
        None => (start.midpoint(end - 1), mean, String::new()),
    };
    let compares = matches!(rejection, Some(Rejection::Cut | Rejection::Identity | Rejection::Jump)) && t > 0;
    let frames = if compares { vec![t - 1, t] } else { vec![t] };
    let beyond = if beyond.is_finite() { beyond } else { 0.0 };
    Some(Moment {
        video,
        frames,
        secs: judged.fps.secs(t),
        beyond,
        description: timelines::description(span),
        frame_value,
    })
}

/// Frame that violates the rules of the rejection most: index, value, bound, and whether the ledger measures that value
/// rather than a duration or share.
fn farthest(
    rejection: Rejection,
    measures: &Measures,
    rules: &SegmentConfig,
    frames: std::ops::Range<usize>,
) -> Option<(usize, f64, Bound, bool)> {
    let on_frames = frame_rules(rules).into_iter().filter(|rule| rule.rejection == rejection);
    let on_frames = on_frames.map(|rule| (rule.values, rule.bound, !rule.measures_secs));
    // If the rule requires a minimum share, frames that do not count are bad; for a maximum, those that count are.
    let on_pieces = segment_rules(rules).into_iter().filter(|rule| rule.rejection == rejection).map(|rule| {
        let bad = match rule.share {
            Bound::AtLeast(_) => rule.counted,
            Bound::AtMost(_) => Bound::AtMost(rule.counted.threshold()),
        };
        (rule.values, bad, false)
    });
    let found = on_frames.chain(on_pieces).map(|(values, bound, is_mean)| {
        let is_minimum = matches!(bound, Bound::AtLeast(_));
        let (t, value) = extreme(values(measures), frames.clone(), is_minimum);
        let beyond = if is_minimum { bound.threshold() - value } else { value - bound.threshold() };
        (beyond, (t, value, bound, is_mean))
    });
    let known = found.filter(|(beyond, _)| beyond.is_finite());
    known.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, found)| found)
}

/// Frame with the smallest (or largest) known value, ties going to the one nearest the middle, and the value, or NaN.
fn extreme(values: &[f32], frames: std::ops::Range<usize>, lowest: bool) -> (usize, f64) {
    let middle = frames.start.midpoint(frames.end.saturating_sub(1));
    let known = frames.filter(|t| !values[*t].is_nan());
    let key = |t: usize| if lowest { values[t] } else { -values[t] };
    let t = known.min_by(|a, b| key(*a).total_cmp(&key(*b)).then(a.abs_diff(middle).cmp(&b.abs_diff(middle))));
    t.map_or((middle, f64::NAN), |t| (t, f64::from(values[t])))
}

fn value_text(rejection: Rejection, value: f64) -> String {
    let value = number(value);
    match rejection {
        Rejection::Quiet => format!("{value} dB in this frame"),
        Rejection::NoSpeech => format!("share of speech {value} in this frame"),
        Rejection::OffScreenSpeaker => format!("probability {value} in this frame"),
        Rejection::Static => format!("picture change {value} in this frame"),
        Rejection::Small => format!("{value} px in this frame"),
        Rejection::Turned => format!("{value} neck-nose distances in this frame"),
        Rejection::NoseOff => format!("{value} half shoulder widths in this frame"),
        Rejection::Jump => format!("{value} shoulder widths between the two pictures"),
        Rejection::HandGap | Rejection::HandShare => format!("hand score {value} in this frame"),
        Rejection::Crowd => format!("{value} persons in this frame"),
        Rejection::Cut => format!("shot score {value} in the second picture"),
        Rejection::Identity => "before and after".to_owned(),
        Rejection::NoPerson | Rejection::Face | Rejection::Arms => format!("score {value} in this frame"),
        _ => String::new(),
    }
}

/// Maximum width and height of a thumbnail, px.
const MAX_PX: [f64; 2] = [400.0, 260.0];
const GAP_PX: usize = 4;
const GAP_RGB: [u8; 3] = [255; 3];
const EMPTY_RGB: [u8; 3] = [70; 3];

#[derive(Clone, Debug)]
pub struct MomentThumbnail {
    pub jpeg: Vec<u8>,
    pub size: [usize; 2],
}

/// Pictures of the video with index `video`, by the frames of their moments.
pub fn thumbnails(
    work: &Path,
    unit: &Unit,
    video: usize,
    worst: &Worst,
) -> Result<BTreeMap<Vec<usize>, MomentThumbnail>> {
    let keypoints = keypoints_npz::read(&Artifact::Keypoints.path(work, unit))?;
    let moments: Vec<&Vec<usize>> =
        worst.rules.values().flatten().filter(|m| m.video == video).map(|m| &m.frames).collect();
    let frames = worst.frames_of(video);
    let media = MediaInfo::read(&Artifact::MediaInfo.path(work, unit)).ok();
    let has_pictures = media.is_none_or(|media| media.keypoints_from.is_none());
    let open = || -> Result<FrameReader> {
        Ok(FrameReader::open_with(&unit.source, keypoints.fps, 0)?.with_options(picture_options(work, unit)))
    };
    let mut reader = has_pictures.then(open).transpose()?;
    let n_wide = |frame: &usize| if moments.iter().any(|m| m.len() > 1 && m.contains(frame)) { 2 } else { 1 };
    let mut thumbnails_by_frame = BTreeMap::new();
    for frame_idx in &frames {
        ensure!(
            *frame_idx < keypoints.n_frames(),
            "the keypoints have {} frames, frame {frame_idx} is missing",
            keypoints.n_frames()
        );
        while let Some(reader) = &mut reader {
            let time = reader.advance()?.with_context(|| {
                format!(
                    "{} ends before frame {frame_idx}: the file has changed since it was processed",
                    unit.source.display()
                )
            })?;
            if time.frame_idx == *frame_idx {
                break;
            }
        }
        thumbnails_by_frame
            .insert(*frame_idx, draw_thumbnail(reader.as_mut(), &keypoints, *frame_idx, n_wide(frame_idx))?);
    }
    let picture = |frames: &Vec<usize>| -> Result<MomentThumbnail> {
        let image = side_by_side(frames.iter().filter_map(|frame| thumbnails_by_frame.get(frame)));
        Ok(MomentThumbnail { size: [image.width, image.height], jpeg: jpeg::encode(&image)? })
    };
    moments.into_iter().map(|frames| Ok((frames.clone(), picture(frames)?))).collect()
}

/// Current frame of the reader, or an empty picture, overlaid with its keypoints; `n_wide` thumbnails share the width.
fn draw_thumbnail(
    reader: Option<&mut FrameReader>,
    keypoints: &Keypoints,
    frame_idx: usize,
    n_wide: usize,
) -> Result<Image> {
    let size = reader.as_ref().map_or(keypoints.image_size.map(|px| px as usize), |reader| reader.image_size());
    let frame_size = size.map(|px| px.max(1) as f64);
    let scale = (MAX_PX[0] / n_wide as f64 / frame_size[0]).min(MAX_PX[1] / frame_size[1]).min(1.0);
    let small = frame_size.map(|px| ((px * scale).round() as usize).max(2));
    let mut image = match reader {
        Some(reader) => reader.picture(Some(small))?,
        None => Image::filled(small[0], small[1], EMPTY_RGB),
    };
    let scale = [0, 1].map(|axis| small[axis] as f32 / keypoints.image_size[axis].max(1) as f32);
    overlay::draw_keypoints(&mut image, keypoints, frame_idx, ImageTransform { scale, shift: [0.0; 2] }, 2.0)?;
    Ok(image)
}

fn side_by_side<'a>(images: impl Iterator<Item = &'a Image> + Clone) -> Image {
    let width: usize = images.clone().map(|image| image.width + GAP_PX).sum();
    let height = images.clone().map(|image| image.height).max().unwrap_or(1);
    let mut all = Image::filled(width.saturating_sub(GAP_PX).max(1), height, GAP_RGB);
    let mut left = 0;
    for image in images {
        draw::paste(&mut all, image, [left, 0]);
        left += image.width + GAP_PX;
    }
    all
}
