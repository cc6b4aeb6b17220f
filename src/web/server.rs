//! Server of a router until SIGINT or SIGTERM, and the layers that every server has: security headers, checked hosts, a
//! time limit, replies for unknown addresses.

use crate::host::{AllowedHosts, check_host};
use crate::listen;
use crate::reply::{HEADERS, method_not_allowed, not_found};
use anyhow::{Context, Result};
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::{Router, middleware};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;

/// Adds replies for unknown addresses, the check of `hosts`, the content security `policy`, the `permissions` of pages,
/// and a time limit for requests up to the start of their reply.
pub fn secured(
    router: Router,
    hosts: AllowedHosts,
    [policy, permissions]: [&'static str; 2],
    time_limit: Duration,
) -> Router {
    let mut router = router
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, time_limit))
        .layer(middleware::from_fn_with_state(Arc::new(hosts), check_host))
        .layer(SetResponseHeaderLayer::if_not_present(header::CACHE_CONTROL, HeaderValue::from_static("no-store")));
    let of_page =
        [(header::CONTENT_SECURITY_POLICY, policy), (HeaderName::from_static("permissions-policy"), permissions)];
    for (name, value) in HEADERS.into_iter().chain(of_page) {
        router = router.layer(SetResponseHeaderLayer::overriding(name, HeaderValue::from_static(value)));
    }
    router
}

/// Serves `router` on `address` until SIGINT or SIGTERM. `on_listening` is called with the actual address once the
/// socket is bound. With `is_proxied`, a proxy at a loopback or private address limits the connections of each peer.
///
/// # Errors
/// The address cannot be bound.
pub fn run(router: Router, address: SocketAddr, is_proxied: bool, on_listening: impl FnOnce(SocketAddr)) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().context("cannot start threads")?;
    runtime.block_on(async {
        let mut terminated = signal(SignalKind::terminate()).context("cannot install the SIGTERM handler")?;
        let listener = TcpListener::bind(address).await;
        let listener = listener.with_context(|| format!("cannot listen on {address}; use another --port"))?;
        on_listening(listener.local_addr()?);
        let stop = async {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = terminated.recv() => {}
            }
        };
        listen::serve(listener, router, is_proxied, stop).await;
        Ok(())
    })
}
