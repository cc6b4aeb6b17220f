//! Progress of a whole run.

use anyhow::Result;
use orator_base::stage::overall::OverallProgress;
use orator_base::stage::progress::{PARTS, Progress, Silent, Task};
use orator_base::stage::{Input, Report, Stage, Unit};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

struct Costly(u32);

impl Stage for Costly {
    fn name(&self) -> &'static str {
        "costly"
    }
    fn version(&self) -> u32 {
        1
    }
    fn cost(&self) -> u32 {
        self.0
    }
    fn settings(&self, _: &Unit) -> serde_json::Value {
        serde_json::Value::Null
    }
    fn inputs(&self, _: &Unit) -> Result<Vec<Input>> {
        Ok(Vec::new())
    }
    fn run(&self, _: &Unit, _: &Path, _: &dyn Progress) -> Result<Report> {
        anyhow::bail!("not run")
    }
}

#[derive(Clone, Default)]
struct Counted(Arc<[AtomicU64; 2]>);

impl Progress for Counted {
    fn begin(&self, label: &str, _total: u64) -> Box<dyn Task + '_> {
        if label.contains("(2 units)") { Box::new(self.clone()) } else { Box::new(Silent) }
    }
    fn say(&self, _line: &str) {}
}

impl Task for Counted {
    fn advance(&self, steps: u64) {
        self.0[0].fetch_add(steps, Ordering::Relaxed);
    }
    fn skip(&self, steps: u64) {
        self.0[1].fetch_add(steps, Ordering::Relaxed);
    }
    fn detail(&self, _text: &str) {}
}

#[test]
fn bar_advances_within_a_unit_and_ends_at_the_total() {
    let unit = |video: &str| Unit { speaker: "host".into(), video: video.into(), source: "nothing".into() };
    let (units, stages) = ([unit("a"), unit("b")], [Costly(1), Costly(3)]);
    let stages = [&stages[0] as &dyn Stage, &stages[1]];
    let counted = Counted::default();
    let overall = OverallProgress::begin(&stages, &units, &counted);
    let steps = || counted.0.each_ref().map(|n| n.load(Ordering::Relaxed));
    let eighths = || steps().map(|n| n * 8 / PARTS);
    overall.skip(&stages, &units[0]);
    drop(overall.of(stages[0], &units[1]));
    assert_eq!(eighths(), [1, 4]);
    let costly = overall.of(stages[1], &units[1]);
    let task = costly.begin("", 3);
    task.advance(1);
    assert_eq!(eighths(), [2, 4]);
    task.advance(5);
    drop(task);
    drop(costly);
    assert_eq!(steps().iter().sum::<u64>(), PARTS);
}
