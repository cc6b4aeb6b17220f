//! `orator study serve` while its connections or its database are in use: participants are not locked out for long, and
//! rejected ones have no session.

use crate::fixtures::served_study::{Client, MadeStudy};
use orator_study::seal::StudySeal;
use rusqlite::Connection;
use serde_json::json;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Study whose first film, padded by a `free` box, exceeds the socket buffers of a connection.
fn study_with_large_film() -> MadeStudy {
    let study = MadeStudy::new(1, 1, 3, 5);
    let mut film = OpenOptions::new().append(true).open(study.folder.film(&study.films[0])).unwrap();
    let padding = 64 << 20_u32;
    film.write_all(&[&u32::to_be_bytes(padding)[..], b"free"].concat()).unwrap();
    let length = film.metadata().unwrap().len() + u64::from(padding) - 8;
    film.set_len(length).unwrap();
    StudySeal::of(&study.folder).unwrap().write(&study.folder).unwrap();
    study
}

/// Requests `path` from the loopback address 127.0.0.`peer`.
fn request(peer: u8, address: &str, path: &str) -> TcpStream {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().unwrap();
    let mut stream = runtime.block_on(async {
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddr::from(([127, 0, 0, peer], 0))).unwrap();
        socket.connect(address.parse().unwrap()).await.unwrap().into_std().unwrap()
    });
    stream.set_nonblocking(false).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    // A server that rejects the connection may close it first.
    let _ = stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes());
    stream
}

/// Status of the reply; 0 if the connection ended without a reply.
fn status(mut stream: &TcpStream) -> u16 {
    let mut reply = [0; 12];
    let read = stream.read_exact(&mut reply);
    if read.is_err() { 0 } else { std::str::from_utf8(&reply[9..]).unwrap().parse().unwrap() }
}

#[test]
fn connections_that_do_not_read_do_not_block_others() {
    // A process limited to 192 open files accepts 64 connections, 16 per peer.
    let study = study_with_large_film();
    let film = format!("/films/{}.mp4", study.films[0]);
    let served = study.serve_with_files(192, &[]);
    let films = |peer| (0..16).map(|_| request(peer, &served.address, &film)).collect::<Vec<_>>();
    let started = Instant::now();
    let first = films(1);
    assert!(first.iter().all(|stream| status(stream) == 200));
    let beyond = status(&request(1, &served.address, "/api/study"));
    assert!([0, 503].contains(&beyond), "connection 17 of a peer: {beyond}");
    assert_eq!(status(&request(6, &served.address, "/api/study")), 200, "other peers can connect");

    let others: Vec<TcpStream> = (2..5).flat_map(films).collect();
    assert!(others.iter().all(|stream| status(stream) == 200));
    assert_eq!(status(&request(5, &served.address, "/api/study")), 200, "once the unread films have timed out");
    let secs = started.elapsed().as_secs_f64();
    assert!((25.0..50.0).contains(&secs), "all connections were free again after {secs} s");
    drop((first, others));
    drop(served);

    let served = study.serve_with_files(192, &["--host-name", "study.example.org"]);
    let proxied = (0..20).map(|_| request(1, &served.address, &film)).collect::<Vec<_>>();
    assert!(proxied.iter().all(|stream| status(stream) == 200), "loopback addresses are those of a proxy");
}

#[test]
fn a_locked_database_rejects_in_time_and_assigns_no_session() {
    let study = MadeStudy::new(9, 9, 3, 5);
    let served = study.serve(&[]);
    let other = Connection::open(study.folder.responses()).unwrap();
    other.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let started = Instant::now();
    std::thread::scope(|scope| {
        let begins = [(); 6].map(|()| {
            scope.spawn(|| {
                let url = format!("http://{}/api/begin", served.address);
                let body = json!({ "consent": true, "language": "en" }).to_string();
                let reply =
                    Client::new().agent.post(url).header("Content-Type", "application/json").send(body).unwrap();
                (reply.status().as_u16(), reply.headers().contains_key("Retry-After"))
            })
        });
        for begin in begins {
            assert_eq!(begin.join().unwrap(), (503, true));
        }
    });
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
    other.execute_batch("ROLLBACK").unwrap();
    drop(other);
    assert_eq!(Client::new().begin(&served.address, "later").unwrap().0, 200);
    let places: Vec<_> = study.exported("participants").into_iter().map(|row| row["place"].clone()).collect();
    assert_eq!(places, [json!(1)], "a rejected request assigns no session");
}
