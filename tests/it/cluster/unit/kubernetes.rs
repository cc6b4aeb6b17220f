//! Tests of `orator_cluster::kubernetes`.

use orator_cluster::kubernetes::sigterm_forwarding_script;
use rustix::process::{Pid, Signal, kill_process};
use std::process::Command;
use std::time::Duration;

#[test]
fn a_worker_receives_the_sigterm_of_its_pod() {
    let code = |worker: &str, signal: Option<Signal>| {
        let mut pod =
            Command::new("/bin/sh").args(["-c", &sigterm_forwarding_script(worker).join("\n")]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(300));
        signal.iter().for_each(|signal| kill_process(Pid::from_child(&pod), *signal).unwrap());
        pod.wait().unwrap().code()
    };
    let traps_term = |code: u8| format!("sh -c 'trap \"sleep 0.2; exit {code}\" TERM; while :; do sleep 0.05; done'");
    assert_eq!([0, 2, 1].map(|n| code(&traps_term(n), Some(Signal::TERM))), [Some(0), Some(0), Some(1)]);
    assert_eq!([0, 2, 3].map(|n| code(&format!("sh -c 'exit {n}'"), None)), [Some(0), Some(0), Some(1)]);
}
