//! Connections: how many at once, how long each may take, and how all of them end.

use super::peers::PeerLimit;
use super::write_timeout::WriteTimeout;
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rustix::process::{Resource, getrlimit, setrlimit};
use std::future::Future;
use std::io::Write;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

/// Connections at once, where the system lets a process have so many.
const MOST_CONNECTIONS: usize = 2048;
/// Connections that a peer may have in any case: a browser opens six.
const LEAST_PER_PEER: usize = 8;
/// Reply to a connection beyond those of its peer.
const TOO_MANY: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 10\r\nConnection: close\r\n\r\n";
/// Time in which the head of a request must come; an idle connection is closed after it.
const HEAD_TIME: Duration = Duration::from_secs(10);
/// Bytes of the head of a request, and its headers.
const MOST_HEAD: usize = 16 * 1024;
const MOST_HEADERS: usize = 64;
/// Time without a byte written after which a reply, and its connection, ends.
const WRITE_TIME: Duration = Duration::from_secs(30);
/// Time after which a connection takes no request more.
const CONNECTION_TIME: Duration = Duration::from_secs(600);
/// Time that a reply on its way has left when the connection or the server ends.
const GRACE: Duration = Duration::from_secs(5);

/// Serves `router` until `stop`, then lets the replies on their way end. A peer has at most a quarter of the connections,
/// unless all are those of a proxy (`is_proxied`).
pub async fn serve(listener: TcpListener, router: Router, is_proxied: bool, stop: impl Future<Output = ()>) {
    let n_places = most_connections();
    let peers = PeerLimit::new(if is_proxied { n_places } else { (n_places / 4).max(LEAST_PER_PEER) });
    let places = Arc::new(Semaphore::new(n_places));
    let (stopping, stopped) = watch::channel(());
    let mut stop = pin!(stop);
    loop {
        let accepted = async {
            let place = places.clone().acquire_owned().await;
            (listener.accept().await, place)
        };
        let (accepted, place) = tokio::select! {
            accepted = accepted => accepted,
            () = stop.as_mut() => break,
        };
        let (Ok((stream, address)), Ok(place)) = (accepted, place) else {
            // No more files: others must end first.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        let Some(counted) = peers.admit(address.ip()) else {
            // An empty send buffer takes it at once.
            let _ = stream.into_std().and_then(|mut stream| stream.write(TOO_MANY));
            continue;
        };
        let (router, stopped) = (router.clone(), stopped.clone());
        tokio::spawn(async move {
            connection(stream, router, stopped).await;
            drop((place, counted));
        });
    }
    drop(listener);
    drop(stopping);
    let all = u32::try_from(n_places).unwrap_or(u32::MAX);
    let _ = timeout(2 * GRACE, places.acquire_many(all)).await;
}

/// Serves one connection. What breaks it concerns its other end alone.
async fn connection(stream: TcpStream, router: Router, mut stopped: watch::Receiver<()>) {
    let _ = stream.set_nodelay(true);
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME);
    builder.max_buf_size(MOST_HEAD).max_headers(MOST_HEADERS);
    let service = TowerToHyperService::new(router);
    let stream = TokioIo::new(WriteTimeout::new(stream, WRITE_TIME));
    let mut connection = pin!(builder.serve_connection(stream, service));
    tokio::select! {
        _ = connection.as_mut() => return,
        // The sender is dropped when the server stops.
        _ = stopped.changed() => {}
        () = sleep(CONNECTION_TIME) => {}
    }
    connection.as_mut().graceful_shutdown();
    let _ = timeout(GRACE, connection).await;
}

/// Half of the files that this process may open, each connection with a film; as many as it may are asked for.
fn most_connections() -> usize {
    let limit = getrlimit(Resource::Nofile);
    let raised = rustix::process::Rlimit { current: limit.maximum, ..limit };
    let files = if setrlimit(Resource::Nofile, raised).is_ok() { limit.maximum } else { limit.current };
    let half = files.map_or(usize::MAX, |files| (files as usize / 2).saturating_sub(32));
    half.clamp(16, MOST_CONNECTIONS)
}
