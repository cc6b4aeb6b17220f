//! The address that collects what a page sends.

use anyhow::{Result, ensure};

/// Origin of the address `url`, which stands in the page and in its content security policy.
///
/// # Errors
/// An address that is not https (http on this machine alone), or that has letters which do not belong in one.
pub fn origin(url: &str) -> Result<&str> {
    let is_plain = url.bytes().all(|byte| byte.is_ascii_graphic() && !b"\"'<>;,\\^`{|}#".contains(&byte));
    ensure!(is_plain, "--post {url:?} is not an address: expected letters, digits and -._~:/?@!$&()*+=% alone");
    let (scheme, rest) = url.split_once("://").unwrap_or(("", url));
    let host = rest.split(['/', '?']).next().unwrap_or_default();
    let name = host.split(':').next().unwrap_or_default();
    let is_here = ["localhost", "127.0.0.1"].contains(&name);
    ensure!(
        scheme == "https" || scheme == "http" && is_here,
        "--post {url}: responses are sent to an address that begins with https:// (http:// on this machine alone)"
    );
    ensure!(!name.is_empty() && !host.contains('@'), "--post {url}: expected https://HOST/PATH");
    Ok(&url[..scheme.len() + 3 + host.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_scheme_host_and_port() {
        assert_eq!(origin("https://a.example/collect?x=1").unwrap(), "https://a.example");
        assert_eq!(origin("http://127.0.0.1:8000").unwrap(), "http://127.0.0.1:8000");
        let wrong = ["", "a.example/x", "http://a.example/x", "ftp://a.example", "https://", "https:///x"];
        let hostile = ["https://a.example/\"><script>", "https://a.example; script-src *", "https://u@a.example/"];
        for url in wrong.iter().chain(&hostile) {
            assert!(origin(url).is_err(), "{url}");
        }
    }
}
