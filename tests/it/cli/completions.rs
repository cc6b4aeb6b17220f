//! `orator completions` and `orator man` cover every subcommand, and bash can run its script.

use std::path::Path;
use std::process::Command;

fn orator(arguments: &[&str], dir: &Path) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_orator")).args(arguments).current_dir(dir).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn scripts_contain_the_subcommands_and_bash_runs_its_script() {
    let dir = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let script = orator(&["completions", shell], dir.path());
        for word in ["status", "generate", "evaluate", "completions", "json"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    std::fs::write(dir.path().join("orator.bash"), orator(&["completions", "bash"], dir.path())).unwrap();
    let call = "source ./orator.bash; COMP_WORDS=(orator stat); COMP_CWORD=1; _orator orator stat orator; echo ${COMPREPLY[@]}";
    let output = Command::new("bash").args(["-c", call]).current_dir(dir.path()).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "status", "{output:?}");
}

#[test]
fn the_manual_has_a_page_per_subcommand() {
    let dir = tempfile::tempdir().unwrap();
    let page = orator(&["man"], dir.path());
    assert!(page.contains(".TH orator 1") && page.contains("evaluate"), "{page}");
    orator(&["man", "pages"], dir.path());
    for page in ["orator.1", "orator-run.1", "orator-train-gan.1"] {
        let text = std::fs::read_to_string(dir.path().join("pages").join(page)).unwrap();
        assert!(text.contains(".SH SYNOPSIS"), "{page}");
    }
}
