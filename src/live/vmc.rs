//! Poses as VMC messages: OSC bundles over UDP, one per pose, in the axes of Unity (x to the right of the body).
//! Protocol: <https://protocol.vmc.info/english>, "Performer" to "Marionette".

use super::pose::HumanoidBone;
use super::session::{PoseSink, SinkFacts, TimedPose};
use anyhow::{Context, Result};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType, encoder};
use std::io::ErrorKind;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;

/// Address at which VMC receivers listen by default.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:39539";
/// OSC time tag of a bundle that is valid at once.
const IMMEDIATELY: OscTime = OscTime { seconds: 0, fractional: 1 };

pub struct VmcSocket {
    socket: UdpSocket,
    address: SocketAddr,
    bones: Arc<[HumanoidBone]>,
    n_sent: u64,
    n_dropped: u64,
    /// Number of bundles that nobody received, as far as the system reports it.
    n_refused: u64,
}

impl VmcSocket {
    /// Opens a socket that sends to `address`, a host and port. [`Self::with_bones`] is required before poses are sent.
    ///
    /// # Errors
    /// An address that is invalid or cannot be resolved or reached.
    pub fn connect(address: &str) -> Result<Self> {
        let context = || format!("--vmc: cannot send to {address}, expected HOST:PORT such as {DEFAULT_ADDRESS}");
        // Receivers listen on IPv4 addresses; `localhost` often has one of IPv6 first.
        let mut found: Vec<SocketAddr> = address.to_socket_addrs().with_context(context)?.collect();
        found.sort_by_key(SocketAddr::is_ipv6);
        let found = *found.first().with_context(context)?;
        let own = if found.is_ipv4() { (Ipv4Addr::UNSPECIFIED, 0).into() } else { (Ipv6Addr::UNSPECIFIED, 0).into() };
        let socket = UdpSocket::bind::<SocketAddr>(own).with_context(context)?;
        socket.connect(found).with_context(context)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, address: found, bones: Arc::default(), n_sent: 0, n_dropped: 0, n_refused: 0 })
    }

    #[must_use]
    pub fn with_bones(self, bones: Arc<[HumanoidBone]>) -> Self {
        Self { bones, ..self }
    }
}

/// Bytes of the bundle of a pose.
fn bundle(bones: &[HumanoidBone], pose: &TimedPose) -> rosc::Result<Vec<u8>> {
    let bone_poses = bones.iter().zip(&pose.pose.rotations).enumerate().map(|(i, (bone, rotation))| {
        let position = if i == 0 { pose.pose.hips } else { bone.offset };
        message("/VMC/Ext/Bone/Pos", transform(&bone.unity, position, *rotation))
    });
    let root = transform("root", [0.0; 3], Rotation::IDENTITY);
    let state = [
        message("/VMC/Ext/OK", vec![OscType::Int(1)]),
        message("/VMC/Ext/T", vec![OscType::Float(pose.secs as f32)]),
        message("/VMC/Ext/Root/Pos", root),
    ];
    let content = state.into_iter().chain(bone_poses).collect();
    encoder::encode(&OscPacket::Bundle(OscBundle { timetag: IMMEDIATELY, content }))
}

fn message(addr: &str, args: Vec<OscType>) -> OscPacket {
    OscPacket::Message(OscMessage { addr: addr.to_owned(), args })
}

/// Name, position and quaternion x, y, z, w, mirrored in the plane x = 0.
fn transform(name: &str, [x, y, z]: Vec3, rotation: Rotation) -> Vec<OscType> {
    let Rotation { w, v: [qx, qy, qz] } = rotation.mirrored();
    let numbers = [-x, y, z, qx, qy, qz, w].map(|number| OscType::Float(number as f32));
    std::iter::once(OscType::String(name.to_owned())).chain(numbers).collect()
}

impl PoseSink for VmcSocket {
    fn send(&mut self, pose: &TimedPose) {
        let Ok(bytes) = bundle(&self.bones, pose) else { return self.n_dropped += 1 };
        let mut sent = self.socket.send(&bytes);
        // The system reports the refusal of an earlier bundle and does not send this one.
        if sent.as_ref().is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused) {
            self.n_refused += 1;
            sent = self.socket.send(&bytes);
        }
        match sent {
            Ok(_) => self.n_sent += 1,
            Err(_) => self.n_dropped += 1,
        }
    }

    fn facts(&self) -> SinkFacts {
        let note = (self.n_refused > 0).then(|| {
            let (n, address) = (self.n_refused, self.address);
            format!("{n} bundles or more were not received: no program listens at {address}")
        });
        SinkFacts { name: "vmc", n_sent: self.n_sent, n_dropped: self.n_dropped, note }
    }
}
