//! `orator study serve` with many concurrent participants: killed repeatedly and under load, it loses and duplicates no
//! acknowledged answer. `ORATOR_KILLS` sets the number of kills (default: 50).

use crate::fixtures::served_study::{Client, MadeStudy, fitting};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Responses by recruiting id and number of the trial, from 1.
type Answers = BTreeMap<(String, u64), Value>;

/// Exported answers; panics on a duplicate.
fn stored(study: &MadeStudy) -> Answers {
    let names = study.exported("participants").into_iter();
    let names: BTreeMap<String, String> = names
        .map(|row| (row["participant"].as_str().unwrap().to_owned(), row["PROLIFIC_PID"].as_str().unwrap().to_owned()))
        .collect();
    let mut answers = Answers::new();
    for vote in study.exported("votes") {
        let participant = names[vote["participant"].as_str().unwrap()].clone();
        let former = answers.insert((participant, vote["trial"].as_u64().unwrap()), vote["response"].clone());
        assert!(former.is_none(), "duplicate answer: {vote}");
    }
    answers
}

#[test]
fn a_killed_server_loses_no_acknowledged_answer() {
    const TRIALS: usize = 12;
    let n_kills: u32 = std::env::var("ORATOR_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(50);
    let study = MadeStudy::new(3000, 3000, TRIALS, 5);
    let acknowledged = Mutex::new(Answers::new());
    let address = Mutex::new(String::new());
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for thread in 0..8 {
            let (acknowledged, address, is_over) = (&acknowledged, &address, &is_over);
            scope.spawn(move || {
                for session in 0.. {
                    let (mut client, pid) = (Client::new(), format!("t{thread}s{session}"));
                    let current = || address.lock().unwrap().clone();
                    let session_reply = client.begin(&current(), &pid).filter(|(status, _)| *status == 200);
                    let mut position = if session_reply.is_some() { 0 } else { TRIALS };
                    while position < TRIALS && !is_over.load(Ordering::Relaxed) {
                        let response = fitting(position, (thread + session + position) % 2 == 0);
                        match client.answer(&current(), position, &response) {
                            Some((200, _)) => {
                                position += 1;
                                acknowledged.lock().unwrap().insert((pid.clone(), position as u64), response);
                            }
                            Some((status, reply)) => assert!([429, 503].contains(&status), "{status} {reply}"),
                            // The server was killed; the answer is sent again to the next one.
                            None => std::thread::sleep(Duration::from_millis(5)),
                        }
                    }
                    if session_reply.is_none() {
                        std::thread::sleep(Duration::from_millis(5));
                    }
                    if is_over.load(Ordering::Relaxed) {
                        return;
                    }
                }
            });
        }
        let mut random = 0x9e37_79b9_7f4a_7c15_u64;
        for _ in 0..n_kills {
            let mut served = study.serve(&[]);
            address.lock().unwrap().clone_from(&served.address);
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            std::thread::sleep(Duration::from_millis(20 + (random >> 33) % 150));
            served.process.kill().unwrap();
        }
        is_over.store(true, Ordering::Relaxed);
    });
    let (acknowledged, stored) = (acknowledged.into_inner().unwrap(), stored(&study));
    for (answer, response) in &acknowledged {
        assert_eq!(stored.get(answer), Some(response), "{answer:?} was acknowledged");
    }
    assert!(acknowledged.len() > 8 * TRIALS, "only {} answers were acknowledged", acknowledged.len());
    eprintln!("{n_kills} kills; {} answers acknowledged, {} stored", acknowledged.len(), stored.len());
}

#[test]
fn two_hundred_concurrent_participants_lose_and_duplicate_no_answer() {
    const N_PARTICIPANTS: usize = 200;
    const TRIALS: usize = 10;
    let study = MadeStudy::new(N_PARTICIPANTS, N_PARTICIPANTS, TRIALS, 5);
    let served = study.serve(&[]);
    let times = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for participant in 0..N_PARTICIPANTS {
            let (address, times) = (&served.address, &times);
            scope.spawn(move || {
                let mut client = Client::new();
                assert_eq!(client.begin(address, &format!("p{participant}")).unwrap().0, 200);
                for position in 0..TRIALS {
                    let started = Instant::now();
                    assert_eq!(
                        client.answer(address, position, &fitting(position, participant % 3 == 0)).unwrap().0,
                        200
                    );
                    times.lock().unwrap().push(started.elapsed());
                }
            });
        }
    });
    let stored = stored(&study);
    assert_eq!(stored.len(), N_PARTICIPANTS * TRIALS);
    for ((id, trial), response) in &stored {
        let participant: usize = id[1..].parse().unwrap();
        assert_eq!(*response, fitting(*trial as usize - 1, participant.is_multiple_of(3)));
    }
    let mut times = times.into_inner().unwrap();
    times.sort();
    eprintln!(
        "{} answers of {N_PARTICIPANTS} participants at once: median {:?}, 99 % within {:?}",
        times.len(),
        times[times.len() / 2],
        times[times.len() * 99 / 100]
    );
}
