//! A rendered person over a clip: body, looks, speech and the pose of every step of time.

use super::acts::{Acts, Carriage};
use super::body::Build;
use super::condition::{Manner, Seat};
use super::contact::{Obstacles, Slab};
use super::held::HeldThing;
use super::trunk::SeatedRig;
use super::vocabulary::{DESK_AHEAD, DESK_BELOW_NECK};
use super::voice::Voice;
use crate::demo::looks;
use orator_avatar::animate::avatar::Avatar;
use orator_avatar::animate::rig::rig::{CM, Rig};
use orator_avatar::animate::{AnimationOptions, Constraints, Smoothing, Yaw, perform};
use orator_avatar::render::Mesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add};
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rotations of a rig's joints at one time.
#[derive(Clone, Debug)]
pub struct ActorPose {
    /// Position of the hips, world cm.
    pub root: Vec3,
    pub local: Vec<Rotation>,
    /// Opening of the mouth, 0..1.
    pub mouth: f64,
}

/// Where and how a person is put.
#[derive(Clone, Copy, Debug)]
pub struct ActorRole {
    pub manner: Manner,
    pub seat: Seat,
    /// Whether trunk, head and arms are held as `Carriage` says.
    pub leans: bool,
    /// Place on the floor, cm, and turn to the person's left, radians.
    pub place: [f64; 2],
    pub turn: f64,
    pub speaks: bool,
}

/// Person with the poses of a clip.
pub struct Actor {
    pub rig: Rig,
    pub avatar: Avatar,
    /// Points of the face, cm from the head joint in its axes (`looks::face`).
    pub face: [Vec3; 5],
    pub held: Option<HeldThing>,
    pub poses: Vec<ActorPose>,
    pub role: ActorRole,
    pub unit: f64,
    /// Neck and hips of the upright body, world cm.
    pub neck: Vec3,
    pub hips: Vec3,
    /// Near edge of a desk ahead of the hips, metres of a body of unit 1.
    desk_ahead: f64,
}

/// Seeds of what a person is.
#[derive(Clone, Copy, Debug)]
pub struct ActorSeeds {
    pub body: u64,
    pub clothes: u64,
    pub motion: u64,
}

impl Actor {
    /// Person who acts to a voice for `n_steps` steps at `fps`; a captured motion replaces the arms' gestures.
    pub fn new(
        seeds: ActorSeeds,
        role: ActorRole,
        voice: &Voice,
        captured: Option<&Motion>,
        fps: FrameRate,
        n_steps: usize,
    ) -> Self {
        let build = Build::sample(&mut ChaCha8Rng::seed_from_u64(seeds.body));
        let mut rng = ChaCha8Rng::seed_from_u64(seeds.motion);
        let held =
            (role.manner == Manner::Holding && captured.is_none()).then(|| HeldThing::sample(build.hand, &mut rng));
        let secs = fps.secs(n_steps);
        let grip = held.as_ref().map(|held| (held.side, held.grip));
        let mut acts = Acts::new(&voice.speech, secs, (role.manner, role.seat), grip, &mut rng);
        let (knees, shins) = (rng.random_range(0.05..0.25), rng.random_range(-0.1..0.25));
        let front = usize::from(rng.random_bool(0.5));
        if role.leans && captured.is_none() {
            acts.carriage = Carriage::sample(&mut rng);
        }

        let options = AnimationOptions {
            smoothing: Smoothing::None,
            constraints: Constraints { limits: true, curl_coherence: false },
            yaw: Yaw::Spine,
            fps: Some(fps),
            ..AnimationOptions::default()
        };
        let own_rig = build.rig();
        let performed = match captured {
            Some(motion) => perform(motion, None, &options),
            None => {
                let seated = SeatedRig { rig: &own_rig, seat: role.seat, knees, shins };
                let obstacles = obstacles(&seated, &build, acts.carriage, front);
                let frames: Vec<_> = (0..n_steps)
                    .map(|step| {
                        let now = fps.secs(step);
                        obstacles.free(&build, &acts.arms(now), &seated.torso(&acts.trunk(now)))
                    })
                    .collect();
                perform(&build.motion(fps, &frames), None, &options)
            }
        };
        let rig = performed.rig;
        let seated = SeatedRig { rig: &rig, seat: role.seat, knees, shins };
        let turn = Rotation::about([0.0, 1.0, 0.0], role.turn);
        let shift = [role.place[0], 0.0, role.place[1]];
        let last = performed.clip.n_frames().saturating_sub(1);
        let poses = (0..n_steps)
            .map(|step| {
                let now = fps.secs(step);
                let posture = acts.trunk(now);
                let mut local = performed.clip.local[step.min(last)].clone();
                seated.pose(&posture, &mut local);
                local[0] = turn * local[0];
                let root = add(turn.turn(seated.root(&posture)), shift);
                let mouth = if role.speaks { voice.mouth(now) } else { voice.chewing(now) };
                ActorPose { root, local, mouth }
            })
            .collect();
        let upright = Default::default();
        let neck = add(turn.turn(seated.torso(&upright).neck), shift);
        let hips = add(turn.turn(seated.root(&upright)), shift);
        let unit = rig.skeleton.joints[rig.spine].offset[1] / 10.0;
        let looks = looks::random(seeds.clothes);
        let (avatar, face) = (Avatar::new(&rig, &looks), looks::face(&rig, &looks));
        let desk_ahead = DESK_AHEAD + acts.carriage.desk_ahead();
        Self { rig, avatar, face, held, poses, role, unit, neck, hips, desk_ahead }
    }

    /// Meshes of a pose: those of the body first, then of the held thing.
    pub fn meshes(&self, pose: &ActorPose) -> Vec<Mesh> {
        let mut meshes = self.avatar.posed(&self.rig, pose.root, &pose.local, pose.mouth);
        meshes.extend(self.held.iter().map(|held| held.posed(&self.rig, pose.root, &pose.local)));
        meshes
    }

    /// Meshes of the body alone.
    pub fn n_body_meshes(&self) -> usize {
        self.avatar.parts.len()
    }

    /// Upper side of the desk, and its near edge ahead of the hips, cm.
    pub fn desk(&self) -> [f64; 2] {
        [self.neck[1] - DESK_BELOW_NECK * CM * self.unit, self.desk_ahead * CM * self.unit]
    }
}

/// Surfaces below the hands of a seated body, before it is put in its place.
fn obstacles(seated: &SeatedRig, build: &Build, carriage: Carriage, front: usize) -> Obstacles {
    let unit = build.unit();
    let (upright, mut slabs) = (Default::default(), Vec::new());
    if seated.seat != Seat::Standing {
        let hips = seated.root(&upright);
        let half = 22.0 * unit;
        slabs.push(Slab {
            top: hips[1] + 4.0 * unit,
            x: [-half, half],
            z: [8.0 * unit, 46.0 * unit],
            beneath: f64::INFINITY,
        });
    }
    if seated.seat == Seat::Desk {
        let top = seated.torso(&upright).neck[1] - DESK_BELOW_NECK * CM * unit;
        let near = (DESK_AHEAD + carriage.desk_ahead()) * CM * unit;
        slabs.push(Slab { top, x: [-90.0, 90.0], z: [near, 120.0], beneath: DESK_BELOW_NECK + 0.03 });
    }
    Obstacles { slabs, carriage, front }
}
