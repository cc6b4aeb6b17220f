//! Who may begin in `orator study serve`, and how long a place is held, whatever the wall clock does meanwhile.

use crate::fixtures::clock_shim::{ClockShim, shift_clock};
use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use orator_test_support::skip::skip;
use serde_json::{Value, json};

#[test]
fn a_known_id_opens_no_session() {
    let study = MadeStudy::new(3, 3, 4, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut own = Client::new();
    assert_eq!(own.begin(address, "p1").unwrap().0, 200);
    // Before any answer, and as often as somebody likes.
    for _ in 0..20 {
        let (status, said) = Client::new().begin(address, "p1").unwrap();
        assert_eq!((status, &said["reason"]), (409, &json!("known")), "{said}");
    }
    assert_eq!(study.exported("participants").len(), 1);
    assert_eq!(own.answer(address, 0, &fitting(0, true)).unwrap().0, 200);

    let mut stranger = Client::new();
    for position in 1..4 {
        let (status, said) = stranger.begin(address, "p1").unwrap();
        assert_eq!((status, &said["reason"]), (409, &json!("known")), "{said}");
        assert!(said.get("token").is_none() && said.get("state").is_none(), "{said}");
        assert_eq!(stranger.post(address, "/api/withdraw", &json!({})).unwrap().0, 401);
        assert_eq!(own.answer(address, position, &fitting(position, true)).unwrap().0, 200);
    }
    let (status, said) = stranger.begin(address, "p1").unwrap();
    assert!(status == 409 && said.get("state").is_none(), "nor when it is completed: {said}");
    assert!(own.get(address, "/api/state").unwrap().1["completion"]["code"].is_string());

    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    let mut other = Client::new();
    other.begin(address, "p2").unwrap();
    let people = operator.get(address, "/api/operator").unwrap().1["participants"].take();
    let tokens: Vec<&Value> = people.as_array().unwrap().iter().map(|one| &one["token"]).collect();
    let resumable: Vec<&Value> = tokens.into_iter().filter(|token| !token.is_null()).collect();
    let both = [json!(own.token), json!(other.token)];
    assert_eq!(resumable, both.iter().collect::<Vec<_>>(), "the operator can give a link, also to the completion code");
}

#[test]
fn a_repeated_attempt_to_begin_gets_the_same_session() {
    let study = MadeStudy::new(3, 3, 4, 5);
    let attempt = |k: u32| format!("{k:032x}");
    let begin = |address: &str, attempt: &str, parameters: Value| {
        let body = json!({ "consent": true, "language": "en", "parameters": parameters, "attempt": attempt });
        Client::new().post(address, "/api/begin", &body).unwrap()
    };
    let served = study.serve(&[]);
    let id = json!({ "PROLIFIC_PID": "p1" });
    let first = begin(&served.address, &attempt(1), id.clone());
    assert_eq!(first.0, 200, "{}", first.1);
    assert_eq!(begin(&served.address, &attempt(1), id.clone()), first);
    let (status, said) = begin(&served.address, &attempt(2), id.clone());
    assert_eq!((status, &said["reason"]), (409, &json!("known")), "{said}");
    let nameless = begin(&served.address, &attempt(3), json!({}));
    assert_eq!(begin(&served.address, &attempt(3), json!({})), nameless);
    for wrong in ["", "1", &attempt(1)[1..], &"x".repeat(32), &"A".repeat(32)] {
        assert_eq!(begin(&served.address, wrong, json!({})).0, 400, "{wrong}");
    }
    assert_eq!(served.terminate(), Some(0));
    let served = study.serve(&[]);
    assert_eq!(begin(&served.address, &attempt(1), id), first, "also of another server");
    assert_eq!(study.exported("participants").len(), 2);
}

#[test]
fn a_study_for_recruited_participants_takes_nobody_without_an_id() {
    let study = MadeStudy::new(2, 2, 4, 5).requiring_id();
    let served = study.serve(&[]);
    let address = &served.address;
    for parameters in [json!({}), json!({ "PROLIFIC_PID": "" }), json!({ "STUDY_ID": "s", "assignmentId": "a" })] {
        let body = json!({ "consent": true, "language": "en", "parameters": parameters });
        let (status, said) = Client::new().post(address, "/api/begin", &body).unwrap();
        assert_eq!((status, &said["reason"]), (403, &json!("id-missing")), "{said}");
    }
    assert!(study.exported("participants").is_empty());
    assert_eq!(Client::new().begin(address, "p1").unwrap().0, 200);
    let worker = json!({ "consent": true, "language": "en", "parameters": { "workerId": "w1" } });
    assert_eq!(Client::new().post(address, "/api/begin", &worker).unwrap().0, 200);
}

#[test]
fn a_wall_clock_that_jumps_blocks_and_drops_nobody() {
    let Some(shim) = ClockShim::build() else { return skip("no C compiler") };
    let study = MadeStudy::new(1, 1, 6, 5);
    let file = study.path().with_extension("clock");
    let serve = || study.serve_by(shim.program(&file), "0", &[]);
    shift_clock(&file, 0);
    let served = serve();
    let mut client = Client::new();
    assert_eq!(client.begin(&served.address, "p1").unwrap().0, 200);
    let answer = |address: &str, position: usize| client.answer(address, position, &fitting(position, true)).unwrap();
    for (position, secs) in [-3600, 0, 7200].into_iter().enumerate() {
        shift_clock(&file, secs);
        let (status, said) = answer(&served.address, position);
        assert_eq!(status, 200, "{secs} s: {said}");
    }
    shift_clock(&file, 86_400);
    assert_eq!(Client::new().begin(&served.address, "p2").unwrap().0, 409, "the place is not free");
    assert_eq!(answer(&served.address, 3).0, 200);
    assert_eq!(served.terminate(), Some(0));

    // Set back between two runs: the time goes on from the latest that is stored.
    shift_clock(&file, -86_400);
    let served = serve();
    assert_eq!(answer(&served.address, 4).0, 200);
    assert_eq!(served.terminate(), Some(0));
    // A run that begins later in truth: the place is free after an hour.
    shift_clock(&file, 3700);
    let served = serve();
    assert_eq!(Client::new().begin(&served.address, "p2").unwrap().0, 200);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn sessions_without_an_answer_are_given_again_after_minutes() {
    let Some(shim) = ClockShim::build() else { return skip("no C compiler") };
    let study = MadeStudy::new(2, 2, 4, 5);
    let file = study.path().with_extension("clock");
    let serve = || study.serve_by(shim.program(&file), "0", &[]);
    shift_clock(&file, 0);
    let served = serve();
    let (mut silent, mut answers) = (Client::new(), Client::new());
    assert_eq!(silent.begin(&served.address, "silent").unwrap().0, 200);
    assert_eq!(answers.begin(&served.address, "answers").unwrap().0, 200);
    assert_eq!(answers.answer(&served.address, 0, &fitting(0, true)).unwrap().0, 200);
    assert_eq!(served.terminate(), Some(0));
    shift_clock(&file, 400);
    let served = serve();
    assert_eq!(silent.get(&served.address, "/api/state").unwrap().0, 200, "while nobody wants the place");
    assert_eq!(Client::new().begin(&served.address, "later").unwrap().0, 200);
    assert_eq!(silent.get(&served.address, "/api/state").unwrap().0, 410);
    assert_eq!(study.exported("participants").len(), 2, "nothing is kept of a session without an answer");
    assert_eq!(Client::new().begin(&served.address, "last").unwrap().0, 409, "who has answered keeps the place");
    assert_eq!(answers.answer(&served.address, 1, &fitting(1, true)).unwrap().0, 200);
    std::fs::remove_file(file).unwrap();
}
