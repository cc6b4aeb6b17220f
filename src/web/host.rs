//! Allowed hosts of requests. Without this check another site could point its own name at this server's address (DNS
//! rebinding) and read its data from a visitor's browser.

use super::reply::header_text;
use anyhow::{Result, ensure};
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{StatusCode, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response as HttpResponse};
use std::net::IpAddr;
use std::sync::Arc;

/// Hosts under which a server is reached: the listening address and any public names.
#[derive(Debug)]
pub struct AllowedHosts {
    listened: IpAddr,
    names: Vec<String>,
    /// Advice for requests that name another host.
    advice: &'static str,
}

impl AllowedHosts {
    /// Hosts of a server that listens on `listened` and is known by `names`. Requests for others are answered with
    /// `advice`.
    ///
    /// # Errors
    /// A name has a scheme, port or path, or non-ASCII characters.
    pub fn new(listened: IpAddr, names: &[String], advice: &'static str) -> Result<Self> {
        for name in names {
            let hint = "use its punycode form (xn--...), as browsers send it";
            ensure!(name.is_ascii(), "--host-name {name:?}: the name contains non-ASCII characters; {hint}");
            let is_host = name.parse::<Authority>().is_ok_and(|authority| authority.host() == name);
            ensure!(is_host, "--host-name {name:?}: expected a host name only, such as study.example.org");
        }
        let names = names.iter().map(|name| without_dot(name).to_owned()).collect();
        Ok(Self { listened, names, advice })
    }

    /// Whether `authority`, a host with or without a port, names this server. The port is ignored, because tunnels and
    /// proxies change it. A server that listens on all addresses (0.0.0.0, ::) accepts every IP address: only names can
    /// be rebound.
    fn allow(&self, authority: &str) -> bool {
        let Ok(authority) = authority.parse::<Authority>() else { return false };
        let host = without_dot(authority.host());
        let is_everywhere = self.listened.is_unspecified();
        match host.trim_matches(['[', ']']).parse::<IpAddr>() {
            Ok(address) if is_everywhere || address == self.listened => true,
            Err(_) if host.eq_ignore_ascii_case("localhost") && (is_everywhere || self.listened.is_loopback()) => true,
            _ => self.names.iter().any(|name| name.eq_ignore_ascii_case(host)),
        }
    }
}

/// Host name without the dot that marks it as absolute: `localhost.` is `localhost`.
fn without_dot(host: &str) -> &str {
    host.strip_suffix('.').unwrap_or(host)
}

/// Middleware that answers 421 to requests that name another host, or none. A request of HTTP/1.0 may name none, as
/// health checks of proxies do: browsers always name one.
pub(crate) async fn check_host(State(hosts): State<Arc<AllowedHosts>>, request: Request, next: Next) -> HttpResponse {
    let in_target = request.uri().authority().map(Authority::as_str);
    let named = in_target.or_else(|| header_text(request.headers(), header::HOST));
    let is_old = request.version() == Version::HTTP_10 && !request.headers().contains_key(header::HOST);
    if named.map_or(is_old, |host| hosts.allow(host)) {
        next.run(request).await
    } else {
        let sentence = format!("This server does not accept the host name of this request.\n{}\n", hosts.advice);
        (StatusCode::MISDIRECTED_REQUEST, sentence).into_response()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_listened_address_and_the_given_names_are_allowed() {
        let allowed = |listened: &str, host: &str| {
            let names = ["study.example.org", "tunnel.example."].map(str::to_owned);
            AllowedHosts::new(listened.parse().unwrap(), &names, "").unwrap().allow(host)
        };
        let local = "127.0.0.1:8080 127.0.0.1 LocalHost:9000 Study.Example.Org study.example.org:8443 \
            study.example.org.:8443 tunnel.example localhost.";
        for (listened, hosts) in [
            ("127.0.0.1", local),
            ("::1", "[::1]:8080 localhost"),
            ("192.0.2.1", "192.0.2.1:8080"),
            ("0.0.0.0", "192.0.2.7:8080 localhost:8080"),
            ("::", "[2001:db8::1]:8080"),
        ] {
            assert!(hosts.split(' ').all(|host| allowed(listened, host)), "{hosts} at {listened}");
        }
        let others = "evil.example:8080 192.0.2.1:8080 127.0.0.1.evil.example localhost.evil.example \
            x.study.example.org localhost.. 127.0.0.1/ [127.0.0.1 ";
        for (listened, hosts) in [
            ("127.0.0.1", others),
            ("192.0.2.1", "localhost:8080"),
            ("0.0.0.0", "evil.example"),
            ("::", "evil.example"),
        ] {
            assert!(!hosts.split(' ').any(|host| allowed(listened, host)), "{hosts} at {listened}");
        }
        let error_of = |name: &str| {
            let names = ["study.example.org", name].map(str::to_owned);
            AllowedHosts::new([127, 0, 0, 1].into(), &names, "").unwrap_err().to_string()
        };
        for name in ["https://study.example.org", "study.example.org:443", "study.example.org/", "a b", ""] {
            let error = error_of(name);
            assert!(error.contains("--host-name"), "{error}");
        }
        let error = error_of("m\u{fc}ller.example");
        assert!(error.contains("--host-name") && error.contains("xn--"), "{error}");
    }
}
