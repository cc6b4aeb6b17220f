//! Output that cannot be written neither stops a run nor panics.

use orator_test_support::project::{Project, files_under};
use std::fs::OpenOptions;
use std::process::{Command, Stdio};

fn orator(project: &Project, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.current_dir(project.dir()).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Write end of a pipe without a reader.
fn closed_pipe() -> Stdio {
    std::io::pipe().unwrap().1.into()
}

fn full_device() -> Stdio {
    OpenOptions::new().write(true).open("/dev/full").unwrap().into()
}

#[test]
fn a_run_completes_when_its_output_pipes_are_closed() {
    let project = Project::with_clips("pipe", 1, 4.6);
    let is_done = || {
        let done = files_under(&project.work()).iter().any(|(name, _)| name.ends_with(".tar"));
        std::fs::remove_dir_all(project.work()).unwrap();
        done
    };
    let closed = orator(&project, &["run"]).stdout(closed_pipe()).stderr(closed_pipe()).status().unwrap();
    assert_eq!((closed.code(), is_done()), (Some(0), true), "both pipes closed");
    let errors_full = orator(&project, &["run"]).stderr(full_device()).status().unwrap();
    assert_eq!((errors_full.code(), is_done()), (Some(0), true), "standard error full");
    let output_full = orator(&project, &["run", "--json"]).stdout(full_device()).status().unwrap();
    assert_eq!((output_full.code(), is_done()), (Some(1), true), "standard output full");
}

#[test]
fn verbs_fail_on_full_standard_output_but_not_on_a_closed_pipe() {
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
            assert_eq!(with(Stdio::null(), full_device()), plain, "{verb:?}, standard error full");
            if plain == Some(0) {
                assert_eq!(with(full_device(), full_device()), Some(1), "{verb:?}, standard output full");
            }
        }
    }
}
