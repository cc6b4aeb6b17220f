//! Limit of connections per peer, so that no peer can occupy all of them. Addresses are kept in memory while
//! connections are open, and never logged.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex};

/// Number of open connections by peer: an IPv4 address, or an IPv6 /64 network, the smallest that providers assign.
#[derive(Debug)]
pub struct PeerLimit {
    max_connections: usize,
    open: Mutex<HashMap<IpAddr, usize>>,
}

impl PeerLimit {
    /// Limit of `max_connections` connections per peer.
    pub fn new(max_connections: usize) -> Arc<Self> {
        Arc::new(Self { max_connections, open: Mutex::default() })
    }

    /// Counts a connection from `address` until the result is dropped; `None` if its peer has reached the limit.
    pub fn admit(self: &Arc<Self>, address: IpAddr) -> Option<PeerConnection> {
        let peer = peer(address);
        let mut open = self.open.lock().ok()?;
        let n_open = open.entry(peer).or_default();
        if *n_open >= self.max_connections {
            return None;
        }
        *n_open += 1;
        Some(PeerConnection { limit: self.clone(), peer })
    }
}

/// A counted connection.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_cannot_exceed_its_number_of_connections() {
        let limit = PeerLimit::new(2);
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
}
