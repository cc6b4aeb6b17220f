//! The runner with a toy stage: up-to-date units are skipped, others have a reason, and a failed or panicking unit
//! stops no other.

use orator_base::stage::fingerprint::{Fingerprint, HashCache};
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::record::{Failure, failure_path};
use orator_base::stage::runner::{StageOutcome, State, run, state};
use orator_base::stage::{Input, Report, Stage, Unit};
use std::path::{Path, PathBuf};

/// Copies the source in upper case.
struct Shout {
    version: u32,
    mark: &'static str,
}

impl Stage for Shout {
    fn name(&self) -> &'static str {
        "shout"
    }
    fn version(&self) -> u32 {
        self.version
    }
    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        serde_json::json!({ "shout": { "mark": self.mark } })
    }
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>> {
        Ok(vec![Input { role: "text".into(), path: unit.source.clone() }])
    }
    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> anyhow::Result<Report> {
        let text = std::fs::read_to_string(&unit.source)?;
        anyhow::ensure!(text != "bad", "{}: bad text", unit.source.display());
        assert!(text != "panic", "a defect");
        std::fs::write(out.join("loud.txt"), text.to_uppercase() + self.mark)?;
        Ok(Report { line: format!("{} letters", text.len()), ..Report::default() })
    }
}

fn units(dir: &Path, texts: &[(&str, &str)]) -> Vec<Unit> {
    let unit = |(name, text): &(&str, &str)| {
        let source: PathBuf = dir.join(name);
        std::fs::write(&source, text).unwrap();
        Unit { speaker: "host".into(), video: (*name).into(), source }
    };
    texts.iter().map(unit).collect()
}

#[test]
fn up_to_date_units_are_skipped_and_every_change_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let units = units(dir.path(), &[("a", "one"), ("b", "two")]);
    let stage = Shout { version: 1, mark: "!" };
    let run_all = |stage: &Shout, force| run(stage, &units, &work, &hashes, (2, force), &Silent);
    let status = |stage: &Shout| match state(stage, &units[0], &work, &hashes) {
        State::UpToDate(record) => format!("fresh: {}", record.line),
        State::Stale(reason) => reason.to_string(),
        State::Failed(error) => error,
    };
    assert_eq!(status(&stage), "not run yet");
    assert!(run_all(&stage, false).iter().all(|outcome| matches!(outcome, StageOutcome::Done(_))));
    assert_eq!(status(&stage), "fresh: 3 letters");
    assert!(run_all(&stage, false).iter().all(|outcome| matches!(outcome, StageOutcome::Skipped(_))));
    assert!(run_all(&stage, true).iter().all(|outcome| matches!(outcome, StageOutcome::Done(_))));
    assert_eq!(status(&Shout { version: 2, ..stage }), "the stage changed from version 1 to 2");
    assert_eq!(status(&Shout { mark: "?", ..stage }), "shout.mark changed from \"!\" to \"?\"");
    std::fs::write(&units[0].source, "three").unwrap();
    assert_eq!(status(&stage), "the text changed");
    assert!(matches!(run_all(&stage, false)[..], [StageOutcome::Done(_), StageOutcome::Skipped(_)]));
    std::fs::remove_file(work.join("shout/host/a/loud.txt")).unwrap();
    assert_eq!(status(&stage), "output loud.txt is missing");
}

#[test]
fn a_failure_stops_no_other_unit_and_preserves_its_old_output() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let units = units(dir.path(), &[("a", "fine"), ("b", "bad"), ("c", "panic"), ("d", "good")]);
    let stage = Shout { version: 1, mark: "!" };
    let outcomes = run(&stage, &units, &work, &hashes, (1, false), &Silent);
    let errors: Vec<Option<String>> = outcomes
        .iter()
        .map(|outcome| match outcome {
            StageOutcome::Failed(error) => Some(format!("{error:#}")),
            _ => None,
        })
        .collect();
    assert!(errors[0].is_none() && errors[3].is_none());
    let message = |at: usize| errors[at].as_deref().unwrap();
    assert!(message(1).ends_with("bad text") && message(2).contains("a defect"));
    std::fs::write(&units[0].source, "bad").unwrap();
    assert!(matches!(run(&stage, &units[..1], &work, &hashes, (1, false), &Silent)[0], StageOutcome::Failed(_)));
    assert!(matches!(state(&stage, &units[0], &work, &hashes), State::Failed(_)));
    assert_eq!(std::fs::read_to_string(work.join("shout/host/a/loud.txt")).unwrap(), "FINE!");
}

#[test]
fn an_outdated_failure_is_removed() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let hashes = HashCache::open(&work.join("hashes.json"));
    let units = units(dir.path(), &[("a", "fine")]);
    let stage = Shout { version: 1, mark: "!" };
    let folder = units[0].dir(&work.join("shout"));
    let fingerprint = Fingerprint::now(&stage, &units[0], &hashes).unwrap();
    let fail = || Failure { fingerprint: Some(fingerprint.clone()), error: "late".into() }.write(&folder).unwrap();
    for done in [true, false] {
        fail();
        let outcomes = run(&stage, &units, &work, &hashes, (1, false), &Silent);
        assert!(matches!(outcomes[0], StageOutcome::Done(_)) == done, "{outcomes:?}");
        assert!(!failure_path(&folder).exists());
    }
}
