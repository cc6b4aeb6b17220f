//! Limit of connections per peer, so that no peer can occupy all of them. Addresses are kept in memory while connections
//! are open, and never logged.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex};

/// Number of open connections by peer: an IPv4 address, or an IPv6 /64 network, the smallest that providers assign.
#[derive(Debug)]
pub struct PeerLimit {
    max_connections: usize,
    /// Whether local addresses have no limit, because proxies connect from them.
    trusts_local: bool,
    open: Mutex<HashMap<IpAddr, usize>>,
}

impl PeerLimit {
    /// Limit of `max_connections` connections per peer. `trusts_local`: whether loopback and private addresses are
    /// those of proxies, which have no limit.
    pub fn new(max_connections: usize, trusts_local: bool) -> Arc<Self> {
        Arc::new(Self { max_connections, trusts_local, open: Mutex::default() })
    }

    /// Counts a connection from `address` until the result is dropped; `None` if its peer has reached the limit.
    pub fn admit(self: &Arc<Self>, address: IpAddr) -> Option<PeerConnection> {
        let peer = peer(address);
        let mut open = self.open.lock().ok()?;
        let n_open = open.entry(peer).or_default();
        if *n_open >= self.max_connections && !(self.trusts_local && is_local(address)) {
            return None;
        }
        *n_open += 1;
        Some(PeerConnection { limit: self.clone(), peer })
    }
}

#[derive(Debug)]
pub struct PeerConnection {
    limit: Arc<PeerLimit>,
    peer: IpAddr,
}

impl Drop for PeerConnection {
    fn drop(&mut self) {
        let Ok(mut open) = self.limit.open.lock() else { return };
        if let Some(n_open) = open.get_mut(&self.peer) {
            *n_open -= 1;
            if *n_open == 0 {
                open.remove(&self.peer);
            }
        }
    }
}

fn peer(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & !u128::from(u64::MAX)).into(),
        address @ IpAddr::V4(_) => address,
    }
}

/// Whether an address is loopback, private, unique local or link-local, and so not of the public internet.
fn is_local(address: IpAddr) -> bool {
    match address.to_canonical() {
        IpAddr::V4(address) => address.is_loopback() || address.is_private() || address.is_link_local(),
        IpAddr::V6(address) => address.is_loopback() || address.is_unique_local() || address.is_unicast_link_local(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_cannot_exceed_its_number_of_connections() {
        let limit = PeerLimit::new(2, false);
        let admit = |address: &str| limit.admit(address.parse().unwrap());
        let [first, second] = ["192.0.2.1", "::ffff:192.0.2.1"].map(admit);
        assert!(first.is_some() && second.is_some() && admit("192.0.2.1").is_none());
        let others = ["192.0.2.2", "2001:db8::1", "2001:db8::ffff:0:0:2", "2001:db8:0:1::1"].map(admit);
        assert!(others.iter().all(Option::is_some) && admit("2001:db8::3").is_none());
        drop(first);
        let third = admit("192.0.2.1");
        assert!(third.is_some() && admit("192.0.2.1").is_none());
        drop((second, third, others));
        assert!(limit.open.lock().unwrap().is_empty());
    }

    #[test]
    fn with_a_proxy_only_local_peers_are_unlimited() {
        let n_admitted = |trusts_local: bool, address: &str| {
            let limit = PeerLimit::new(2, trusts_local);
            let admitted: Vec<_> = (0..5).map_while(|_| limit.admit(address.parse().unwrap())).collect();
            admitted.len()
        };
        let local =
            ["127.0.0.1", "10.1.2.3", "172.16.0.9", "192.168.1.1", "::ffff:10.0.0.1", "::1", "fd00::1", "fe80::1"];
        for address in local {
            assert_eq!([true, false].map(|trusts| n_admitted(trusts, address)), [5, 2], "{address}");
        }
        for address in ["192.0.2.1", "172.32.0.1", "::ffff:192.0.2.1", "2001:db8::1"] {
            assert_eq!(n_admitted(true, address), 2, "{address}");
        }
    }
}
