//! Progress bar of a complete run: it advances while a stage works on a video, by that stage's share of the work.

use super::progress::{Event, PARTS, Progress, Task};
use super::{Stage, Unit};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Work on all units at all stages as one task of `PARTS` steps.
pub struct OverallProgress<'a> {
    progress: &'a dyn Progress,
    task: Box<dyn Task + 'a>,
    total_work: f64,
    /// Work done so far, and the number of task steps reported for it.
    done: Mutex<(f64, u64)>,
    has_estimate: AtomicBool,
}

impl<'a> OverallProgress<'a> {
    /// Begins the task. The work on a unit at a stage is the size of its source file in bytes times the stage's cost.
    pub fn begin(stages: &[&dyn Stage], units: &[Unit], progress: &'a dyn Progress) -> Self {
        let total_work = units.iter().flat_map(|unit| stages.iter().map(|stage| work(*stage, unit))).sum();
        let label = format!("{} ({})", names(stages), crate::text::counted(units.len(), "unit"));
        let task = progress.begin(&label, PARTS);
        Self { progress, task, total_work, done: Mutex::new((0.0, 0)), has_estimate: AtomicBool::new(false) }
    }

    /// Returns the progress handle for the work of `stage` on `unit`.
    pub fn of(&'a self, stage: &dyn Stage, unit: &Unit) -> UnitProgress<'a> {
        let label = format!("{} {unit}", stage.name());
        UnitProgress { overall: self, label, left: Mutex::new(work(stage, unit)) }
    }

    /// Returns the progress handle for one part of the work of `stage` on `unit`.
    pub fn of_part(&'a self, stage: &dyn Stage, unit: &Unit, part: usize, n_parts: usize) -> UnitProgress<'a> {
        let label = format!("{} {unit} {} of {n_parts}", stage.name(), part + 1);
        UnitProgress { overall: self, label, left: Mutex::new(work(stage, unit) / n_parts.max(1) as f64) }
    }

    /// Counts the work of these stages on the unit as skipped, because it is not needed or is not done.
    pub fn skip(&self, stages: &[&dyn Stage], unit: &Unit) {
        self.count(stages.iter().map(|stage| work(*stage, unit)).sum(), |task, steps| task.skip(steps));
    }

    fn count(&self, work: f64, report: impl FnOnce(&dyn Task, u64)) {
        let Ok(mut done) = self.done.lock() else { return };
        done.0 += work;
        let steps = (done.0 / self.total_work * PARTS as f64).round().clamp(0.0, PARTS as f64) as u64;
        report(&*self.task, steps.saturating_sub(done.1));
        done.1 = done.1.max(steps);
    }
}

fn work(stage: &dyn Stage, unit: &Unit) -> f64 {
    let bytes = std::fs::metadata(&unit.source).map_or(0, |meta| meta.len());
    f64::from(stage.cost()) * bytes.max(1) as f64
}

fn names(stages: &[&dyn Stage]) -> String {
    match stages {
        [first, .., last] => format!("{} to {}", first.name(), last.name()),
        _ => stages.iter().map(|stage| stage.name()).collect(),
    }
}

/// Progress of one stage on one unit. Dropping it counts the remaining work as done.
pub struct UnitProgress<'a> {
    overall: &'a OverallProgress<'a>,
    label: String,
    left: Mutex<f64>,
}

impl UnitProgress<'_> {
    /// Counts the remaining work as skipped.
    pub fn skip(&self) {
        let Ok(mut left) = self.left.lock() else { return };
        self.overall.count(std::mem::take(&mut *left), |task, steps| task.skip(steps));
    }

    fn count(&self, work: f64) {
        let Ok(mut left) = self.left.lock() else { return };
        let work = work.min(*left);
        *left -= work;
        self.overall.count(work, |task, steps| task.advance(steps));
    }
}

impl Progress for UnitProgress<'_> {
    fn begin(&self, _label: &str, total: u64) -> Box<dyn Task + '_> {
        let remaining = self.left.lock().map_or(0.0, |left| *left);
        let task = self.overall.progress.begin(&self.label, total);
        Box::new(UnitTask { task, unit: self, step: if total == 0 { 0.0 } else { remaining / total as f64 } })
    }

    fn say(&self, line: &str) {
        self.overall.progress.say(line);
    }

    fn event(&self, event: &Event<'_>) {
        let is_repeated =
            matches!(event, Event::Estimate { .. }) && self.overall.has_estimate.swap(true, Ordering::Relaxed);
        if !is_repeated {
            self.overall.progress.event(event);
        }
    }
}

impl Drop for UnitProgress<'_> {
    fn drop(&mut self) {
        self.count(f64::INFINITY);
    }
}

struct UnitTask<'a> {
    task: Box<dyn Task + 'a>,
    unit: &'a UnitProgress<'a>,
    /// Work per step.
    step: f64,
}

impl Task for UnitTask<'_> {
    fn advance(&self, steps: u64) {
        self.task.advance(steps);
        self.unit.count(self.step * steps as f64);
    }
    fn detail(&self, text: &str) {
        self.task.detail(text);
    }
}
