//! Allowed hosts of requests. Without this check another site could point its own name at this server's address (DNS
//! rebinding) and read the study from a visitor's browser.

use super::reply::header_text;
use anyhow::{Result, ensure};
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response as HttpResponse};
use std::net::IpAddr;
use std::sync::Arc;

const MISDIRECTED: &str = "This server is not known under the host name of this request.\n\
    Open it at the address that `orator study serve` printed. To serve it under another name, or through a proxy that \
    passes one on, start it with --host-name NAME.\n";

/// Hosts under which the study is served: the listening address and an optional public name.
#[derive(Debug)]
pub struct AllowedHosts {
    listened: IpAddr,
    name: Option<String>,
}

impl AllowedHosts {
    /// Hosts of a server that listens on `listened` and is known by `name`.
    ///
    /// # Errors
    /// `name` has a scheme, port or path.
    pub fn new(listened: IpAddr, name: Option<String>) -> Result<Self> {
        if let Some(name) = &name {
            let is_host = name.parse::<Authority>().is_ok_and(|authority| authority.host() == name);
            ensure!(is_host, "--host-name {name:?}: expected a name alone, such as study.example.org");
        }
        Ok(Self { listened, name })
    }

    /// Whether `authority`, a host with or without a port, names this server. The port is ignored, because tunnels and
    /// proxies change it. A server that listens on all addresses (0.0.0.0, ::) accepts every IP address: only names can
    /// be rebound.
    fn allow(&self, authority: &str) -> bool {
        let Ok(authority) = authority.parse::<Authority>() else { return false };
        let host = authority.host();
        let is_everywhere = self.listened.is_unspecified();
        match host.trim_matches(['[', ']']).parse::<IpAddr>() {
            Ok(address) if is_everywhere || address == self.listened => true,
            Err(_) if host.eq_ignore_ascii_case("localhost") && (is_everywhere || self.listened.is_loopback()) => true,
            _ => self.name.as_ref().is_some_and(|name| name.eq_ignore_ascii_case(host)),
        }
    }
}

/// Middleware that answers 421 to requests that name another host.
pub async fn check_host(State(hosts): State<Arc<AllowedHosts>>, request: Request, next: Next) -> HttpResponse {
    let in_target = request.uri().authority().map(Authority::as_str);
    let named = in_target.or_else(|| header_text(request.headers(), header::HOST));
    if named.is_some_and(|host| hosts.allow(host)) {
        next.run(request).await
    } else {
        (StatusCode::MISDIRECTED_REQUEST, MISDIRECTED).into_response()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_listened_address_and_the_given_name_are_allowed() {
        let allowed = |listened: &str, host: &str| {
            let name = Some("study.example.org".to_owned());
            AllowedHosts::new(listened.parse().unwrap(), name).unwrap().allow(host)
        };
        for (listened, host) in [
            ("127.0.0.1", "127.0.0.1:8080"),
            ("127.0.0.1", "127.0.0.1"),
            ("127.0.0.1", "LocalHost:9000"),
            ("127.0.0.1", "Study.Example.Org"),
            ("127.0.0.1", "study.example.org:8443"),
            ("::1", "[::1]:8080"),
            ("::1", "localhost"),
            ("192.0.2.1", "192.0.2.1:8080"),
            ("0.0.0.0", "192.0.2.7:8080"),
            ("0.0.0.0", "localhost:8080"),
            ("::", "[2001:db8::1]:8080"),
        ] {
            assert!(allowed(listened, host), "{host} at {listened}");
        }
        for (listened, host) in [
            ("127.0.0.1", "evil.example:8080"),
            ("127.0.0.1", "192.0.2.1:8080"),
            ("127.0.0.1", "127.0.0.1.evil.example"),
            ("127.0.0.1", "localhost.evil.example"),
            ("127.0.0.1", "x.study.example.org"),
            ("127.0.0.1", "127.0.0.1/"),
            ("127.0.0.1", "[127.0.0.1"),
            ("127.0.0.1", ""),
            ("192.0.2.1", "localhost:8080"),
            ("0.0.0.0", "evil.example"),
            ("::", "evil.example"),
        ] {
            assert!(!allowed(listened, host), "{host} at {listened}");
        }
        for name in ["https://study.example.org", "study.example.org:443", "study.example.org/", "a b", ""] {
            let error = AllowedHosts::new([127, 0, 0, 1].into(), Some(name.to_owned())).unwrap_err();
            assert!(error.to_string().contains("--host-name"), "{error}");
        }
    }
}
