//! Turns the measures of a video into intervals and a ledger, by the rules of `table`. A frame is rejected by the first
//! rule that fails for longer than its gap allows, unless a user decided otherwise. The rest is split at
//! shot boundaries and identity changes; pieces that are too short or violate a rule on segments are rejected as a
//! whole.

use super::measure::Measures;
use super::table::{FrameRule, Gap, frame_rules, segment_rules};
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_dataset::decisions::{Decision, DecisionAction};
use orator_formats::media_json::MediaInfo;

/// Decision of a user about a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ByHand<'a> {
    Accepted,
    /// Rejected by `author`, in a range of `secs` seconds.
    Rejected {
        author: &'a str,
        secs: f64,
    },
}

/// Judges a video. `decisions` are those of users on this video; actions other than accept and reject are ignored.
pub fn judge(
    measures: &Measures,
    video: &MediaInfo,
    rules: &config::SegmentConfig,
    decisions: &[&Decision],
) -> (Intervals, Ledger) {
    let n_frames = measures.n_frames();
    let begins_shot = |t: usize| {
        let score = f64::from(measures.shot_score[t]);
        t > 0 && score > 0.0 && score >= rules.shot_threshold
    };
    let begins_shot: Vec<bool> = (0..n_frames).map(begins_shot).collect();
    let rests: Vec<bool> = measures.rest.iter().map(|&rest| f64::from(rest) < rules.max_rest_move).collect();
    let (mut rejections, mut no_person) = (vec![None; n_frames], vec![None; n_frames]);
    for rule in frame_rules(rules) {
        let holds = |t: usize| {
            rule.bound.holds(f64::from((rule.values)(measures)[t]))
                || (rule.compares_frames && begins_shot[t])
                || (rule.allows_rest && rests[t])
        };
        apply(&rule, holds, &mut rejections, measures, &begins_shot, video.fps);
        if rule.rejection == Rejection::NoPerson {
            apply(&rule, holds, &mut no_person, measures, &begins_shot, video.fps);
        }
    }
    let decided = by_hand(decisions, n_frames, video.fps);
    for (rejected, (decided, no_person)) in rejections.iter_mut().zip(decided.iter().zip(no_person)) {
        *rejected = match decided {
            None => *rejected,
            // Without a person there is nothing to accept.
            Some(ByHand::Accepted) => no_person,
            Some(ByHand::Rejected { secs, .. }) => Some(FrameRejection::new(Rejection::ByHand, *secs, 0.0)),
        };
    }
    let pieces = pieces(&rejections, &decided, measures, &begins_shot, video.fps, rules);
    let intervals = pieces.iter().filter(|(_, rejected)| rejected.is_none()).map(|(interval, _)| *interval).collect();
    let resting = runs(n_frames, |t| rests[t], |_| false);
    let intervals = Intervals::new(video.fps, n_frames, intervals).with_resting(&resting);
    let ledger = ledger(&pieces, &decided, n_frames, video).with_resting(intervals.resting_intervals());
    (intervals, ledger)
}

/// Decision about each of `n_frames` frames; the last one of several counts.
fn by_hand<'a>(decisions: &[&'a Decision], n_frames: usize, fps: FrameRate) -> Vec<Option<ByHand<'a>>> {
    let mut decided = vec![None; n_frames];
    for decision in decisions {
        let effect = match decision.action {
            DecisionAction::Accept => ByHand::Accepted,
            DecisionAction::Reject => {
                ByHand::Rejected { author: &decision.author, secs: decision.end_secs - decision.start_secs }
            }
            _ => continue,
        };
        decided[decision.frames(fps, n_frames)].fill(Some(effect));
    }
    decided
}

/// Rejects the frames of runs in which `rule` fails for too long, unless an earlier rule has rejected them.
fn apply(
    rule: &FrameRule,
    holds: impl Fn(usize) -> bool,
    rejections: &mut [Option<FrameRejection>],
    measures: &Measures,
    begins_shot: &[bool],
    fps: FrameRate,
) {
    let (values, n_frames) = ((rule.values)(measures), rejections.len());
    for run in runs(n_frames, |t| !holds(t), |t| begins_shot[t]) {
        let is_inside = run.start > 0 && run.end < n_frames && !begins_shot[run.start] && !begins_shot[run.end];
        let (longest, threshold) = match rule.gap {
            Gap::Anywhere(secs) => (frames_within(secs, fps), secs),
            Gap::Inside(secs) => (if is_inside { frames_within(secs, fps) } else { 0 }, secs),
        };
        if run.n_frames() <= longest {
            continue;
        }
        for t in run.start..run.end {
            let rejected = if rule.measures_secs {
                FrameRejection::new(rule.rejection, fps.secs(run.n_frames()), threshold)
            } else {
                FrameRejection::new(rule.rejection, f64::from(values[t]), rule.bound.threshold())
            };
            rejections[t] = rejections[t].or(Some(rejected));
        }
    }
}

/// Consecutive pieces covering all frames, accepted (`None`) or rejected.
fn pieces(
    rejections: &[Option<FrameRejection>],
    decided: &[Option<ByHand>],
    measures: &Measures,
    begins_shot: &[bool],
    fps: FrameRate,
    rules: &config::SegmentConfig,
) -> Vec<(Interval, Option<FrameRejection>)> {
    let reason = |t: usize| rejections[t].map(|rejected| rejected.rejection);
    let begins = |t: usize| begins_shot[t] || measures.identity[t] > 0.0;
    let divides = |t: usize| {
        let is_other_decision = || reason(t) == Some(Rejection::ByHand) && decided[t] != decided[t - 1];
        reason(t) != reason(t - 1) || (reason(t).is_none() && begins(t)) || is_other_decision()
    };
    let judged = runs(rejections.len(), |_| true, divides).into_iter().flat_map(|piece| {
        let rejected = match rejections[piece.start] {
            Some(rejected) => {
                let measured = FrameRejection::mean_measured(&rejections[piece.start..piece.end]);
                return vec![(piece, Some(FrameRejection { measured, ..rejected }))];
            }
            None => too_short(piece, measures, begins_shot, fps, rules)
                .or_else(|| violated_segment_rule(piece, measures, rules)),
        };
        if rejected.is_none() {
            return vec![(piece, None)];
        }
        // Of a piece that is rejected as a whole, the frames remain that a user accepted.
        let is_accepted = |t: usize| decided[t] == Some(ByHand::Accepted);
        let parts = runs(piece.end, |t| t >= piece.start, |t| is_accepted(t) != is_accepted(t - 1));
        parts.into_iter().map(|part| (part, rejected.filter(|_| !is_accepted(part.start)))).collect()
    });
    judged.collect()
}

/// Rejection of a piece of good frames that is shorter than the least interval, with the cause.
fn too_short(
    piece: Interval,
    measures: &Measures,
    begins_shot: &[bool],
    fps: FrameRate,
    rules: &config::SegmentConfig,
) -> Option<FrameRejection> {
    if piece.n_frames() >= rules.min_frames {
        return None;
    }
    let at_end = |begins: &dyn Fn(usize) -> bool| {
        [piece.start, piece.end].into_iter().any(|t| t > 0 && t < begins_shot.len() && begins(t))
    };
    let rejection = if at_end(&|t| begins_shot[t]) {
        Rejection::Cut
    } else if at_end(&|t| measures.identity[t] > 0.0) {
        Rejection::Identity
    } else {
        Rejection::TooShort
    };
    Some(FrameRejection::new(rejection, fps.secs(piece.n_frames()), fps.secs(rules.min_frames)))
}

/// Rejection by the first rule on segments that a piece of good frames violates.
fn violated_segment_rule(
    piece: Interval,
    measures: &Measures,
    rules: &config::SegmentConfig,
) -> Option<FrameRejection> {
    segment_rules(rules).into_iter().find_map(|rule| {
        let values = (rule.values)(measures);
        let rests = |t: usize| rule.allows_rest && f64::from(measures.rest[t]) < rules.max_rest_move;
        let is_counted = |&t: &usize| rule.counted.holds(f64::from(values[t])) || rests(t);
        let n = (piece.start..piece.end).filter(is_counted).count();
        let share = n as f64 / piece.n_frames().max(1) as f64;
        (!rule.share.holds(share)).then(|| FrameRejection::new(rule.rejection, share, rule.share.threshold()))
    })
}

/// Converts pieces to seconds. The last one ends with the video, so that a partial last frame is counted.
fn ledger(
    pieces: &[(Interval, Option<FrameRejection>)],
    decided: &[Option<ByHand>],
    n_frames: usize,
    video: &MediaInfo,
) -> Ledger {
    let mut ledger = Ledger { duration_secs: video.duration_secs, ..Ledger::default() };
    let no_frames = [(Interval { start: 0, end: 0 }, Some(FrameRejection::new(Rejection::NoPerson, 0.0, 0.0)))];
    let pieces = if pieces.is_empty() { &no_frames[..] } else { pieces };
    for (piece, rejected) in pieces {
        let start_secs = video.fps.secs(piece.start).min(video.duration_secs);
        let end_secs = if piece.end == n_frames {
            video.duration_secs
        } else {
            video.fps.secs(piece.end).min(video.duration_secs)
        };
        if end_secs <= start_secs {
            continue;
        }
        match *rejected {
            None => ledger.accepted.push(AcceptedInterval { start_secs, end_secs }),
            Some(why) => ledger.rejected.push(match decided.get(piece.start) {
                Some(Some(ByHand::Rejected { author, .. })) if !author.is_empty() => {
                    let message = format!("{} ({author})", why.rejection.message(why.measured, why.threshold));
                    RejectedInterval::with_message(start_secs, end_secs, why, message)
                }
                _ => RejectedInterval::new(start_secs, end_secs, why),
            }),
        }
    }
    ledger
}

/// Maximal runs of frames that satisfy `holds`, split before each frame that satisfies `divides`.
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

/// Number of complete frames within `secs`.
fn frames_within(secs: f64, fps: FrameRate) -> usize {
    (secs * fps.per_sec() + 1e-6) as usize
}
