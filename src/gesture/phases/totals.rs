//! Sums of the phases of a hand.

use super::phase::{GesturePhase, PhaseKind};
use orator_base::math::order;

/// Phases of one hand, and the seconds in which they were searched for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhaseTotals {
    /// Duration of the motion, seconds, with the parts outside all phases.
    pub secs: f64,
    strokes: Vec<GesturePhase>,
    /// Seconds by `PhaseKind`.
    kind_secs: [f64; 4],
}

impl PhaseTotals {
    /// Adds the phases of an interval of `secs` seconds.
    pub fn add(&mut self, phases: &[GesturePhase], secs: f64) {
        self.secs += secs;
        phases.iter().for_each(|phase| self.kind_secs[phase.kind as usize] += phase.secs());
        self.strokes.extend(phases.iter().filter(|phase| phase.kind == PhaseKind::Stroke));
    }

    pub fn n_strokes(&self) -> usize {
        self.strokes.len()
    }

    pub fn strokes_per_minute(&self) -> f64 {
        60.0 * self.strokes.len() as f64 / self.secs.max(1e-9)
    }

    /// Share of the time in phases of a kind, 0..1.
    pub fn share(&self, kind: PhaseKind) -> f64 {
        self.kind_secs[kind as usize] / self.secs.max(1e-9)
    }

    /// Median amplitude of the strokes, metres, and median duration, seconds; `None`: there are no strokes.
    pub fn median_stroke(&self) -> Option<(f64, f64)> {
        let median = |value: fn(&GesturePhase) -> f64| order::median(self.strokes.iter().map(value));
        median(|stroke| stroke.amplitude).zip(median(GesturePhase::secs))
    }
}
