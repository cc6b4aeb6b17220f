//! Write timeout of a connection: a client that stops reading a reply is disconnected.

use std::future::Future;
use std::io::{self, IoSlice};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};

/// Stream whose writes fail with [`io::ErrorKind::TimedOut`] after `limit` without progress. Each written byte restarts
/// the timer, so a slow client still receives its reply.
pub struct WriteTimeout {
    stream: TcpStream,
    limit: Duration,
    /// Runs while a write is pending.
    timer: Option<Pin<Box<Sleep>>>,
}

impl WriteTimeout {
    pub fn new(stream: TcpStream, limit: Duration) -> Self {
        Self { stream, limit, timer: None }
    }

    /// Returns the result of a write; a pending write fails when the timer expires.
    fn limit(&mut self, written: Poll<io::Result<usize>>, cx: &mut Context<'_>) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.timer = None;
            return written;
        }
        let limit = self.limit;
        let timer = self.timer.get_or_insert_with(|| Box::pin(sleep(limit)));
        timer.as_mut().poll(cx).map(|()| Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for WriteTimeout {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buf)
    }
}

impl AsyncWrite for WriteTimeout {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(cx, buf);
        self.limit(written, cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, bufs);
        self.limit(written, cx)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::poll_fn;
    use std::io::Read;
    use std::time::Instant;

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
}
