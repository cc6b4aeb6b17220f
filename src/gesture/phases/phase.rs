//! Phases of a hand: its movements, and the pauses between them, which are rests at the position to which the hand returns
//! and holds elsewhere.

use super::movements::{self, MIN_PAUSE_SECS, WristMovement, WristRun, WristThresholds};
use super::wrist_track::WristTrack;
use orator_base::math::order::{self, Ordered};
use orator_base::math::vec3::{Vec3, norm, sub};
use orator_formats::transcript::Word;

/// Radius around the rest position, and depth below it at which a pause is also a rest, metres for a normal arm.
const REST_RADIUS: f64 = 0.12;
const REST_DEPTH: f64 = 0.03;
/// Height above the lowest positions at which a pause counts 1/e as much in the search for the rest position, metres.
const REST_HEIGHT: f64 = 0.2;
/// Minimum depth of a rest position below the shoulders, metres.
const MIN_REST_DEPTH: f64 = 0.15;
/// Longest time between the start of a stroke and a word to which it is bound, seconds.
const WORD_SECS: f64 = 0.2;

/// Kind of a phase (Kita et al. 1998).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PhaseKind {
    /// Movement to a position other than the rest; it includes the preparation, which kinematics alone do not separate.
    Stroke,
    /// Movement back to rest.
    Retraction,
    /// Pause away from rest.
    Hold,
    /// Pause at rest.
    Rest,
}

impl PhaseKind {
    pub const ALL: [Self; 4] = [Self::Stroke, Self::Retraction, Self::Hold, Self::Rest];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Stroke => "stroke",
            Self::Retraction => "retraction",
            Self::Hold => "hold",
            Self::Rest => "rest",
        }
    }
}

/// Phase of one hand; positions are relative to the trunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GesturePhase {
    pub kind: PhaseKind,
    pub start_secs: f64,
    pub end_secs: f64,
    /// 0..1: 0.5 if a value equals a threshold, nearer to 1 the farther it is from it, times the share of frames in
    /// which the wrist was detected.
    pub confidence: f64,
    /// Largest distance from the first position, metres.
    pub amplitude: f64,
    /// Largest speed, m/s.
    pub peak_speed: f64,
    /// Highest position above the midpoint of the shoulders, metres; negative below.
    pub height: f64,
}

impl GesturePhase {
    pub fn secs(&self) -> f64 {
        self.end_secs - self.start_secs
    }

    /// The word to which the phase is bound: of those that overlap it, or from which its start is at most 0.2 s away,
    /// the one with the longest overlap, then the nearest. `words` have the clock of the phase.
    pub fn bound_word<'w>(&self, words: &'w [Word]) -> Option<&'w Word> {
        let overlap = |word: &Word| (self.end_secs.min(word.end_secs) - self.start_secs.max(word.start_secs)).max(0.0);
        let distance = |word: &Word| (word.start_secs - self.start_secs).max(self.start_secs - word.end_secs).max(0.0);
        let near = words.iter().filter(|word| overlap(word) > 0.0 || distance(word) <= WORD_SECS);
        near.min_by(|a, b| overlap(b).total_cmp(&overlap(a)).then(distance(a).total_cmp(&distance(b))))
    }
}

/// Finds the phases of a hand in the intervals of one recording, each with times from its start, in order and disjoint.
/// Thresholds and the rest position are those of the recording. A missing frame ends a phase, and pauses of less than
/// 0.2 s are ignored.
pub fn find_phases(tracks: &[WristTrack]) -> Vec<Vec<GesturePhase>> {
    let (thresholds, runs) = movements::runs(tracks);
    let found = runs.iter().map(|runs| runs.iter().map(|run| RunPhases::new(run, &thresholds)).collect());
    let found: Vec<Vec<RunPhases>> = found.collect();
    let rest = rest_position(found.iter().flatten(), thresholds.metres);
    let phases = tracks
        .iter()
        .zip(&found)
        .map(|(track, runs)| runs.iter().flat_map(|run| run.phases(track, &thresholds, rest)).collect());
    phases.collect()
}

/// Movements and pauses of a run, seconds from its first frame.
struct RunPhases<'r> {
    run: &'r WristRun,
    movements: Vec<WristMovement>,
    /// Start, end and mean position of the pauses before each movement and after the last; `None`: too short.
    pauses: Vec<Option<(f64, f64, Vec3)>>,
}

impl<'r> RunPhases<'r> {
    fn new(run: &'r WristRun, thresholds: &WristThresholds) -> Self {
        let movements = run.movements(thresholds);
        let starts = std::iter::once(0.0).chain(movements.iter().map(|movement| movement.end_secs));
        let ends = movements.iter().map(|movement| movement.start_secs).chain([run.secs()]);
        let pause = |(start, end): (f64, f64)| {
            (end - start >= MIN_PAUSE_SECS).then(|| (start, end, movements::mean(&run.smooth[run.frames(start, end)])))
        };
        let pauses = starts.zip(ends).map(pause).collect();
        Self { run, movements, pauses }
    }

    /// Phases with times from the start of the track.
    fn phases(&self, track: &WristTrack, thresholds: &WristThresholds, rest: Option<Vec3>) -> Vec<GesturePhase> {
        let mut phases = Vec::new();
        for (n, pause) in self.pauses.iter().enumerate() {
            if let Some((start, end, at)) = pause {
                let (kind, margin) = pause_kind(*at, rest, thresholds.metres);
                phases.push(self.phase(track, (kind, *start, *end), |speed, _| {
                    margin.min(1.0 - 0.5 * (speed / thresholds.low_speed).powi(2))
                }));
            }
            if let Some(WristMovement { start_secs, end_secs }) = self.movements.get(n) {
                let next = self.pauses.get(n + 1).copied().flatten();
                let is_return =
                    next.is_some_and(|(_, _, at)| pause_kind(at, rest, thresholds.metres).0 == PhaseKind::Rest);
                let kind = if is_return { PhaseKind::Retraction } else { PhaseKind::Stroke };
                phases.push(self.phase(track, (kind, *start_secs, *end_secs), |_, peak| {
                    1.0 - 0.5 * (thresholds.peak_speed / peak.max(thresholds.peak_speed)).powi(2)
                }));
            }
        }
        phases
    }

    /// Phase with its kinematics; `confidence` is a function of the median and the largest speed, m/s.
    fn phase(
        &self,
        track: &WristTrack,
        (kind, start, end): (PhaseKind, f64, f64),
        confidence: impl Fn(f64, f64) -> f64,
    ) -> GesturePhase {
        let frames = self.run.frames(start, end);
        let positions = &self.run.smooth[frames.clone()];
        let speeds = &self.run.speeds[frames.clone()];
        let first = self.run.first_frame;
        let visible = &track.is_visible[first + frames.start..first + frames.end];
        let visible_share = visible.iter().filter(|is_visible| **is_visible).count() as f64 / visible.len() as f64;
        let peak_speed = speeds.iter().copied().fold(0.0, f64::max);
        let median_speed = order::median(speeds.iter().copied()).unwrap_or(0.0);
        let zero_secs = track.fps.secs(first);
        GesturePhase {
            kind,
            start_secs: zero_secs + start,
            end_secs: zero_secs + end,
            confidence: (visible_share * confidence(median_speed, peak_speed)).clamp(0.0, 1.0),
            amplitude: positions.iter().map(|p| norm(sub(*p, positions[0]))).fold(0.0, f64::max),
            peak_speed,
            height: positions.iter().map(|p| -p[1]).fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// Kind of a pause, and the confidence in it.
fn pause_kind(at: Vec3, rest: Option<Vec3>, metres: f64) -> (PhaseKind, f64) {
    let Some(rest) = rest else { return (PhaseKind::Hold, 0.5) };
    let (distance, radius) = (norm(sub(at, rest)), REST_RADIUS * metres);
    let margin = |ratio: f64| 1.0 - 0.5 * ratio * ratio;
    if distance < radius {
        (PhaseKind::Rest, margin(distance / radius))
    } else if at[1] > rest[1] + REST_DEPTH * metres {
        (PhaseKind::Rest, 0.5)
    } else {
        (PhaseKind::Hold, margin(radius / distance))
    }
}

/// The pause near which the hand pauses longest, with a preference for low ones; `None`: there are no
/// pauses below the shoulders.
fn rest_position<'r>(runs: impl Iterator<Item = &'r RunPhases<'r>> + Clone, metres: f64) -> Option<Vec3> {
    let heights = runs.clone().flat_map(|run| run.run.smooth.iter().map(|p| p[1]));
    let lowest = Ordered::new(heights).quantile(0.95)?;
    let pauses: Vec<(f64, f64, Vec3)> = runs.flat_map(|run| run.pauses.iter().flatten().copied()).collect();
    let weight = |at: Vec3| {
        let near = |(start, end, other): &(f64, f64, Vec3)| {
            let distance = norm(sub(*other, at)) / (0.5 * REST_RADIUS * metres);
            (end - start) * (-0.5 * distance * distance).exp()
        };
        let height = (lowest - at[1]).max(0.0) / (REST_HEIGHT * metres);
        pauses.iter().map(near).sum::<f64>() * (-height).exp()
    };
    let low = pauses.iter().filter(|(_, _, at)| at[1] > MIN_REST_DEPTH * metres);
    low.map(|(_, _, at)| (weight(*at), *at)).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
}
