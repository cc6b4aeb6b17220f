//! Connections: limits their number and duration, disconnects clients that stop reading, and shuts all down at the end.

use super::peers::PeerLimit;
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rustix::process::{Resource, getrlimit, setrlimit};
use std::future::Future;
use std::io::{self, IoSlice, Write};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{Sleep, sleep, timeout};

/// Maximum number of simultaneous connections, if the limit on open files permits.
const MAX_CONNECTIONS: usize = 2048;
/// Minimum limit per peer: browsers open up to six connections.
const MIN_PER_PEER: usize = 8;
/// Reply to a connection above the limit of its peer.
const TOO_MANY: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 10\r\nConnection: close\r\n\r\n";
/// Time limit for receiving the head of a request; also closes idle connections.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum size of a request head in bytes, and of the number of its headers.
const MAX_HEAD_BYTES: usize = 16 * 1024;
const MAX_HEADERS: usize = 64;
/// Time without write progress after which a connection is closed.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// Time after which a connection accepts no further request.
const MAX_CONNECTION_TIME: Duration = Duration::from_secs(600);
/// Time that a reply in progress has left when its connection or the server shuts down.
const GRACE_PERIOD: Duration = Duration::from_secs(5);

/// Serves `router` until `stop`, then lets replies in progress finish. Each peer gets at most a quarter of the
/// connections; behind a proxy (`is_proxied`) loopback and private addresses have no limit.
pub(crate) async fn serve(listener: TcpListener, router: Router, is_proxied: bool, stop: impl Future<Output = ()>) {
    let n_permits = max_connections();
    let peers = PeerLimit::new((n_permits / 4).max(MIN_PER_PEER), is_proxied);
    let permits = Arc::new(Semaphore::new(n_permits));
    let (stopping, stopped) = watch::channel(());
    let mut stop = pin!(stop);
    loop {
        let accepted = async {
            let permit = permits.clone().acquire_owned().await;
            (listener.accept().await, permit)
        };
        let (accepted, permit) = tokio::select! {
            accepted = accepted => accepted,
            () = stop.as_mut() => break,
        };
        let (Ok((stream, address)), Ok(permit)) = (accepted, permit) else {
            // Typically out of file descriptors: wait for other connections to end.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        let Some(peer_connection) = peers.admit(address.ip()) else {
            // The write does not block, because the send buffer is empty.
            let _ = stream.into_std().and_then(|mut stream| stream.write(TOO_MANY));
            continue;
        };
        let (router, stopped) = (router.clone(), stopped.clone());
        tokio::spawn(async move {
            connection(stream, router, stopped).await;
            drop((permit, peer_connection));
        });
    }
    drop(listener);
    drop(stopping);
    let all = u32::try_from(n_permits).unwrap_or(u32::MAX);
    let _ = timeout(2 * GRACE_PERIOD, permits.acquire_many(all)).await;
}

/// Serves one connection. Errors are ignored: they concern the client only.
async fn connection(stream: TcpStream, router: Router, mut stopped: watch::Receiver<()>) {
    let _ = stream.set_nodelay(true);
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT);
    builder.max_buf_size(MAX_HEAD_BYTES).max_headers(MAX_HEADERS);
    let service = TowerToHyperService::new(router);
    let stream = TokioIo::new(WriteTimeout::new(stream, WRITE_TIMEOUT));
    let mut connection = pin!(builder.serve_connection(stream, service));
    tokio::select! {
        _ = connection.as_mut() => return,
        // Completes when the sender is dropped, which happens when the server stops.
        _ = stopped.changed() => {}
        () = sleep(MAX_CONNECTION_TIME) => {}
    }
    connection.as_mut().graceful_shutdown();
    let _ = timeout(GRACE_PERIOD, connection).await;
}

/// Maximum number of connections: half of the process's file descriptors, because each connection may have a film open.
/// Raises the soft limit of descriptors to the hard limit first.
fn max_connections() -> usize {
    let limit = getrlimit(Resource::Nofile);
    let raised = rustix::process::Rlimit { current: limit.maximum, ..limit };
    let files = if setrlimit(Resource::Nofile, raised).is_ok() { limit.maximum } else { limit.current };
    let half = files.map_or(usize::MAX, |files| (files as usize / 2).saturating_sub(32));
    half.clamp(16, MAX_CONNECTIONS)
}

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
