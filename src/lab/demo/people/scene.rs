//! A clip of rendered persons: actors, room, camera and sound from its seeds, rendered with the ground truth of every
//! frame.

use super::actor::{Actor, ActorPose, ActorRole, ActorSeeds};
use super::condition::{Condition, Seat};
use super::lens;
use super::lens::CameraDefects;
use super::set;
use super::set::SeatPosition;
use super::truth;
use super::truth::{FrameTruth, PointOwners};
use super::view;
use super::voice::Voice;
use crate::demo::captured_body::TrunkRotations;
use crate::rendered_truth::RenderedTruth;
use orator_avatar::render::{Background, Light, Mesh, PinholeCamera, Renderer};
use orator_base::stage::progress::Progress;
use orator_base::types::image::Image;
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::write::encode::{GOOD_CRF, VideoWriter};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Time steps per frame with motion blur (odd), and the number of steps during which the shutter is open.
const BLUR_STEPS: usize = 15;
const SHUTTER: usize = 9;
/// Frames rendered in parallel.
const BATCH: usize = 24;

/// Seeds of a clip, one for each property that differs between the parts of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClipSeeds {
    pub body: u64,
    pub clothes: u64,
    pub camera: u64,
    pub motion: u64,
    /// Seed of pitch and formants; if absent they follow from the `motion` seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voice: Option<u64>,
}

/// Captured motion with its sound, if it has one.
#[derive(Clone, Debug)]
pub struct CapturedClip {
    pub motion: Motion,
    pub sound: Option<Sound>,
    /// Trunk and head of each frame. If they are given, the motion drives a standing body with the proportions of its
    /// seed and a generated voice; otherwise the body has the bone lengths of the motion, and trunk and head are
    /// generated.
    pub trunk: Vec<TrunkRotations>,
}

/// A clip ready to be rendered.
pub struct PersonScene {
    pub fps: FrameRate,
    pub n_frames: usize,
    pub camera: PinholeCamera,
    pub actors: Vec<Actor>,
    voice: Voice,
    light: Light,
    background: Background,
    defects: CameraDefects,
    /// Time steps per frame.
    n_steps: usize,
    crf: u32,
}

impl PersonScene {
    /// Creates a clip of `secs` seconds; `captured` motion replaces the procedural motion of the first person.
    pub fn new(
        condition: Condition,
        seeds: ClipSeeds,
        secs: f64,
        fps: FrameRate,
        captured: Option<&CapturedClip>,
    ) -> Self {
        let n_frames = fps.frames_in(secs);
        let n_steps = if condition == Condition::Fast { BLUR_STEPS } else { 1 };
        let step_fps = FrameRate::new(fps.num * n_steps as u32, fps.den);
        let has_trunk = captured.is_some_and(|clip| !clip.trunk.is_empty());
        let voice = match captured {
            Some(clip) if !has_trunk => Voice::recorded(seeds.motion, secs, clip.sound.clone()),
            _ => Voice::new(seeds.motion, secs, seeds.voice),
        };
        let mut rng = ChaCha8Rng::seed_from_u64(seeds.camera);
        let seat = condition.seat().unwrap_or([Seat::Standing, Seat::Chair, Seat::Desk][rng.random_range(0..3)]);
        let seat = if condition == Condition::TwoPersons && seat == Seat::Desk { Seat::Chair } else { seat };
        let seat = if has_trunk { Seat::Standing } else { seat };
        let role = ActorRole {
            gesture_style: condition.gesture_style(),
            seat,
            leans: condition == Condition::LeaningDesk,
            position: [0.0; 2],
            turn: rng.random_range(-0.1..0.1),
            speaks: true,
        };
        let act = |seeds: ActorSeeds, role: ActorRole, voice: &Voice, clip: Option<&CapturedClip>| {
            Actor::new(seeds, role, voice, clip, step_fps, n_frames * n_steps)
        };
        let ClipSeeds { body, clothes, motion, .. } = seeds;
        let mut actors = vec![act(ActorSeeds { body, clothes, motion }, role, &voice, captured)];
        if condition == Condition::TwoPersons {
            let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let position = [side * rng.random_range(52.0..75.0), -rng.random_range(25.0..70.0)];
            let second = ActorRole { position, turn: -side * rng.random_range(0.0..0.35), speaks: false, ..role };
            // The seeds of the second person are derived from the first one's by setting a high bit, which no part of
            // a set uses.
            let [body, clothes, motion] = [body, clothes, motion].map(|seed| seed ^ (1 << 40));
            let silent = Voice::new(motion, secs, None);
            actors.push(act(ActorSeeds { body, clothes, motion }, second, &silent, None));
        }
        let first = &actors[0];
        let second_neck = actors.get(1).map(|second| second.neck);
        let camera = view::camera(condition, first.neck, first.unit, second_neck, &mut rng);
        let light = view::light(&mut rng);
        let seats: Vec<SeatPosition> = actors.iter().map(seat_position).collect();
        let background = set::background(&camera, &light, &seats, &mut rng);
        let wide = camera.size[0] as f64 / 640.0;
        let defects = CameraDefects {
            blur_px: if condition == Condition::Blurred { wide * rng.random_range(1.2..2.4) } else { 0.0 },
            darkness: if condition == Condition::Dark { rng.random_range(0.07..0.16) } else { 0.0 },
            seed: seeds.camera,
        };
        let crf = if condition == Condition::Compressed { rng.random_range(35..41) } else { GOOD_CRF };
        Self { fps, n_frames, camera, actors, voice, light, background, defects, n_steps, crf }
    }

    /// Sound of the clip.
    pub fn sound(&self) -> &Sound {
        &self.voice.sound
    }

    /// Renders the clip to a video at `path` and returns its ground truth.
    ///
    /// # Errors
    /// The video cannot be written.
    pub fn film(&self, path: &Path, progress: &dyn Progress) -> anyhow::Result<RenderedTruth> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let task = progress.begin(&format!("render {name}"), self.n_frames as u64);
        let [width, height] = self.camera.size;
        let mut video = VideoWriter::with_crf(path, [width, height], self.fps, Some(self.sound()), self.crf)?;
        let owners = PointOwners::new(&self.actors[0]);
        let mut truths = Vec::with_capacity(self.n_frames);
        let mut drawn = self.frames(&owners, 0);
        while !drawn.is_empty() {
            let (mut following, first) = (Vec::new(), truths.len() + drawn.len());
            rayon::in_place_scope(|scope| -> anyhow::Result<()> {
                // Rendered while the current frames are encoded.
                scope.spawn(|_| following = self.frames(&owners, first));
                for (image, truth) in drawn.drain(..) {
                    video.push(&image)?;
                    truths.push(truth);
                    task.advance(1);
                }
                Ok(())
            })?;
            drawn = following;
        }
        video.finish()?;
        let speaks = self.actors[0].role.speaks && !self.sound().samples.is_empty();
        Ok(truth::collected(&truths, self.fps, &self.camera, speaks))
    }

    /// Images and ground truth of the batch of frames that begins with `first`; empty after the last frame.
    fn frames(&self, owners: &PointOwners, first: usize) -> Vec<(Image, FrameTruth)> {
        let frames = first..(first + BATCH).min(self.n_frames);
        frames
            .into_par_iter()
            .map_init(|| Renderer::new(self.camera.size), |renderer, frame| self.frame(renderer, owners, frame))
            .collect()
    }

    /// Ground truth without rendering: every point inside the image counts as visible.
    pub fn truth_without_pictures(&self) -> RenderedTruth {
        let owners = PointOwners::new(&self.actors[0]);
        // A renderer without a drawn frame reports no occluders.
        let renderer = Renderer::new(self.camera.size);
        let first = &self.actors[0];
        let truths: Vec<FrameTruth> = (0..self.n_frames)
            .map(|t| FrameTruth::of(first, &owners, &first.poses[t * self.n_steps], &self.camera, (&renderer, [0; 3])))
            .collect();
        truth::collected(&truths, self.fps, &self.camera, first.role.speaks && !self.sound().samples.is_empty())
    }

    /// Image and ground truth of a frame. The truth is that of the middle of the exposure.
    pub fn frame(&self, renderer: &mut Renderer, owners: &PointOwners, frame_idx: usize) -> (Image, FrameTruth) {
        let middle = frame_idx * self.n_steps;
        let half = if self.n_steps == 1 { 0 } else { SHUTTER / 2 };
        let last = self.n_frames * self.n_steps - 1;
        // The middle of the exposure is drawn last, because the renderer reports the occluders of its last image.
        let beside = (1..=half).flat_map(|k| [middle.saturating_sub(k), (middle + k).min(last)]);
        let images: Vec<Image> = beside.chain([middle]).map(|step| self.draw(renderer, step)).collect();
        let first = &self.actors[0];
        let n_own = first.n_body_meshes() + usize::from(first.held.is_some());
        let n_persons = n_own + self.actors[1..].iter().map(Actor::n_body_meshes).sum::<usize>();
        let counts = [first.n_body_meshes(), n_own, n_persons];
        let truth = FrameTruth::of(first, owners, &first.poses[middle], &self.camera, (renderer, counts));
        let image = lens::mean(&images).unwrap_or_else(|| self.background.image.clone());
        (self.defects.apply(image, frame_idx), truth)
    }

    fn draw(&self, renderer: &mut Renderer, step: usize) -> Image {
        let posed = |actor: &Actor| -> Vec<Mesh> {
            let pose: &ActorPose = &actor.poses[step];
            actor.meshes(pose)
        };
        let meshes: Vec<Mesh> = self.actors.iter().flat_map(posed).collect();
        renderer.draw(&self.camera, &meshes.iter().collect::<Vec<_>>(), &self.light, &self.background)
    }
}

fn seat_position(actor: &Actor) -> SeatPosition {
    SeatPosition {
        seat: actor.role.seat,
        hips: actor.hips,
        unit: actor.unit,
        turn: actor.role.turn,
        desk: actor.desk(),
    }
}
