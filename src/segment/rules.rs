//! The rules: measures of a video to intervals and a ledger. A frame is refused for the first reason that holds; what
//! is left is divided at shot boundaries, and pieces too short or with hands too seldom seen are refused whole.
//! Gaps shorter than a limit are no refusal: of face and arms between two good frames of a shot, of a hand anywhere.

use super::measure::Measures;
use super::refusal::Refusal;
use crate::config;
use crate::stage::ledger::{Kept, Ledger, Refused};
use crate::types::interval::{Interval, Intervals};
use crate::types::time::FrameRate;

/// The loudest sample of a video must reach this, dB of full scale: below it there is at best hiss.
pub const SILENCE_DB: f64 = -60.0;

/// What the rules know of a video beside the measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Video {
    pub fps: FrameRate,
    pub duration_secs: f64,
    pub sound: Option<Loudness>,
}

/// A video's sound in two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loudness {
    pub secs: f64,
    /// Of the loudest sample, dB of full scale; digital silence is -120.
    pub peak_db: f64,
}

/// A refusal with what was measured and the threshold.
type Mark = (Refusal, f64, f64);

/// Judges a whole video.
pub fn judge(measures: &Measures, video: &Video, rules: &config::Segment) -> (Intervals, Ledger) {
    let mut marks = whole_video(measures, video);
    bodies(&mut marks, measures, video, rules);
    hands(&mut marks, measures, video, rules);
    jumps(&mut marks, measures, rules);
    let pieces = pieces(&marks, measures, video, rules);
    let intervals = pieces.iter().filter(|(_, mark)| mark.is_none()).map(|(interval, _)| *interval).collect();
    let n_frames = measures.n_frames();
    (Intervals::new(video.fps, n_frames, intervals), ledger(&pieces, n_frames, video))
}

/// Sound: a silent video is refused whole; a frame that begins after the end of the sound has none.
fn whole_video(measures: &Measures, video: &Video) -> Vec<Option<Mark>> {
    let (secs, peak_db) = video.sound.map_or((0.0, f64::NEG_INFINITY), |sound| (sound.secs, sound.peak_db));
    let mark = |frame: usize| {
        if video.fps.secs(frame) >= secs {
            Some((Refusal::NoSound, secs, video.duration_secs))
        } else {
            (peak_db < SILENCE_DB).then_some((Refusal::Silent, peak_db, SILENCE_DB))
        }
    };
    (0..measures.n_frames()).map(mark).collect()
}

/// Person, size, face and arms, frame by frame; a short gap of them between two good frames of a shot is let through.
fn bodies(marks: &mut [Option<Mark>], measures: &Measures, video: &Video, rules: &config::Segment) {
    let score = rules.joint_score;
    let found: Vec<Option<Mark>> = (0..measures.n_frames())
        .map(|frame| {
            let tests = [
                (Refusal::NoPerson, measures.person[frame], score),
                (Refusal::Small, measures.shoulder_px[frame], rules.min_shoulder_px),
                (Refusal::Face, measures.face[frame], score),
                (Refusal::Arms, measures.arms[frame], score),
            ];
            let failed = |&(_, value, least): &(Refusal, f32, f64)| f64::from(value) < least;
            let failed = tests.into_iter().find(failed);
            failed.map(|(refusal, value, least)| (refusal, f64::from(value), least))
        })
        .collect();
    let max_gap = frames_within(rules.max_body_gap_secs, video.fps);
    for gap in runs(found.len(), |frame| found[frame].is_some(), |_| false) {
        let inside = gap.start > 0 && gap.end < found.len();
        let bridged = inside && measures.shot[gap.start - 1] == measures.shot[gap.end] && gap.n_frames() <= max_gap;
        if !bridged {
            (gap.start..gap.end).for_each(|frame| set(marks, frame, found[frame]));
        }
    }
}

/// Each hand: a gap longer than allowed refuses its frames.
fn hands(marks: &mut [Option<Mark>], measures: &Measures, video: &Video, rules: &config::Segment) {
    let max_gap = frames_within(rules.max_hand_gap_secs, video.fps);
    for hand in [&measures.left_hand, &measures.right_hand] {
        let missing = |frame: usize| f64::from(hand[frame]) < rules.joint_score;
        for gap in runs(hand.len(), missing, |frame| new_shot(measures, frame)) {
            if gap.n_frames() > max_gap {
                let mark = (Refusal::HandGap, video.fps.secs(gap.n_frames()), rules.max_hand_gap_secs);
                (gap.start..gap.end).for_each(|frame| set(marks, frame, Some(mark)));
            }
        }
    }
}

/// A neck that jumps within a shot: another person, or a mistake. Where a frame's arms are not visible its neck is not
/// either.
fn jumps(marks: &mut [Option<Mark>], measures: &Measures, rules: &config::Segment) {
    let seen = |frame: usize| f64::from(measures.arms[frame]) >= rules.joint_score;
    for frame in 1..measures.n_frames() {
        let jump = f64::from(measures.jump[frame]);
        if jump > rules.max_jump && !new_shot(measures, frame) && seen(frame) && seen(frame - 1) {
            set(marks, frame, Some((Refusal::Jump, jump, rules.max_jump)));
        }
    }
}

/// Stretches end to end over all frames: kept (no mark) or refused.
fn pieces(
    marks: &[Option<Mark>],
    measures: &Measures,
    video: &Video,
    rules: &config::Segment,
) -> Vec<(Interval, Option<Mark>)> {
    let reason = |frame: usize| marks[frame].map(|(refusal, _, _)| refusal);
    let divides =
        |frame: usize| reason(frame) != reason(frame - 1) || (reason(frame).is_none() && new_shot(measures, frame));
    let stretches = runs(marks.len(), |_| true, divides);
    let judged = stretches.into_iter().map(|stretch| {
        let mark = match marks[stretch.start] {
            Some((refusal, _, threshold)) => Some((refusal, mean(&marks[stretch.start..stretch.end]), threshold)),
            None => whole_piece(stretch, measures, video, rules),
        };
        (stretch, mark)
    });
    judged.collect()
}

/// Whether a piece of good frames is refused as a whole.
fn whole_piece(piece: Interval, measures: &Measures, video: &Video, rules: &config::Segment) -> Option<Mark> {
    if piece.n_frames() < rules.min_frames {
        let cut = [piece.start, piece.end].iter().any(|&frame| new_shot(measures, frame));
        let refusal = if cut { Refusal::Cut } else { Refusal::TooShort };
        return Some((refusal, video.fps.secs(piece.n_frames()), video.fps.secs(rules.min_frames)));
    }
    let share = |hand: &[f32]| {
        let seen = hand[piece.start..piece.end].iter().filter(|&&score| f64::from(score) >= rules.joint_score).count();
        seen as f64 / piece.n_frames() as f64
    };
    let least = share(&measures.left_hand).min(share(&measures.right_hand));
    (least < rules.min_hand_share).then_some((Refusal::HandShare, least, rules.min_hand_share))
}

/// The pieces as seconds. The last one ends with the video, so that a partly filled last frame is not lost.
fn ledger(pieces: &[(Interval, Option<Mark>)], n_frames: usize, video: &Video) -> Ledger {
    let mut ledger = Ledger { duration_secs: video.duration_secs, ..Ledger::default() };
    let nothing = [(Interval { start: 0, end: 0 }, Some((Refusal::NoPerson, 0.0, 0.0)))];
    let pieces = if pieces.is_empty() { &nothing[..] } else { pieces };
    for (piece, mark) in pieces {
        let start_secs = video.fps.secs(piece.start).min(video.duration_secs);
        let end_secs = if piece.end == n_frames {
            video.duration_secs
        } else {
            video.fps.secs(piece.end).min(video.duration_secs)
        };
        if end_secs <= start_secs {
            continue;
        }
        match *mark {
            None => ledger.kept.push(Kept { start_secs, end_secs }),
            Some((refusal, measured, threshold)) => ledger.refused.push(Refused {
                start_secs,
                end_secs,
                reason: refusal.reason().to_owned(),
                measured,
                threshold,
                unit: refusal.unit().to_owned(),
                says: refusal.says(measured, threshold),
            }),
        }
    }
    ledger
}

/// The earlier rule has its say first.
fn set(marks: &mut [Option<Mark>], frame: usize, mark: Option<Mark>) {
    marks[frame] = marks[frame].or(mark);
}

/// Whether `frame` begins a shot that is not the first.
fn new_shot(measures: &Measures, frame: usize) -> bool {
    frame > 0 && frame < measures.n_frames() && measures.shot[frame] != measures.shot[frame - 1]
}

/// Longest runs of frames for which `holds`, divided before each frame that `divides`.
fn runs(n_frames: usize, holds: impl Fn(usize) -> bool, divides: impl Fn(usize) -> bool) -> Vec<Interval> {
    let mut runs: Vec<Interval> = Vec::new();
    for frame in (0..n_frames).filter(|&frame| holds(frame)) {
        match runs.last_mut() {
            Some(run) if run.end == frame && !divides(frame) => run.end = frame + 1,
            _ => runs.push(Interval { start: frame, end: frame + 1 }),
        }
    }
    runs
}

/// Whole frames within `secs`.
fn frames_within(secs: f64, fps: FrameRate) -> usize {
    (secs * fps.per_sec() + 1e-6) as usize
}

fn mean(marks: &[Option<Mark>]) -> f64 {
    marks.iter().flatten().map(|(_, measured, _)| measured).sum::<f64>() / marks.len().max(1) as f64
}
