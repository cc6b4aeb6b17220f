//! Cuts clips of equal length from a speaker's speech: they start and end in pauses, contain speech, and have visible
//! joints. Better clips come first; segments without any acceptable clip are rejected with a reason. Clips of equal
//! grade can be stratified by stroke rate.

use super::speaker_source::{SpeakerSource, SpeechSegment};
use anyhow::Result;
use orator_base::audio::pauses::SpeechLevel;
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use orator_base::types::time::FrameRate;
use orator_gesture::phases::{GesturePhase, HANDS, PhaseKind, WristTrack, find_phases};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Grades of clips from best to worst: maximum sound level at the ends in dB relative to the speech level, and maximum
/// proportion of invisible joints.
const GRADES: [(f32, f64); 4] = [(-25.0, 0.0), (-25.0, MAX_HIDDEN), (-15.0, MAX_HIDDEN), (f32::INFINITY, MAX_HIDDEN)];
/// Maximum proportion of joints of a clip that may be hidden in all its films.
pub(super) const MAX_HIDDEN: f64 = 0.25;
const MIN_SPEECH: f64 = 0.3;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyClip {
    /// Name `segment-frame`, unique per speaker.
    pub name: String,
    /// Index of the segment from which the clip is cut.
    #[serde(skip)]
    pub segment: usize,
    /// Frame range within the segment.
    pub frames: Range<usize>,
    /// Sound level at the louder end, dB relative to the speech level.
    pub cut_db: f32,
    /// Proportion of joints that were not detected; they are hidden in every film of the clip.
    #[serde(alias = "unseen")]
    pub hidden_share: f64,
    /// Strokes of both hands that start in the clip, per minute; `None`: clips are not stratified by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strokes_per_minute: Option<f64>,
}

impl StudyClip {
    pub fn ends_in_pauses(&self) -> bool {
        self.cut_db <= GRADES[2].0
    }
}

/// Segment of speech without a clip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectedSegment {
    pub name: String,
    pub reason: String,
}

/// Clips of a speaker in the order of the speech, and the segments without clips.
#[derive(Debug)]
pub struct CutSpeech {
    pub clips: Vec<StudyClip>,
    /// Names of the clips, best first.
    pub best_first: Vec<String>,
    pub rejected: Vec<RejectedSegment>,
}

struct CutCandidate {
    start: usize,
    cut_db: f32,
    hidden_share: f64,
}

/// Cuts `n_clips` clips of `n_frames`, or fewer if there are no more; `rank` orders clips of equal grade. With several
/// `n_classes` of stroke rate, as many clips of equal grade are taken from each class as it has.
pub fn cut(
    source: &SpeakerSource,
    n_frames: usize,
    (n_clips, n_classes): (usize, usize),
    rank: impl Fn(&str) -> u64,
) -> Result<CutSpeech> {
    let found = (0..source.n_segments()).into_par_iter().map(|segment| {
        let segment = source.read(segment)?;
        let found = candidates(&segment, source.fps, n_frames);
        let motion = segment.natural.filter(|_| n_classes > 1 && found.is_ok());
        let tracks = motion.map(|(motion, _)| HANDS.map(|(side, _)| WristTrack::new(&motion, side)));
        Ok((segment.name, found, tracks))
    });
    let found = found.collect::<Result<Vec<_>>>()?;
    let strokes = stroke_starts(found.iter().map(|(.., tracks)| tracks.as_ref()));
    let (mut segments, mut rejected) = (Vec::new(), Vec::new());
    for (at, (name, found, _)) in found.into_iter().enumerate() {
        match found {
            Ok(candidates) => segments.push((at, name, candidates)),
            Err(reason) => rejected.push(RejectedSegment { name, reason }),
        }
    }
    let mut clips: Vec<StudyClip> = Vec::new();
    for (max_db, max_hidden) in GRADES {
        let mut more: Vec<StudyClip> = Vec::new();
        for (segment, name, candidates) in &segments {
            let used = clips.iter().filter(|clip| clip.segment == *segment).map(|clip| clip.frames.clone());
            let mut used: Vec<Range<usize>> = used.collect();
            // Greedy choice by earliest end maximises the number of disjoint clips of equal length.
            for &CutCandidate { start, cut_db, hidden_share } in candidates {
                let frames = start..start + n_frames;
                let is_free = used.iter().all(|other| other.end <= frames.start || frames.end <= other.start);
                if is_free && cut_db <= max_db && hidden_share <= max_hidden {
                    used.push(frames.clone());
                    let secs = source.fps.secs(frames.start)..source.fps.secs(frames.end);
                    let n_strokes = |starts: &Vec<f64>| starts.iter().filter(|start| secs.contains(start)).count();
                    let rate = |n: usize| 60.0 * n as f64 / source.fps.secs(n_frames);
                    more.push(StudyClip {
                        name: format!("{name}-{start:05}"),
                        segment: *segment,
                        frames,
                        cut_db,
                        hidden_share,
                        strokes_per_minute: strokes[*segment].as_ref().map(n_strokes).map(rate),
                    });
                }
            }
        }
        more.sort_by_cached_key(|clip| (rank(&clip.name), clip.name.clone()));
        interleave_classes(&mut more, n_classes);
        more.truncate(n_clips - clips.len());
        clips.extend(more);
    }
    let best_first = clips.iter().map(|clip| clip.name.clone()).collect();
    clips.sort_by_key(|clip| (clip.segment, clip.frames.start));
    Ok(CutSpeech { clips, best_first, rejected })
}

/// Start of the strokes of both hands in each segment, seconds, from the tracks of the left and the right hand.
fn stroke_starts<'t>(segments: impl Iterator<Item = Option<&'t [WristTrack; 2]>>) -> Vec<Option<Vec<f64>>> {
    let segments: Vec<Option<&[WristTrack; 2]>> = segments.collect();
    let mut starts: Vec<Option<Vec<f64>>> = segments.iter().map(|tracks| tracks.map(|_| Vec::new())).collect();
    for hand in 0..2 {
        let tracks: Vec<WristTrack> = segments.iter().flatten().map(|tracks| tracks[hand].clone()).collect();
        let is_stroke = |phase: &&GesturePhase| phase.kind == PhaseKind::Stroke;
        for (starts, phases) in starts.iter_mut().flatten().zip(find_phases(&tracks)) {
            starts.extend(phases.iter().filter(is_stroke).map(|stroke| stroke.start_secs));
        }
    }
    starts
}

/// Reorders clips so that each class of stroke rate, of equal size, is present equally often among the first ones;
/// clips of a class stay in order.
fn interleave_classes(clips: &mut Vec<StudyClip>, n_classes: usize) {
    let mut by_rate: Vec<usize> = (0..clips.len()).collect();
    by_rate.sort_by(|a, b| {
        let rate = |n: &usize| clips[*n].strokes_per_minute.unwrap_or(0.0);
        rate(a).total_cmp(&rate(b))
    });
    let mut class_of = vec![0; clips.len()];
    by_rate.iter().enumerate().for_each(|(place, clip)| class_of[*clip] = place * n_classes / clips.len());
    let mut n_before = vec![0; n_classes];
    let mut keyed: Vec<((usize, usize), StudyClip)> = Vec::new();
    for (clip, class) in clips.drain(..).zip(class_of) {
        keyed.push(((n_before[class], class), clip));
        n_before[class] += 1;
    }
    keyed.sort_by_key(|(key, _)| *key);
    clips.extend(keyed.into_iter().map(|(_, clip)| clip));
}

/// Candidate clips of a segment, or the reason why there is none.
fn candidates(
    segment: &SpeechSegment,
    fps: FrameRate,
    n_frames: usize,
) -> std::result::Result<Vec<CutCandidate>, String> {
    let secs = |frames: usize| fps.secs(frames);
    if segment.n_frames < n_frames {
        return Err(format!("{:.1} s long, but a clip needs {:.1} s", secs(segment.n_frames), secs(n_frames)));
    }
    let level = SpeechLevel::of(&segment.sound);
    let at_ends: Vec<f32> = (0..=segment.n_frames).map(|frame| level.around(secs(frame))).collect();
    let n_hidden = cumulative_hidden(segment);
    let n_joints = counted_joints().count() as f64;
    let all: Vec<CutCandidate> = (0..=segment.n_frames - n_frames)
        .map(|start| {
            let end = start + n_frames;
            let hidden_share = (n_hidden[end] - n_hidden[start]) as f64 / (n_joints * n_frames as f64);
            CutCandidate { start, cut_db: at_ends[start].max(at_ends[end]), hidden_share }
        })
        .collect();
    let min_hidden = all.iter().map(|candidate| candidate.hidden_share).fold(f64::INFINITY, f64::min);
    if min_hidden > MAX_HIDDEN {
        let [min, max] = [min_hidden, MAX_HIDDEN].map(|share| 100.0 * share);
        return Err(format!(
            "at least {min:.0} % of the joints are missing in every possible clip; the limit is {max:.0} %"
        ));
    }
    let is_spoken = |candidate: &CutCandidate| {
        level.speech_share(secs(candidate.start)..secs(candidate.start + n_frames)) >= MIN_SPEECH
    };
    let spoken: Vec<CutCandidate> = all.into_iter().filter(is_spoken).collect();
    let min_speech = 100.0 * MIN_SPEECH;
    if spoken.is_empty() {
        Err(format!("no possible clip contains at least {min_speech:.0} % speech"))
    } else {
        Ok(spoken)
    }
}

/// Cumulative number of undetected joints before each frame, with the total as the last element.
fn cumulative_hidden(segment: &SpeechSegment) -> Vec<u64> {
    let mut sums = vec![0; segment.n_frames + 1];
    let Some((motion, _)) = &segment.natural else { return sums };
    for frame in 0..segment.n_frames {
        let n = counted_joints().filter(|joint| !motion.mask[[frame, *joint]]).count();
        sums[frame + 1] = sums[frame] + n as u64;
    }
    sums
}

/// Joints whose visibility counts: all but the origin and those that duplicate another joint.
fn counted_joints() -> impl Iterator<Item = usize> {
    (0..N_JOINTS).filter(|joint| *joint != NECK && !is_duplicate(*joint))
}
