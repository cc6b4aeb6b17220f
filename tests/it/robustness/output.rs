//! Output that cannot be written neither stops work nor panics.

use orator_test_support::project::{Project, files_under};
use std::fs::OpenOptions;
use std::process::{Command, Stdio};

fn orator(project: &Project, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.current_dir(project.dir()).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// The writing end of a pipe that nobody reads.
fn closed_pipe() -> Stdio {
    std::io::pipe().unwrap().1.into()
}

fn full() -> Stdio {
    OpenOptions::new().write(true).open("/dev/full").unwrap().into()
}

#[test]
fn a_run_outlives_its_readers() {
    let project = Project::with_clips("pipe", 1, 4.6);
    let is_done = || {
        let done = files_under(&project.work()).iter().any(|(name, _)| name.ends_with(".tar"));
        std::fs::remove_dir_all(project.work()).unwrap();
        done
    };
    let closed = orator(&project, &["run"]).stdout(closed_pipe()).stderr(closed_pipe()).status().unwrap();
    assert_eq!((closed.code(), is_done()), (Some(0), true), "both pipes closed");
    let silent = orator(&project, &["run"]).stderr(full()).status().unwrap();
    assert_eq!((silent.code(), is_done()), (Some(0), true), "standard error full");
    let lost = orator(&project, &["run", "--json"]).stdout(full()).status().unwrap();
    assert_eq!((lost.code(), is_done()), (Some(1), true), "the answer is lost");
}

#[test]
fn every_verb_reports_a_lost_answer_and_forgives_a_closed_pipe() {
    let project = Project::with_clips("verbs", 0, 1.0);
    let verbs: [&[&str]; 7] = [
        &["status"],
        &["models", "list"],
        &["models", "check"],
        &["doctor"],
        &["guide", "dataset"],
        &["completions", "bash"],
        &["run", "--set", "extract.fps=-1"],
    ];
    for verb in verbs {
        for json in [false, true] {
            let with = |out: Stdio, err: Stdio| {
                let args = [verb, if json { &["--json"] } else { &[] }].concat();
                orator(&project, &args).stdout(out).stderr(err).status().unwrap().code()
            };
            let plain = with(Stdio::null(), Stdio::null());
            assert_eq!(with(closed_pipe(), closed_pipe()), plain, "{verb:?}, closed");
            assert_eq!(with(Stdio::null(), full()), plain, "{verb:?}, standard error full");
            if plain == Some(0) {
                assert_eq!(with(full(), full()), Some(1), "{verb:?}, standard output full");
            }
        }
    }
}
