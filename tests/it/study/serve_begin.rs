//! Who may begin a session of `orator study serve`, and how long it stays reserved, even if the wall clock jumps.

use crate::fixtures::clock_shim::{ClockShim, shift_clock};
use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use orator_test_support::skip::skip;
use serde_json::{Value, json};

#[test]
fn a_known_id_cannot_open_a_second_session() {
    let study = MadeStudy::new(3, 3, 4, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut own = Client::new();
    assert_eq!(own.begin(address, "p1").unwrap().0, 200);
    // Before any answer, at every attempt.
    for _ in 0..20 {
        let (status, reply) = Client::new().begin(address, "p1").unwrap();
        assert_eq!((status, &reply["reason"]), (409, &json!("known")), "{reply}");
    }
    assert_eq!(study.exported("participants").len(), 1);
    assert_eq!(own.answer(address, 0, &fitting(0, true)).unwrap().0, 200);

    let mut stranger = Client::new();
    for position in 1..4 {
        let (status, reply) = stranger.begin(address, "p1").unwrap();
        assert_eq!((status, &reply["reason"]), (409, &json!("known")), "{reply}");
        assert!(reply.get("token").is_none() && reply.get("state").is_none(), "{reply}");
        assert_eq!(stranger.post(address, "/api/withdraw", &json!({})).unwrap().0, 401);
        assert_eq!(own.answer(address, position, &fitting(position, true)).unwrap().0, 200);
    }
    let (status, reply) = stranger.begin(address, "p1").unwrap();
    assert!(status == 409 && reply.get("state").is_none(), "not after completion either: {reply}");
    assert!(own.get(address, "/api/state").unwrap().1["completion"]["code"].is_string());

    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    let mut other = Client::new();
    other.begin(address, "p2").unwrap();
    let participants = operator.get(address, "/api/operator").unwrap().1["participants"].take();
    let tokens: Vec<&Value> = participants.as_array().unwrap().iter().map(|one| &one["token"]).collect();
    let resumable: Vec<&Value> = tokens.into_iter().filter(|token| !token.is_null()).collect();
    let both = [json!(own.token), json!(other.token)];
    assert_eq!(resumable, both.iter().collect::<Vec<_>>(), "the operator has resume links, also of completed sessions");
}

#[test]
fn a_repeated_begin_request_gets_the_same_session() {
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
    let (status, reply) = begin(&served.address, &attempt(2), id.clone());
    assert_eq!((status, &reply["reason"]), (409, &json!("known")), "{reply}");
    let nameless = begin(&served.address, &attempt(3), json!({}));
    assert_eq!(begin(&served.address, &attempt(3), json!({})), nameless);
    for invalid in ["", "1", &attempt(1)[1..], &"x".repeat(32), &"A".repeat(32)] {
        assert_eq!(begin(&served.address, invalid, json!({})).0, 400, "{invalid}");
    }
    assert_eq!(served.terminate(), Some(0));
    let served = study.serve(&[]);
    assert_eq!(begin(&served.address, &attempt(1), id), first, "also after a restart of the server");
    assert_eq!(study.exported("participants").len(), 2);
}

#[test]
fn a_study_that_requires_ids_rejects_requests_without_one() {
    let study = MadeStudy::new(2, 2, 4, 5).requiring_id();
    let served = study.serve(&[]);
    let address = &served.address;
    for parameters in [json!({}), json!({ "PROLIFIC_PID": "" }), json!({ "STUDY_ID": "s", "assignmentId": "a" })] {
        let body = json!({ "consent": true, "language": "en", "parameters": parameters });
        let (status, reply) = Client::new().post(address, "/api/begin", &body).unwrap();
        assert_eq!((status, &reply["reason"]), (403, &json!("id-missing")), "{reply}");
    }
    assert!(study.exported("participants").is_empty());
    assert_eq!(Client::new().begin(address, "p1").unwrap().0, 200);
    let worker = json!({ "consent": true, "language": "en", "parameters": { "workerId": "w1" } });
    assert_eq!(Client::new().post(address, "/api/begin", &worker).unwrap().0, 200);
}

#[test]
fn wall_clock_jumps_neither_block_nor_drop_participants() {
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
        let (status, reply) = answer(&served.address, position);
        assert_eq!(status, 200, "{secs} s: {reply}");
    }
    shift_clock(&file, 86_400);
    assert_eq!(Client::new().begin(&served.address, "p2").unwrap().0, 409, "the session is still reserved");
    assert_eq!(answer(&served.address, 3).0, 200);
    assert_eq!(served.terminate(), Some(0));

    // Clock set back between two runs: time continues from the latest stored time.
    shift_clock(&file, -86_400);
    let served = serve();
    assert_eq!(answer(&served.address, 4).0, 200);
    assert_eq!(served.terminate(), Some(0));
    // A run that really starts later: the session is free after an hour.
    shift_clock(&file, 3700);
    let served = serve();
    assert_eq!(Client::new().begin(&served.address, "p2").unwrap().0, 200);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn sessions_without_answers_are_reassigned_after_minutes() {
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
    assert_eq!(
        silent.get(&served.address, "/api/state").unwrap().0,
        200,
        "while no other participant needs the session"
    );
    assert_eq!(Client::new().begin(&served.address, "later").unwrap().0, 200);
    assert_eq!(silent.get(&served.address, "/api/state").unwrap().0, 410);
    assert_eq!(study.exported("participants").len(), 2, "a session without answers is deleted");
    assert_eq!(Client::new().begin(&served.address, "last").unwrap().0, 409, "a session with answers stays reserved");
    assert_eq!(answers.answer(&served.address, 1, &fitting(1, true)).unwrap().0, 200);
    std::fs::remove_file(file).unwrap();
}
