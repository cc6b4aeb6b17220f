//! Hostile input to `orator study serve` is rejected with the matching status, and none of it is stored.

use crate::fixtures::served_study::{Client, MadeStudy, answer, fitting};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Status of the reply to raw bytes; 0 if the connection was closed without a reply.
fn raw(address: &str, bytes: &[u8]) -> u16 {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    // A server that has already rejected the request may close the connection before all bytes are written.
    let _ = stream.write_all(bytes);
    status(&mut stream)
}

fn status(stream: &mut TcpStream) -> u16 {
    let mut reply = [0; 12];
    let read = stream.read_exact(&mut reply);
    if read.is_err() { 0 } else { std::str::from_utf8(&reply[9..]).unwrap().parse().unwrap() }
}

fn get(address: &str, target: &str) -> u16 {
    raw(address, format!("GET {target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").as_bytes())
}

fn post(address: &str, path: &str, token: &str, body: &[u8]) -> u16 {
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json\r\n\
         Authorization: Bearer {token}\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    raw(address, &[head.as_bytes(), body].concat())
}

#[test]
fn request_paths_cannot_leave_the_study() {
    let study = MadeStudy::new(1, 1, 3, 5);
    let served = study.serve(&[]);
    let film = &study.films[0];
    assert_eq!(get(&served.address, &format!("/films/{film}.mp4")), 200);
    let escapes = [
        "/secret.json",
        "/key.json",
        "/plan.json",
        "/responses.sqlite",
        "/public/films",
        "/films/",
        "/films/../../secret.json",
        "/films/..%2f..%2fsecret.json",
        "/films/..%252f..%252fsecret.json",
        "/films/%2e%2e/%2e%2e/secret.json",
        "/films/....//....//secret.json",
        "/films/..\\..\\secret.json",
        "//etc/passwd",
        "/films//etc/passwd",
        "/films/%2fetc%2fpasswd",
        "/films/0000000000000000.mp4",
        "/films/x.mp4",
        "/films/.mp4",
        "http://127.0.0.1/secret.json",
    ];
    let film_targets = [
        format!("/films/{film}"),
        format!("/films/{film}.mp4/"),
        format!("/films/{film}.mp4%00"),
        format!("/films/{film}.mp4/../../../secret.json"),
        format!("/films/{}.mp4", film.to_uppercase()),
        format!("/films/./{film}.mp4"),
        format!("/films/{film}%2emp4%20"),
    ];
    for target in escapes.into_iter().chain(film_targets.iter().map(String::as_str)) {
        assert_eq!(get(&served.address, target), 404, "{target}");
    }
    assert_eq!(get(&served.address, "/films/%ff%fe.mp4"), 400, "not UTF-8");
    assert_eq!(raw(&served.address, b"GET /\xff\xfe HTTP/1.1\r\nHost: localhost\r\n\r\n"), 400);
    for garbage in [&b"\x16\x03\x01\x02\x00\x01"[..], b"GET\r\n\r\n", b"GET / HTTP/9\r\n\r\n", b"\0\0\0\0\r\n\r\n"] {
        assert_eq!(raw(&served.address, garbage), 400);
    }
    let header = |name: &str, value: &str| format!("GET / HTTP/1.1\r\nHost: localhost\r\n{name}: {value}\r\n\r\n");
    assert_eq!(raw(&served.address, header("Cookie", &"x".repeat(100_000)).as_bytes()), 431);
    assert_eq!(raw(&served.address, header("A: b\r\n".repeat(200).trim_end(), "").as_bytes()), 431);
    assert!([414, 431].contains(&get(&served.address, &format!("/{}", "x".repeat(100_000)))));
}

/// Request bodies that no endpoint accepts.
fn invalid_bodies() -> Vec<Vec<u8>> {
    let good = answer(0, &fitting(0, true));
    let with = |key: &str, value: Value| {
        let mut body = good.clone();
        body[key] = value;
        body.to_string().into_bytes()
    };
    let mut bodies = vec![
        Vec::new(),
        b"null".to_vec(),
        b"[]".to_vec(),
        b"{".to_vec(),
        vec![b'['; 10_000],
        b"{\"a\":".repeat(3_000),
        b"{\"position\": 0, \"response\": {\"side\": \"\xff\xfe\"}}".to_vec(),
        b"\xef\xbb\xbf{}".to_vec(),
        with("unknown", json!(1)),
        with("response", json!({ "side": "left", "real": true })),
        with("response", json!({ "real": true })),
        with("response", json!({ "number": 42 })),
        with("response", json!({ "scores": vec![0; 5000] })),
        with("response", json!({ "step": 300 })),
        with("response", json!({})),
        with("plays", json!(0)),
        with("plays", json!(1e9)),
        with("position", json!(-1)),
        with("position", json!(0.5)),
        with("position", json!(4_294_967_296u64)),
    ];
    for number in ["NaN", "Infinity", "-1", "1e999", "-1e999", "86401", "\"0\"", "null", "[0]", "0x10", "1e", "01"] {
        let text = good.to_string().replace("\"stalled_secs\":0.25", &format!("\"stalled_secs\":{number}"));
        bodies.push(text.into_bytes());
    }
    for hostile in ["'; DROP TABLE answer; --", "<script>alert(1)</script>", "\u{0}", "\u{202e}", "${7*7}", "../.."] {
        for key in ["position", "response", "plays", "stalled_secs", "unfocused_secs", "response_secs"] {
            bodies.push(with(key, json!(hostile)));
        }
        bodies.push(with("response", json!({ "side": hostile })));
        bodies.push(with("response", json!({ hostile: "left" })));
    }
    bodies
}

#[test]
fn invalid_answers_are_rejected_and_not_stored() {
    let study = MadeStudy::new(5, 5, 4, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let mut bodies = invalid_bodies().into_iter().peekable();
    let mut n = 0;
    while bodies.peek().is_some() {
        // The rate limit allows a participant a hundred requests at once.
        let mut client = Client::new();
        client.begin(address, &format!("p{n}")).unwrap();
        for body in bodies.by_ref().take(90) {
            let status = post(address, "/api/answer", &client.token, &body);
            assert_eq!(status, 400, "{}", String::from_utf8_lossy(&body));
        }
        n += 1;
    }
    let mut client = Client::new();
    client.begin(address, "last").unwrap();
    let token = &client.token;
    assert_eq!(post(address, "/api/answer", token, &vec![b' '; 17_000]), 413);
    let chunked = "POST /api/answer HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n";
    let chunk = format!("4e20\r\n{}\r\n0\r\n\r\n", " ".repeat(20_000));
    assert_eq!(raw(address, format!("{chunked}Authorization: Bearer {token}\r\n\r\n{chunk}").as_bytes()), 413);
    for kind in ["text/plain", "application/x-www-form-urlencoded", "application/jsonp", ""] {
        let head = format!(
            "POST /api/begin HTTP/1.1\r\nHost: localhost\r\nContent-Type: {kind}\r\nContent-Length: 2\r\n\r\n{{}}"
        );
        assert_eq!(raw(address, head.as_bytes()), 415, "{kind}");
    }
    for (method, path) in [("GET", "/api/answer"), ("POST", "/api/state"), ("DELETE", "/api/withdraw"), ("PUT", "/")] {
        assert_eq!(
            raw(
                address,
                format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n").as_bytes()
            ),
            405
        );
    }
    assert_eq!(client.answer(address, 3, &fitting(3, true)).unwrap().0, 409, "not the current position");
    assert_eq!(client.answer(address, 4, &fitting(3, true)).unwrap().0, 409, "past the last trial");
    assert!(study.exported("votes").is_empty());
}

#[test]
fn hostile_begin_requests_and_forged_tokens_are_rejected() {
    let study = MadeStudy::new(2, 2, 4, 5);
    let served = study.serve(&[]);
    let address = &served.address;
    let good = json!({ "consent": true, "language": "en", "parameters": { "PROLIFIC_PID": "5f" } });
    let long = "x".repeat(129);
    let hostile_texts =
        ["'; DROP TABLE participant; --", "<img src=x onerror=alert(1)>", "=1+1", "\u{0}", "\u{e9}", "a b", &long];
    for hostile in hostile_texts {
        for key in ["consent", "language", "parameters"] {
            let mut body = good.clone();
            body[key] = json!(hostile);
            assert_eq!(post(address, "/api/begin", "", body.to_string().as_bytes()), 400, "{body}");
        }
        for parameters in [json!({ "PROLIFIC_PID": hostile }), json!({ hostile: "5f" }), json!({ "hitId": { "a": 1 } })]
        {
            let body = json!({ "consent": true, "language": "en", "parameters": parameters });
            assert_eq!(post(address, "/api/begin", "", body.to_string().as_bytes()), 400, "{body}");
        }
    }
    assert_eq!(
        post(address, "/api/begin", "", json!({ "consent": false, "language": "en" }).to_string().as_bytes()),
        400
    );
    assert!(study.exported("participants").is_empty());

    let (mut one, mut other) = (Client::new(), Client::new());
    one.begin(address, "one").unwrap();
    other.begin(address, "other").unwrap();
    let valid = answer(0, &fitting(0, true)).to_string();
    let (token, half) = (one.token.clone(), one.token.len() / 2);
    let mixed = format!("{}{}", &token[..half], &other.token[half..]);
    let forged = ["", "x", &token[1..], &token[..token.len() - 1], &format!("{token}x"), &mixed, &token.to_uppercase()];
    let foreign = MadeStudy::new(1, 1, 3, 5);
    let elsewhere = foreign.serve(&[]);
    let mut stranger = Client::new();
    stranger.begin(&elsewhere.address, "stranger").unwrap();
    let foreign_tokens = [stranger.token.as_str(), &served.operator_token, "\u{e9}", "a b", &"A".repeat(9000)];
    for token in forged.into_iter().chain(foreign_tokens) {
        assert_eq!(post(address, "/api/answer", token, valid.as_bytes()), 401, "{token}");
        assert_eq!(post(address, "/api/withdraw", token, b"{}"), 401, "{token}");
    }
    let without_token =
        b"POST /api/answer HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 0\r\n\r\n";
    assert_eq!(raw(address, without_token), 401);
    assert!(study.exported("votes").is_empty());
    for _ in 0..3 {
        assert_eq!(post(address, "/api/answer", &token, valid.as_bytes()), 200, "replayed");
    }
    assert_eq!(study.exported("votes").len(), 1);
    let statuses = (0..200).map(|_| one.get(address, "/api/state").unwrap().0);
    assert!(statuses.filter(|status| *status == 429).count() > 50, "requests of a participant are limited");
    assert_eq!(other.get(address, "/api/state").unwrap().0, 200, "other participants are not affected");
}

#[test]
fn slow_senders_are_disconnected() {
    let study = MadeStudy::new(1, 1, 3, 5);
    let served = study.serve(&[]);
    let started = Instant::now();
    let open = |bytes: &[u8]| {
        let mut stream = TcpStream::connect(&served.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.write_all(bytes).unwrap();
        stream
    };
    let mut silent = open(b"");
    let mut half_head = open(b"GET / HTTP/1.1\r\nHost: localhost\r\n");
    let mut half_body =
        open(b"POST /api/begin HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{");
    let trickle = half_body.try_clone().unwrap();
    let trickle = std::thread::spawn(move || {
        while (&trickle).write_all(b" ").is_ok() {
            std::thread::sleep(Duration::from_millis(300));
        }
    });
    assert_eq!(status(&mut half_body), 408);
    assert!([0, 408].contains(&status(&mut half_head)) && [0, 408].contains(&status(&mut silent)));
    trickle.join().unwrap();
    assert!(started.elapsed() < Duration::from_secs(15), "{:?}", started.elapsed());
}

#[test]
fn requests_that_name_another_host_are_misdirected() {
    let study = MadeStudy::new(1, 1, 3, 5);
    let served = study.serve(&[]);
    let reply = |address: &str, head: &str| {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(format!("{head}\r\nConnection: close\r\n\r\n").as_bytes()).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    };
    let status_of = |address: &str, host: &str| {
        let reply = reply(address, &format!("GET /api/study HTTP/1.1\r\nHost: {host}"));
        reply[9..12].parse::<u16>().unwrap()
    };
    let address = &served.address;
    for host in [address.as_str(), "localhost:8080", "127.0.0.1"] {
        assert_eq!(status_of(address, host), 200, "{host}");
    }
    for host in ["evil.example", "evil.example:8080", "study.example.org", "192.0.2.1", "127.0.0.1.evil.example", ""] {
        assert_eq!(status_of(address, host), 421, "{host}");
    }
    assert!(reply(address, "GET / HTTP/1.0")[9..].starts_with("200 "), "a health check");
    for head in [
        "GET / HTTP/1.1",
        "GET / HTTP/1.0\r\nHost: evil.example",
        "GET http://evil.example/ HTTP/1.1\r\nHost: localhost",
    ] {
        let text = reply(address, head);
        assert!(text[9..].starts_with("421 ") && text.contains("--host-name"), "{text}");
        assert!(
            text.contains("content-type: text/plain") && text.contains("x-content-type-options: nosniff"),
            "{text}"
        );
    }
    drop(served);

    let served = study.serve(&["--host-name", "study.example.org", "--host-name", "tunnel.example"]);
    for (host, status) in
        [("study.example.org.", 200), ("tunnel.example:443", 200), (&served.address, 200), ("evil.example", 421)]
    {
        assert_eq!(status_of(&served.address, host), status, "{host}");
    }
}
