//! `orator study serve` and `export`: a complete session, resumption, quotas, withdrawal, films.

use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use orator_study::analyse::result::StatisticSettings;
use orator_study::analyse::votes::columns::ColumnNames;
use orator_study::analyse::votes::read::VotesRead;
use orator_study::analyse::{Registration, analyse};
use orator_study::file::StudyFile;
use serde_json::{Value, json};
use std::fs;
use std::process::Command;
use std::time::Duration;

#[test]
fn a_session_leads_from_consent_to_code_and_exported_tables() {
    let study = MadeStudy::new(2, 2, 4, 20);
    let served = study.serve(&[]);
    let address = served.address.clone();
    let mut client = Client::new();
    let (status, about) = client.get(&address, "/api/study").unwrap();
    assert_eq!((status, &about["title"], &about["n_trials"]), (200, &json!("A made-up study"), &json!(4)));
    let without = MadeStudy::new(1, 1, 1, 5);
    let (_, other) = client.get(&without.serve(&[]).address, "/api/study").unwrap();
    assert_eq!(
        (&about["has_checks"], &other["has_checks"]),
        (&json!(true), &json!(false)),
        "named in the instructions"
    );
    let (status, reply) = client.begin(&address, "p1").unwrap();
    assert_eq!((status, &reply["state"]["position"]), (200, &json!(0)), "{reply}");
    assert_eq!(reply["state"]["trial"], json!({ "task": 0, "phase": "training", "films": study.films[..2] }));

    let (status, reply) = client.answer(&address, 0, &fitting(0, true)).unwrap();
    assert_eq!(status, 425, "before the films of 0.8 s can have ended: {reply}");
    std::thread::sleep(Duration::from_millis(800));
    let (status, reply) = client.answer(&address, 0, &fitting(0, false)).unwrap();
    assert_eq!((status, &reply["feedback"], &reply["state"]["position"]), (200, &json!({ "side": "left" }), &json!(1)));
    let again = client.answer(&address, 0, &fitting(0, false)).unwrap();
    assert_eq!(again, (200, reply), "the same answer is acknowledged again");
    assert_eq!(client.answer(&address, 0, &fitting(0, true)).unwrap().0, 409, "a different answer is rejected");
    assert_eq!(client.answer(&address, 2, &fitting(2, true)).unwrap().0, 409, "so is one to a later trial");
    assert_eq!(served.terminate(), Some(0));

    let served = study.serve(&[]);
    let address = served.address.clone();
    let (status, state) = client.get(&address, "/api/state").unwrap();
    assert_eq!((status, &state["position"]), (200, &json!(1)), "the token is valid after a restart of the server");
    for position in 1..4 {
        std::thread::sleep(Duration::from_millis(800));
        let (status, reply) = client.answer(&address, position, &fitting(position, true)).unwrap();
        assert_eq!((status, reply.get("feedback")), (200, None), "{reply}");
    }
    let (_, state) = client.get(&address, "/api/state").unwrap();
    let code = state["completion"]["code"].as_str().unwrap();
    assert!(code.len() == 10 && state.get("trial").is_none(), "{state}");

    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    let (status, progress) = operator.get(&address, "/api/operator").unwrap();
    assert_eq!((status, &progress["answers"]), (200, &json!(4)));
    assert_eq!((&progress["quota"]["completed"], &progress["quota"]["target"]), (&json!(1), &json!(2)));
    assert_eq!(client.get(&address, "/api/operator").unwrap().0, 401);
    assert_eq!(operator.get(&address, "/api/state").unwrap().0, 401);

    let votes = study.exported("votes");
    let expected: Vec<Value> = vec![json!({ "side": "left" }), json!({ "number": 42 }), json!({ "side": "left" })];
    assert_eq!(votes.iter().map(|vote| vote["expected"].clone()).take(3).collect::<Vec<_>>(), expected);
    assert_eq!((&votes[2]["trial"], &votes[2]["clip"]), (&json!(3), &json!("ellen/2")));
    assert_eq!((&votes[2]["conditions"], &votes[3]["completed"]), (&json!(["real", "model"]), &json!(true)));
    let participants = study.exported("participants");
    assert_eq!(
        (participants.len(), &participants[0]["PROLIFIC_PID"], &participants[0]["code"]),
        (1, &json!("p1"), &json!(code))
    );
    study.export("csv");
    let table = fs::read_to_string(study.path().join("export/votes.csv")).unwrap();
    let row = table.lines().nth(2).unwrap();
    assert!(row.ends_with(",ellen/1,ellen,real|model,42,42,0.25,0,1.5,1,0,true"), "{row}");
    assert!(table.starts_with("participant,task,design,phase,trial,clip,"), "{table}");
}

/// A trial is excluded if the page was reloaded after its films began, and not if it was reloaded before.
#[test]
fn a_film_reloaded_after_it_began_excludes_its_trial() {
    let study = MadeStudy::new(1, 1, 6, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut client = Client::new();
    assert_eq!(client.begin(address, "p1").unwrap().0, 200);
    let load = |k: u32| format!("{k:032x}");
    let start = |position: usize, load: &str| {
        client.post(address, "/api/start", &json!({ "position": position, "load": load })).unwrap().0
    };
    for invalid in ["", "1", &load(1)[1..], &"x".repeat(32)] {
        assert_eq!(start(0, invalid), 400, "{invalid}");
    }
    assert_eq!(Client::new().post(address, "/api/start", &json!({ "position": 0, "load": load(1) })).unwrap().0, 401);
    // Loads of the page in which the films of each trial began. Repeated requests and other trials do not count.
    let loads: [&[u32]; 6] = [&[1], &[1], &[1, 2], &[3, 3], &[], &[4, 5, 6]];
    for (position, loads) in loads.into_iter().enumerate() {
        for k in loads {
            assert_eq!((start(position, &load(*k)), start(position + 1, &load(90))), (200, 200));
        }
        assert_eq!(client.answer(address, position, &fitting(position, true)).unwrap().0, 200);
        assert_eq!(start(position, &load(91)), 200, "too late");
    }
    let reloads: Vec<Value> = study.exported("votes").iter().map(|vote| vote["reloads"].clone()).collect();
    assert_eq!(reloads, [0, 0, 1, 0, 0, 2].map(|n| json!(n)));

    let read = VotesRead::of_file(&study.path().join("export/votes.jsonl"), &ColumnNames::default(), None).unwrap();
    let file = StudyFile::read(&study.folder.study_file()).unwrap();
    let registration = Registration {
        title: file.title.clone(),
        seal: None,
        notes: Vec::new(),
        hypotheses: Vec::new(),
        exclusion: file.exclusion.clone(),
        settings: file.analysis.clone(),
    };
    let settings = StatisticSettings { n_draws: 0, with_models: false, ..StatisticSettings::default() };
    let analysis = analyse(["A study", "votes.jsonl"], &read, Some(&registration), &settings).unwrap();
    assert_eq!((analysis.exclusions.n_votes, analysis.exclusions.n_votes_analysed), (4, 2));
    let rule = analysis.exclusions.rules.iter().find(|rule| rule.rule == "trial: page reloaded after a film began");
    assert_eq!(rule.map(|rule| (rule.n_votes, rule.unknown.clone())), Some((2, None)));
}

#[test]
fn sessions_are_assigned_in_order_and_reassigned_after_withdrawal() {
    let study = MadeStudy::new(3, 2, 3, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut clients = [(); 3].map(|()| Client::new());
    assert_eq!(clients[0].begin(address, "a").unwrap().0, 200);
    assert_eq!(clients[1].begin(address, "b").unwrap().0, 200);
    assert_eq!(clients[2].begin(address, "c").unwrap().0, 409, "the quota is two");
    assert_eq!(clients[0].post(address, "/api/withdraw", &json!({})).unwrap().0, 200);
    assert_eq!(clients[2].begin(address, "c").unwrap().0, 200, "a session is free again");
    let places: Vec<Value> = study.exported("participants").into_iter().map(|mut row| row["place"].take()).collect();
    assert_eq!(places, [json!(2), json!(1)], "in the order of arrival");
    // Participants who fail the attention check do not count towards the quota.
    for position in 0..3 {
        assert_eq!(clients[1].answer(address, position, &fitting(position, false)).unwrap().0, 200);
    }
    assert_eq!(Client::new().begin(address, "b").unwrap().0, 409, "no id takes part twice");
    assert_eq!(study.exported("participants").len(), 2);
    let mut fourth = Client::new();
    assert_eq!(fourth.begin(address, "d").unwrap().0, 200);
    drop(served);

    let served = study.serve(&["--abandoned-after", "0"]);
    let mut fifth = Client::new();
    assert_eq!(fifth.begin(&served.address, "e").unwrap().0, 200, "an abandoned session");
    assert_eq!(clients[2].get(&served.address, "/api/state").unwrap().0, 410, "was reassigned");
    assert_eq!(clients[2].answer(&served.address, 0, &fitting(0, true)).unwrap().0, 410);
    assert_eq!(Client::new().begin(&served.address, "c").unwrap().0, 200, "a replaced participant may begin again");
    let operator = Client { token: served.operator_token.clone(), ..Client::new() };
    let quota = operator.get(&served.address, "/api/operator").unwrap().1["quota"].clone();
    assert_eq!((&quota["excluded"], &quota["withdrawn"], &quota["replaced"]), (&json!(1), &json!(1), &json!(0)));
}

#[test]
fn a_withdrawal_removes_every_stored_byte() {
    let study = MadeStudy::new(60, 60, 12, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut leaver = Client::new();
    for k in 0..40 {
        let mut client = if k == 20 { std::mem::replace(&mut leaver, Client::new()) } else { Client::new() };
        client.begin(address, &format!("pid-of-participant-{k:03}")).unwrap();
        for position in 0..12 {
            assert_eq!(client.answer(address, position, &fitting(position, k % 2 == 0)).unwrap().0, 200);
        }
        if k == 20 {
            leaver = client;
        }
    }
    let participants = study.exported("participants");
    let of_leaver = participants.iter().find(|row| row["PROLIFIC_PID"] == "pid-of-participant-020").unwrap();
    let traces = ["participant", "code", "PROLIFIC_PID"].map(|key| of_leaver[key].as_str().unwrap().to_owned());
    let files = || fs::read_dir(study.path()).unwrap().map(|entry| entry.unwrap().path());
    let is_store = |path: &std::path::Path| path.to_str().unwrap().contains("responses.sqlite");
    let is_stored = |trace: &str| {
        let mut bytes = files().filter(|path| is_store(path)).map(|path| fs::read(path).unwrap());
        bytes.any(|bytes| bytes.windows(trace.len()).any(|window| window == trace.as_bytes()))
    };
    assert!(traces.iter().all(|trace| is_stored(trace)));
    assert_eq!(leaver.post(address, "/api/withdraw", &json!({})).unwrap().0, 200);
    for trace in &traces {
        assert!(!is_stored(trace), "{trace} is still in the database or its log");
    }
    assert!(is_stored("pid-of-participant-021"), "other participants stay");
    assert_eq!(leaver.get(address, "/api/state").unwrap().0, 410);
    assert_eq!(leaver.post(address, "/api/withdraw", &json!({})).unwrap().0, 410);
    assert_eq!(leaver.answer(address, 0, &fitting(0, true)).unwrap().0, 410);
    assert_eq!(study.exported("votes").len(), 39 * 12);
}

#[test]
fn a_changed_study_is_not_served() {
    let study = MadeStudy::new(1, 1, 2, 5);
    fs::write(study.folder.film(&study.films[1]), "another").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.args(["study", "serve", "--port", "0"]).arg(study.path()).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && text.contains(&study.films[1]), "{text}");
}

#[test]
fn films_are_served_complete_in_ranges_and_by_head() {
    let study = MadeStudy::new(1, 1, 2, 5);
    let served = study.serve(&[]);
    let bytes = fs::read(study.folder.film(&study.films[0])).unwrap();
    let url = format!("http://{}/films/{}.mp4", served.address, study.films[0]);
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).proxy(None).build().into();
    let get = |range: &str| {
        let mut reply = agent.get(&url).header("Range", range).call().unwrap();
        let header = |name: &str| reply.headers().get(name).map_or("", |value| value.to_str().unwrap()).to_owned();
        let (status, range, cache) = (reply.status().as_u16(), header("content-range"), header("cache-control"));
        (status, range, cache, reply.body_mut().read_to_vec().unwrap())
    };
    let size = bytes.len();
    let forever = "public, max-age=31536000, immutable";
    assert_eq!(get("none"), (200, String::new(), forever.to_owned(), bytes.clone()));
    assert_eq!(get("bytes=10-19"), (206, format!("bytes 10-19/{size}"), forever.to_owned(), bytes[10..20].to_vec()));
    let (status, range, _, last) = get("bytes=-7");
    assert_eq!(
        (status, range, &last[..]),
        (206, format!("bytes {}-{}/{size}", size - 7, size - 1), &bytes[size - 7..])
    );
    let (status, range, ..) = get(&format!("bytes={size}-"));
    assert_eq!((status, range), (416, format!("bytes */{size}")));
    let head = agent.head(&url).call().unwrap();
    let header = |name: &str| head.headers().get(name).map_or("", |value| value.to_str().unwrap());
    assert_eq!((head.status().as_u16(), header("content-length")), (200, &*size.to_string()));
    assert_eq!((header("content-type"), header("accept-ranges")), ("video/mp4", "bytes"));
    assert_eq!((header("x-content-type-options"), header("referrer-policy")), ("nosniff", "no-referrer"));
    assert!(header("content-security-policy").starts_with("default-src 'none'; script-src 'self';"));
}
