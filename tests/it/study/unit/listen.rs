//! Unit tests of `orator_web::listen`.

use orator_web::listen::WriteTimeout;
use std::future::poll_fn;
use std::io;
use std::io::Read;
use std::pin::Pin;
use std::time::{Duration, Instant};
use tokio::io::AsyncWrite as _;

const LIMIT: Duration = Duration::from_secs(1);

/// Writes to a client that reads 8 MiB `n_reads` times at intervals of half the limit and then stops. Returns the
/// error and the seconds until it occurred.
fn write_to_reader(n_reads: u32) -> (io::ErrorKind, f64) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mut client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut stream = WriteTimeout::new(listener.accept().await.unwrap().0, LIMIT);
        let begun = Instant::now();
        let reader = std::thread::spawn(move || {
            for _ in 0..n_reads {
                std::thread::sleep(LIMIT / 2);
                client.read_exact(&mut vec![0; 8 << 20]).unwrap();
            }
            std::thread::sleep(3 * LIMIT);
        });
        let error = loop {
            if let Err(error) = poll_fn(|cx| Pin::new(&mut stream).poll_write(cx, &[0; 1 << 16])).await {
                break error;
            }
        };
        let secs = begun.elapsed().as_secs_f64();
        reader.join().unwrap();
        (error.kind(), secs)
    })
}

#[test]
fn only_a_write_without_progress_times_out() {
    let (kind, secs) = write_to_reader(0);
    assert_eq!(kind, io::ErrorKind::TimedOut);
    assert!((0.9..2.0).contains(&secs), "{secs} s");
    let (kind, secs) = write_to_reader(3);
    assert_eq!(kind, io::ErrorKind::TimedOut);
    assert!(secs > 2.4, "{secs} s: the last read at 1.5 s, then 1 s without one");
}
