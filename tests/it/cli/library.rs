//! The pipeline as a library: run, status and errors without the command line.

use crate::fixtures::footage;
use orator::{BusyFolder, Event, Pipeline, Progress, Selection, Silent, StageName, Task, load_config};
use orator_base::stage::workdir;
use orator_pipeline::{RunState, UnitState};
use std::sync::Mutex;

/// Records the events of a run.
#[derive(Default)]
struct EventRecorder(Mutex<Vec<String>>);

impl Progress for EventRecorder {
    fn begin(&self, _label: &str, _total: u64) -> Box<dyn Task> {
        Box::new(Silent)
    }
    fn say(&self, _line: &str) {}
    fn event(&self, event: &Event<'_>) {
        self.0.lock().unwrap().push(format!("{event:?}"));
    }
}

#[test]
fn a_program_runs_the_pipeline_and_reads_its_status() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("pipeline.toml");
    std::fs::write(&file, "[[speaker]]\nname = \"host\"\nvideos = [\"a.mp4\", \"none-*.mp4\"]\n").unwrap();
    let pipeline = Pipeline::open(load_config(&file, &[]).unwrap()).unwrap();
    let [videos] = &pipeline.videos(&[]).unwrap()[..] else { panic!("one speaker") };
    let [unit] = &videos.units[..] else { panic!("one video") };
    let work = &pipeline.config().settings.work.dir;
    footage::write(work, unit, &footage::good(100), "a");

    let selection = Selection { from: StageName::Segment, to: StageName::Lift, ..Selection::default() };
    let recorder = EventRecorder::default();
    let report = pipeline.run(&selection, &recorder).unwrap();
    let done: Vec<_> = report.units.iter().map(|unit| (unit.stage, unit.state)).collect();
    assert_eq!(done, [(StageName::Segment, RunState::Done), (StageName::Lift, RunState::Done)]);
    assert_eq!(report.stages[&StageName::Lift].done, 1);
    let [failure] = &report.failures[..] else { panic!("one pattern without a video") };
    assert_eq!(failure.speaker.as_deref(), Some("host"));
    let mut events = recorder.0.into_inner().unwrap();
    events.retain(|event| !event.starts_with("Advice"));
    assert!(events[0].starts_with("NoVideo") && events[2].starts_with("Done { stage: \"lift\""), "{events:?}");
    assert_eq!(pipeline.run(&selection, &Silent).unwrap().units[1].state, RunState::UpToDate);

    let status = pipeline.status(&[]).unwrap();
    assert_eq!(status.units[0].state, UnitState::NoVideo);
    assert_eq!((status.units[1].stage, status.units[1].state), (StageName::Extract, UnitState::NeverDone));
    assert!(!status.datasets_are_up_to_date());
    assert!(pipeline.status(&["guest".to_owned()]).is_err());
}

#[test]
fn errors_that_stop_a_run_have_types() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("pipeline.toml");
    std::fs::write(&file, "[[speaker]]\nname = \"host\"\nvideos = [\"a.mp4\"]\n").unwrap();
    let error = load_config(&file, &["extract.fps=0".to_owned()]).unwrap_err();
    assert!(error.is::<orator::ConfigError>(), "{error:#}");
    let pipeline = Pipeline::open(load_config(&file, &[]).unwrap()).unwrap();
    let missing = pipeline.run(&Selection::only(StageName::Extract), &Silent).unwrap();
    assert!(missing.failures[0].cause.is_some() && missing.stages[&StageName::Extract].failed == 1);
    // A process that another test is starting may hold a copy of the run's lock for a moment.
    let lock = |_| {
        let lock = workdir::lock(&pipeline.config().settings.work.dir).ok();
        std::thread::sleep(std::time::Duration::from_millis(if lock.is_none() { 50 } else { 0 }));
        lock
    };
    let _lock = (0..200).find_map(lock).unwrap();
    let error = pipeline.run(&Selection::only(StageName::Extract), &Silent).unwrap_err();
    assert!(error.is::<BusyFolder>(), "{error:#}");
}
