//! A rendered person over a clip: body, appearance, speech and the pose at every time step.

use super::body::Build;
use super::condition::{GestureStyle, Seat};
use super::contact::{Obstacles, Slab};
use super::held::HeldObject;
use super::motion::{ActorMotion, LeanStyle};
use super::scene::CapturedClip;
use super::trunk::SeatedRig;
use super::vocabulary::{DESK_AHEAD, DESK_BELOW_NECK};
use super::voice::Voice;
use crate::demo::appearance;
use crate::demo::captured_body::{self, TrunkRotations};
use orator_avatar::animate::avatar::Avatar;
use orator_avatar::animate::rig::rig::{CM, Rig};
use orator_avatar::animate::{AnimationOptions, Constraints, Smoothing, Yaw, perform};
use orator_avatar::render::Mesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add};
use orator_base::types::time::FrameRate;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Pose of a rig at one time step.
#[derive(Clone, Debug)]
pub struct ActorPose {
    /// Position of the hips, world cm.
    pub root: Vec3,
    pub local: Vec<Rotation>,
    /// Mouth opening, 0..1.
    pub mouth: f64,
}

/// Placement and behaviour of a person in the scene.
#[derive(Clone, Copy, Debug)]
pub struct ActorRole {
    pub gesture_style: GestureStyle,
    pub seat: Seat,
    /// Whether the person leans over the desk (a sampled `LeanStyle`).
    pub leans: bool,
    /// Position on the floor (x, z), cm, and rotation to the person's left, radians.
    pub position: [f64; 2],
    pub turn: f64,
    pub speaks: bool,
}

/// A person with the poses of a clip.
pub struct Actor {
    pub rig: Rig,
    pub avatar: Avatar,
    /// Points of the face (`appearance::face`), cm, in the axes of the head joint.
    pub face: [Vec3; 5],
    pub held: Option<HeldObject>,
    pub poses: Vec<ActorPose>,
    pub role: ActorRole,
    pub unit: f64,
    /// Neck and hips of the upright body, world cm.
    pub neck: Vec3,
    pub hips: Vec3,
    /// Distance from the hips to the near edge of a desk, in metres of a body of unit 1.
    desk_ahead: f64,
}

/// Seeds of a person.
#[derive(Clone, Copy, Debug)]
pub struct ActorSeeds {
    pub body: u64,
    pub clothes: u64,
    pub motion: u64,
}

impl Actor {
    /// Creates a person that moves to a voice for `n_steps` steps at `fps`; captured motion replaces the procedural
    /// gestures of the arms, and of trunk and head if it has them.
    pub fn new(
        seeds: ActorSeeds,
        role: ActorRole,
        voice: &Voice,
        captured: Option<&CapturedClip>,
        fps: FrameRate,
        n_steps: usize,
    ) -> Self {
        let build = Build::sample(&mut ChaCha8Rng::seed_from_u64(seeds.body));
        let mut rng = ChaCha8Rng::seed_from_u64(seeds.motion);
        let held = (role.gesture_style == GestureStyle::Holding && captured.is_none())
            .then(|| HeldObject::sample(build.hand, &mut rng));
        let secs = fps.secs(n_steps);
        let grip = held.as_ref().map(|held| (held.side, held.grip));
        let mut actor_motion = ActorMotion::new(&voice.speech, secs, (role.gesture_style, role.seat), grip, &mut rng);
        let (knees, shins) = (rng.random_range(0.05..0.25), rng.random_range(-0.1..0.25));
        let front = usize::from(rng.random_bool(0.5));
        if role.leans && captured.is_none() {
            actor_motion.lean_style = LeanStyle::sample(&mut rng);
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
            Some(clip) if clip.trunk.is_empty() => perform(&clip.motion, None, &options),
            Some(clip) => captured_body::perform(&clip.motion, &build, &options, |secs| actor_motion.arms(secs)),
            None => {
                let seated = SeatedRig { rig: &own_rig, seat: role.seat, knees, shins };
                let obstacles = obstacles(&seated, &build, actor_motion.lean_style, front);
                let frames: Vec<_> = (0..n_steps)
                    .map(|step| {
                        let now = fps.secs(step);
                        obstacles.resolve(&build, &actor_motion.arms(now), &seated.torso(&actor_motion.trunk(now)))
                    })
                    .collect();
                perform(&build.motion(fps, &frames), None, &options)
            }
        };
        let rig = performed.rig;
        let seated = SeatedRig { rig: &rig, seat: role.seat, knees, shins };
        let turn = Rotation::about([0.0, 1.0, 0.0], role.turn);
        let shift = [role.position[0], 0.0, role.position[1]];
        let last = performed.clip.n_frames().saturating_sub(1);
        let poses = (0..n_steps)
            .map(|step| {
                let now = fps.secs(step);
                let posture = actor_motion.trunk(now);
                let mut local = performed.clip.local[step.min(last)].clone();
                let chest = local[0] * local[rig.spine] * local[rig.chest];
                seated.pose(&posture, &mut local);
                let trunk = captured.and_then(|clip| TrunkRotations::at(&clip.trunk, now * clip.motion.fps.per_sec()));
                if let Some(trunk) = trunk {
                    trunk.apply(&rig, chest, &mut local);
                }
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
        let appearance = appearance::random(seeds.clothes);
        let (avatar, face) = (Avatar::new(&rig, &appearance), appearance::face(&rig, &appearance));
        let desk_ahead = DESK_AHEAD + actor_motion.lean_style.desk_ahead();
        Self { rig, avatar, face, held, poses, role, unit, neck, hips, desk_ahead }
    }

    /// Meshes of a pose: the body's, then the held object's.
    pub fn meshes(&self, pose: &ActorPose) -> Vec<Mesh> {
        let mut meshes = self.avatar.posed(&self.rig, pose.root, &pose.local, pose.mouth);
        meshes.extend(self.held.iter().map(|held| held.posed(&self.rig, pose.root, &pose.local)));
        meshes
    }

    /// Number of meshes of the body alone.
    pub fn n_body_meshes(&self) -> usize {
        self.avatar.parts.len()
    }

    /// Height of the desk top, and distance from the hips to its near edge, cm.
    pub fn desk(&self) -> [f64; 2] {
        [self.neck[1] - DESK_BELOW_NECK * CM * self.unit, self.desk_ahead * CM * self.unit]
    }
}

/// Surfaces below the hands of a seated body, before the body is moved to its position.
fn obstacles(seated: &SeatedRig, build: &Build, lean_style: LeanStyle, front: usize) -> Obstacles {
    let unit = build.unit();
    let (upright, mut slabs) = (Default::default(), Vec::new());
    if seated.seat != Seat::Standing {
        let hips = seated.root(&upright);
        let half = 22.0 * unit;
        slabs.push(Slab {
            top: hips[1] + 4.0 * unit,
            x: [-half, half],
            z: [8.0 * unit, 46.0 * unit],
            below: f64::INFINITY,
        });
    }
    if seated.seat == Seat::Desk {
        let top = seated.torso(&upright).neck[1] - DESK_BELOW_NECK * CM * unit;
        let near = (DESK_AHEAD + lean_style.desk_ahead()) * CM * unit;
        slabs.push(Slab { top, x: [-90.0, 90.0], z: [near, 120.0], below: DESK_BELOW_NECK + 0.03 });
    }
    Obstacles { slabs, lean_style, front }
}
