//! A participant in a real browser while the server is killed and restarted throughout the session.

use crate::fixtures::served_study::{Client, MadeStudy};
use orator_test_support::skip::{browser_driver, skip};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

const N_TRIALS: usize = 8;

#[test]
fn a_browser_session_survives_kills_of_the_server() {
    let Some(driver) = browser_driver() else { return };
    if Command::new("chromium").arg("--version").output().is_err() {
        return skip("no browser is installed (package chromium)");
    }
    let study = MadeStudy::new(1, 1, N_TRIALS, 25);
    let answers = study.path().join("answers.json");
    fs::write(&answers, json!({ "scores": {}, "numbers": { &study.films[2]: 42 } }).to_string()).unwrap();
    let mut served = study.serve(&[]);
    let port = served.address.rsplit(':').next().unwrap().to_owned();
    let mut browser = Command::new("node");
    browser.arg("tests/it/study/browser/participant.mjs").env("ORATOR_DRIVER", driver);
    browser.args(["--url", &format!("http://{}/", served.address), "--answers"]).arg(&answers);
    let mut browser = browser.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The page is loaded once the session has begun.
    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    while operator.get(&served.address, "/api/operator").unwrap().1["quota"]["active"] != 1 {
        assert!(browser.try_wait().unwrap().is_none(), "the browser ended before the session began");
        sleep(Duration::from_millis(50));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut n_kills = 0;
    while browser.try_wait().unwrap().is_none() {
        sleep(Duration::from_millis(rng.random_range(300..2500)));
        drop(served);
        n_kills += 1;
        sleep(Duration::from_millis(rng.random_range(0..1500)));
        served = study.serve_at(&port, &[]);
    }
    let output = browser.wait_with_output().unwrap();
    assert!(output.status.success(), "{n_kills} kills: {}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["code"].as_str().map(str::len), Some(10), "{report}");
    let votes = study.exported("votes");
    let positions: BTreeSet<String> = votes.iter().map(|vote| vote["trial"].to_string()).collect();
    assert_eq!((votes.len(), positions.len()), (N_TRIALS, N_TRIALS), "{votes:?}");
    assert_eq!(study.exported("participants").len(), 1);
    assert!(n_kills > 2, "{n_kills} kills");
    eprintln!("the server was killed {n_kills} times; each of {N_TRIALS} answers is stored once");
}
