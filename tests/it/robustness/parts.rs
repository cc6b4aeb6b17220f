//! The runner with a toy stage whose units have parts: who has no unit helps, what is done is kept, what fails is told.

use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::parts::parts_folder;
use orator_base::stage::progress::{Progress, Silent};
use orator_base::stage::runner::{StageOutcome, run, run_parts};
use orator_base::stage::{Input, Report, Stage, Unit};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread::ThreadId;
use std::time::Duration;

/// Writes the letters of the source, each a part; the letter `!` fails.
#[derive(Default)]
struct Spell {
    /// Parts done, and by whom.
    done: Mutex<Vec<(String, ThreadId)>>,
}

impl Stage for Spell {
    fn name(&self) -> &'static str {
        "spell"
    }
    fn version(&self) -> u32 {
        1
    }
    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        serde_json::Value::Null
    }
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>> {
        Ok(vec![Input { role: "text".into(), path: unit.source.clone() }])
    }
    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> anyhow::Result<Report> {
        let text = std::fs::read_to_string(&unit.source)?;
        std::fs::write(out.join("word.txt"), &text)?;
        Ok(Report { line: text, ..Report::default() })
    }
    fn n_parts(&self, unit: &Unit) -> anyhow::Result<usize> {
        Ok(std::fs::read_to_string(&unit.source)?.len())
    }
    fn run_part(&self, unit: &Unit, part: usize, out: &Path, _progress: &dyn Progress) -> anyhow::Result<()> {
        std::thread::sleep(Duration::from_millis(20));
        let letter = std::fs::read_to_string(&unit.source)?[part..=part].to_owned();
        assert!(letter != "?", "a defect");
        anyhow::ensure!(letter != "!", "letter {part} cannot be spelt");
        self.done.lock().unwrap().push((letter.clone(), std::thread::current().id()));
        Ok(std::fs::write(out.join("letter.txt"), letter)?)
    }
    fn join(&self, _unit: &Unit, parts: &[PathBuf], out: &Path) -> anyhow::Result<Report> {
        let letters = parts.iter().map(|part| std::fs::read_to_string(part.join("letter.txt")));
        let line = letters.collect::<Result<String, _>>()?;
        std::fs::write(out.join("word.txt"), &line)?;
        Ok(Report { line, ..Report::default() })
    }
}

struct Place {
    dir: tempfile::TempDir,
    hashes: HashCache,
    stage: Spell,
}

impl Place {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let hashes = HashCache::open(&dir.path().join("hashes.json"));
        Self { dir, hashes, stage: Spell::default() }
    }

    fn unit(&self, name: &str, text: &str) -> Unit {
        let source = self.dir.path().join(name);
        std::fs::write(&source, text).unwrap();
        Unit { speaker: "host".into(), video: name.into(), source }
    }

    fn work(&self) -> PathBuf {
        self.dir.path().join("work")
    }

    fn run(&self, units: &[Unit], jobs: usize) -> Vec<String> {
        let ended = run(&self.stage, units, &self.work(), &self.hashes, (jobs, false), &Silent);
        let said = |outcome| match outcome {
            StageOutcome::Done(report) => report.line,
            StageOutcome::Skipped(report) => format!("skipped {}", report.line),
            StageOutcome::Failed(error) => format!("failed: {error:#}"),
        };
        ended.into_iter().map(said).collect()
    }

    /// Letters spelt since the last question, sorted.
    fn spelt(&self) -> String {
        let mut letters: Vec<String> = self.stage.done.lock().unwrap().drain(..).map(|(letter, _)| letter).collect();
        letters.sort();
        letters.concat()
    }
}

#[test]
fn workers_without_units_help_and_every_part_is_done_once() {
    let place = Place::new();
    let units = [place.unit("long", "abcdefghijklmno"), place.unit("short", "x"), place.unit("other", "pqr")];
    assert_eq!(place.run(&units, 4), ["abcdefghijklmno", "x", "pqr"]);
    let workers: BTreeSet<String> =
        place.stage.done.lock().unwrap().iter().map(|(_, thread)| format!("{thread:?}")).collect();
    assert!(workers.len() > 2, "{workers:?}");
    // The unit with one part is worked on as a whole.
    assert_eq!(place.spelt(), "abcdefghijklmnopqr");
    assert!(!parts_folder(&place.work().join("spell/host/long")).exists());
    assert_eq!(place.run(&units, 1), ["skipped abcdefghijklmno", "skipped x", "skipped pqr"]);
    assert_eq!(place.spelt(), "");
}

#[test]
fn parts_that_are_done_are_kept_until_the_unit_is() {
    let place = Place::new();
    let bad = place.unit("word", "ab!d");
    assert_eq!(place.run(std::slice::from_ref(&bad), 1), ["failed: letter 2 cannot be spelt"]);
    assert_eq!(place.run(std::slice::from_ref(&bad), 1), ["failed: letter 2 cannot be spelt"]);
    assert_eq!(place.spelt(), "ab", "the second time they were there");
    let defect = place.unit("word", "ab?d");
    assert!(place.run(&[defect], 2)[0].contains("internal error: a defect"));
    // Other contents, other parts.
    place.spelt();
    let good = place.unit("word", "abcd");
    let part = |share| run_parts(&place.stage, &good, share, &place.work(), &place.hashes, &Silent).unwrap();
    part((1, 3));
    assert_eq!(place.spelt(), "b");
    part((2, 3));
    assert_eq!(place.spelt(), "cd");
    assert_eq!(place.run(std::slice::from_ref(&good), 2), ["abcd"]);
    assert_eq!(place.spelt(), "a");
    part((0, 3));
    assert_eq!(place.spelt(), "", "the unit is done");
}
