//! The page of `orator live` in headless Chromium, fed by the example of a voice agent in the guide.

use crate::fixtures::models::untrained::write_bounded_speaker;
use orator::guide::TOPICS;
use orator_test_support::skip::{browser_driver, skip};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

/// Example programs on the page `live` of the guide.
fn voice_agent() -> String {
    let page = TOPICS.iter().find(|topic| topic.name == "live").unwrap().text;
    let program = page.split("```python\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert!(program.lines().count() <= 40);
    program.to_owned()
}

/// Starts the example, and returns it with the address that it prints.
fn start(program: &Path, model: &Path) -> (Child, String) {
    let folder = Path::new(env!("CARGO_BIN_EXE_orator")).parent().unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("python3");
    command.arg(program).arg(model).env("PATH", path).stdin(Stdio::piped()).stderr(Stdio::piped());
    let mut agent = command.spawn().unwrap();
    let mut lines = BufReader::new(agent.stderr.take().unwrap()).lines().map_while(Result::ok);
    let url = lines.find_map(|line| line.strip_prefix("open ").map(str::to_owned)).expect("no address");
    thread::spawn(move || lines.for_each(|line| eprintln!("{line}")));
    (agent, url)
}

#[test]
fn a_voice_agent_gestures_in_the_page() {
    let Some(driver) = browser_driver() else { return };
    for program in ["chromium", "espeak-ng"] {
        if Command::new(program).arg("--version").output().is_err() {
            return skip(&format!("no {program} is installed"));
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let [model, program] = ["model.safetensors", "agent.py"].map(|name| dir.path().join(name));
    write_bounded_speaker(&model, 0.5);
    std::fs::write(&program, voice_agent()).unwrap();
    let (mut agent, url) = start(&program, &model);
    let mut sentences = agent.stdin.take().unwrap();
    let mut command = Command::new("node");
    command.args(["tests/it/live/browser/live.mjs", "--url", &url]).env("ORATOR_DRIVER", driver);
    let mut page = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(page.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert_eq!(lines.next().as_deref(), Some("ready"));
    for sentence in ["Hello, I am a voice agent and I talk about many things.", "A second sentence, a little later."] {
        writeln!(sentences, "{sentence}").unwrap();
        thread::sleep(Duration::from_secs(6));
    }
    drop(sentences);
    let agent = agent.wait().unwrap();
    let report = lines.next().unwrap_or_default();
    assert!(page.wait().unwrap().success() && agent.success(), "{report}");
    let report: Value = serde_json::from_str(&report).unwrap();
    eprintln!("{report}");
    assert_eq!((&report["findings"], &report["problems"]), (&json!([]), &json!([])), "{report}");
    assert!(report["drawn"].as_f64().unwrap() > 0.02 && report["pictures"].as_u64().unwrap() > 2, "{report}");
    assert_eq!(report["requests"], json!([]), "{report}");
}
