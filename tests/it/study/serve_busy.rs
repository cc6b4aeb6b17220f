//! `orator study serve` while its connections or its database are held by others: nobody is shut out for long, and who was
//! refused has no place in the study.

use crate::fixtures::served_study::{Client, MadeStudy};
use orator_study::seal::StudySeal;
use rusqlite::Connection;
use serde_json::json;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Study whose first film, padded by a box `free`, exceeds what the sockets of a connection buffer.
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

/// Asks for `path` from the loopback address 127.0.0.`peer`.
fn request(peer: u8, address: &str, path: &str) -> TcpStream {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().unwrap();
    let mut stream = runtime.block_on(async {
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddr::from(([127, 0, 0, peer], 0))).unwrap();
        socket.connect(address.parse().unwrap()).await.unwrap().into_std().unwrap()
    });
    stream.set_nonblocking(false).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    // A server that refuses the connection may close it before.
    let _ = stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes());
    stream
}

/// Status of the reply; 0: the connection ended without one.
fn status(mut stream: &TcpStream) -> u16 {
    let mut reply = [0; 12];
    let read = stream.read_exact(&mut reply);
    if read.is_err() { 0 } else { std::str::from_utf8(&reply[9..]).unwrap().parse().unwrap() }
}

#[test]
fn connections_that_read_nothing_shut_nobody_out() {
    // A process of 192 files takes 64 connections, 16 of each peer.
    let study = study_with_large_film();
    let film = format!("/films/{}.mp4", study.films[0]);
    let served = study.serve_with_files(192, &[]);
    let films = |peer| (0..16).map(|_| request(peer, &served.address, &film)).collect::<Vec<_>>();
    let begun = Instant::now();
    let first = films(1);
    assert!(first.iter().all(|stream| status(stream) == 200));
    let beyond = status(&request(1, &served.address, "/api/study"));
    assert!([0, 503].contains(&beyond), "connection 17 of a peer: {beyond}");
    assert_eq!(status(&request(6, &served.address, "/api/study")), 200, "other peers have room");

    let others: Vec<TcpStream> = (2..5).flat_map(films).collect();
    assert!(others.iter().all(|stream| status(stream) == 200));
    assert_eq!(status(&request(5, &served.address, "/api/study")), 200, "once films that are not read have ended");
    let secs = begun.elapsed().as_secs_f64();
    assert!((25.0..50.0).contains(&secs), "all connections were free again after {secs} s");
    drop((first, others));
    drop(served);

    let served = study.serve_with_files(192, &["--host-name", "study.example.org"]);
    let proxied = (0..20).map(|_| request(1, &served.address, &film)).collect::<Vec<_>>();
    assert!(proxied.iter().all(|stream| status(stream) == 200), "loopback addresses are those of a proxy");
}

#[test]
fn a_locked_database_refuses_in_time_and_gives_no_place_away() {
    let study = MadeStudy::new(9, 9, 3, 5);
    let served = study.serve(&[]);
    let other = Connection::open(study.folder.responses()).unwrap();
    other.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let begun = Instant::now();
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
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    other.execute_batch("ROLLBACK").unwrap();
    drop(other);
    assert_eq!(Client::new().begin(&served.address, "later").unwrap().0, 200);
    let places: Vec<_> = study.exported("participants").into_iter().map(|row| row["place"].clone()).collect();
    assert_eq!(places, [json!(1)], "who was refused has taken no place");
}
