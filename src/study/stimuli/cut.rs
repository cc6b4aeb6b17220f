//! Clips of equal length out of a speaker's speech: they begin and end in pauses, have speech in them, and were seen.
//! Better ones come first; those that no choice of ends makes good are refused with the reason.

use super::speaker_source::{SpeakerSource, SpokenPiece};
use anyhow::Result;
use orator_base::audio::pauses::SpeechLevel;
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use orator_base::types::time::FrameRate;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Loudest level at the ends of a clip, dB from the speech, and largest share of joints not seen, from the best clips to
/// the last that are taken.
const GRADES: [(f32, f64); 4] =
    [(-25.0, 0.0), (-25.0, MOST_UNSEEN), (-15.0, MOST_UNSEEN), (f32::INFINITY, MOST_UNSEEN)];
/// Largest share of the joints of a clip that may be hidden in all its films.
const MOST_UNSEEN: f64 = 0.25;
/// Least share of a clip in which there is speech.
const LEAST_SPEECH: f64 = 0.3;

/// Clip of a speaker's speech.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyClip {
    /// `piece-frame`, once in the speaker.
    pub name: String,
    /// Number of the piece it is cut from.
    #[serde(skip)]
    pub piece: usize,
    /// Frames of the piece.
    pub frames: Range<usize>,
    /// Level of the speech at the louder of its ends, dB from that of the speech.
    pub cut_db: f32,
    /// Share of the joints that were not seen, and are hidden in every film of the clip.
    pub unseen: f64,
}

impl StudyClip {
    /// Whether it begins and ends in a pause.
    pub fn ends_in_pauses(&self) -> bool {
        self.cut_db <= GRADES[2].0
    }
}

/// Piece of speech without a clip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedPiece {
    pub name: String,
    pub reason: String,
}

/// Clips of a speaker in the order of the speech, and the pieces that have none.
#[derive(Debug)]
pub struct CutSpeech {
    pub clips: Vec<StudyClip>,
    /// Names of the clips, the best first.
    pub best_first: Vec<String>,
    pub refused: Vec<RefusedPiece>,
}

/// Clip as it could be cut.
struct CutCandidate {
    start: usize,
    cut_db: f32,
    unseen: f64,
}

/// Cuts `n_wanted` clips of `n_frames`, fewer where there are no more; `rank` orders clips that are equally good.
pub fn cut(source: &SpeakerSource, n_frames: usize, n_wanted: usize, rank: impl Fn(&str) -> u64) -> Result<CutSpeech> {
    let looked_at = (0..source.n_pieces()).into_par_iter().map(|piece| {
        let piece = source.read(piece)?;
        let found = candidates(&piece, source.fps, n_frames);
        Ok((piece.name, found))
    });
    let (mut pieces, mut refused) = (Vec::new(), Vec::new());
    for (at, (name, found)) in looked_at.collect::<Result<Vec<_>>>()?.into_iter().enumerate() {
        match found {
            Ok(candidates) => pieces.push((at, name, candidates)),
            Err(reason) => refused.push(RefusedPiece { name, reason }),
        }
    }
    let mut clips: Vec<StudyClip> = Vec::new();
    for (most_db, most_unseen) in GRADES {
        let mut more: Vec<StudyClip> = Vec::new();
        for (piece, name, candidates) in &pieces {
            let taken = clips.iter().filter(|clip| clip.piece == *piece).map(|clip| clip.frames.clone());
            let mut taken: Vec<Range<usize>> = taken.collect();
            // The earliest end first leaves room for the most clips of one length.
            for &CutCandidate { start, cut_db, unseen } in candidates {
                let frames = start..start + n_frames;
                let is_free = taken.iter().all(|other| other.end <= frames.start || frames.end <= other.start);
                if is_free && cut_db <= most_db && unseen <= most_unseen {
                    taken.push(frames.clone());
                    more.push(StudyClip { name: format!("{name}-{start:05}"), piece: *piece, frames, cut_db, unseen });
                }
            }
        }
        more.sort_by_cached_key(|clip| (rank(&clip.name), clip.name.clone()));
        more.truncate(n_wanted - clips.len());
        clips.extend(more);
    }
    let best_first = clips.iter().map(|clip| clip.name.clone()).collect();
    clips.sort_by_key(|clip| (clip.piece, clip.frames.start));
    Ok(CutSpeech { clips, best_first, refused })
}

/// Clips that could be cut from a piece, or why there is none.
fn candidates(piece: &SpokenPiece, fps: FrameRate, n_frames: usize) -> std::result::Result<Vec<CutCandidate>, String> {
    let secs = |frames: usize| fps.secs(frames);
    if piece.n_frames < n_frames {
        return Err(format!("{:.1} s long, shorter than a film of {:.1} s", secs(piece.n_frames), secs(n_frames)));
    }
    let level = SpeechLevel::of(&piece.sound);
    let at_ends: Vec<f32> = (0..=piece.n_frames).map(|frame| level.around(secs(frame))).collect();
    let unseen = unseen_before(piece);
    let n_joints = seen_joints().count() as f64;
    let all: Vec<CutCandidate> = (0..=piece.n_frames - n_frames)
        .map(|start| {
            let end = start + n_frames;
            let unseen = (unseen[end] - unseen[start]) as f64 / (n_joints * n_frames as f64);
            CutCandidate { start, cut_db: at_ends[start].max(at_ends[end]), unseen }
        })
        .collect();
    let least = all.iter().map(|candidate| candidate.unseen).fold(f64::INFINITY, f64::min);
    if least > MOST_UNSEEN {
        let (least, most) = (100.0 * least, 100.0 * MOST_UNSEEN);
        return Err(format!("{least:.0} % of the joints or more are not seen in any stretch: at most {most:.0} %"));
    }
    let is_spoken = |candidate: &CutCandidate| {
        level.speech_share(secs(candidate.start)..secs(candidate.start + n_frames)) >= LEAST_SPEECH
    };
    let spoken: Vec<CutCandidate> = all.into_iter().filter(is_spoken).collect();
    let least = 100.0 * LEAST_SPEECH;
    if spoken.is_empty() { Err(format!("no stretch in which {least:.0} % is speech")) } else { Ok(spoken) }
}

/// Number of joints not seen before each frame and after the last.
fn unseen_before(piece: &SpokenPiece) -> Vec<u64> {
    let mut sums = vec![0; piece.n_frames + 1];
    let Some((motion, _)) = &piece.natural else { return sums };
    for frame in 0..piece.n_frames {
        let n = seen_joints().filter(|joint| !motion.mask[[frame, *joint]]).count();
        sums[frame + 1] = sums[frame] + n as u64;
    }
    sums
}

/// Joints that can be seen or not: all but the origin and those that stand at the place of another.
fn seen_joints() -> impl Iterator<Item = usize> {
    (0..N_JOINTS).filter(|joint| *joint != NECK && !is_duplicate(*joint))
}
