//! Renders one film: one faceless avatar, or two side by side, before a plain backdrop with the sound of a clip, and a
//! number in attention checks. All films of a study have the same size, rate and length; the mouth does not move.

use crate::file::FilmLayout;
use crate::plan::{FilmContent, FilmSound};
use anyhow::{Context, Result, ensure};
use orator_avatar::animate::Performance;
use orator_avatar::animate::avatar::Appearance;
use orator_avatar::animate::export::film::smooth_rate;
use orator_avatar::animate::export::film_avatar::{AvatarStage, AvatarView, FilmCamera};
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::write::encode::{VideoWriter, has_h264};
use orator_media::opencv::draw;
use std::path::Path;

const CAMERA: FilmCamera = FilmCamera::Front;
const SIDE_BY_SIDE_FPS: FrameRate = FrameRate::new(30, 1);
const NAME_CONTEXT: &str = "orator study 2026 names of films";
/// Incremented when the same content gives different bytes.
const VERSION: u32 = 1;
/// Constant rate factor. Films have equal quality rather than equal bit rate, which would degrade lively motion.
const CRF: u32 = 20;
/// Height of the digits as a fraction of the picture height, and margin of the plate as a fraction of the digit height.
const DIGIT_HEIGHT: f32 = 0.18;
const PLATE_MARGIN: f32 = 0.27;

/// Frame rate of the films of a motion at `fps`: 30 fps side by side, otherwise that of [`smooth_rate`].
pub fn film_fps(layout: FilmLayout, fps: FrameRate) -> FrameRate {
    match layout {
        FilmLayout::Separate => smooth_rate(fps),
        FilmLayout::SideBySide => SIDE_BY_SIDE_FPS,
    }
}

/// Avatars and camera of the films of one speaker, of `size` px; `None` without a performance.
pub fn stage(layout: FilmLayout, shown: &[&Performance], size: [usize; 2]) -> Option<AvatarStage> {
    let appearance = Appearance::faceless();
    match layout {
        FilmLayout::Separate => AvatarStage::new(shown, &appearance, size, CAMERA),
        FilmLayout::SideBySide => AvatarStage::side_by_side(shown, &appearance, size),
    }
}

pub struct FilmScene<'a> {
    /// Performances of the avatars at the film's rate and of equal length, left to right.
    pub performances: &'a [Performance],
    pub stage: &'a AvatarStage,
    /// Sound as long as the film; `None` for a silent film.
    pub sound: Option<&'a Sound>,
    /// Number displayed during the middle third.
    pub number: Option<u16>,
}

/// Opaque name of a film with this content: 16 hex digits of a hash keyed by the seed, which do not reveal the content.
pub fn film_name(seed: u64, content: &FilmContent) -> String {
    let key = blake3::derive_key(NAME_CONTEXT, &seed.to_le_bytes());
    let FilmContent { clip, speaker, condition, motion_of, number, sound, right } = content;
    let number = number.map_or(String::new(), |number| number.to_string());
    let sound = match sound {
        FilmSound::Speech => "speech",
        FilmSound::Silence => "silence",
        FilmSound::Tones => "tones",
    };
    let mut hasher = blake3::Hasher::new_keyed(&key);
    let right = right.iter().flat_map(|right| [right.condition.as_str(), &right.motion_of]);
    for part in [clip.as_str(), speaker, condition, motion_of, &number, sound].into_iter().chain(right) {
        // The length prefix makes the concatenation of parts unambiguous.
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    hasher.finalize().to_hex().as_str()[..16].to_owned()
}

/// Checks that H.264 films, which browsers play, can be written.
///
/// # Errors
/// ffmpeg has no libx264.
pub fn check_encoder() -> Result<()> {
    ensure!(
        has_h264(),
        "ffmpeg has no libx264 encoder, and browsers cannot play its other formats: install ffmpeg with libx264 \
         (`orator doctor` shows which ffmpeg is used)"
    );
    Ok(())
}

impl FilmScene<'_> {
    /// Hash of the inputs in which films differ: number, rate, camera, skeleton, motion and sound samples.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut numbers = |values: &[f64]| {
            values.iter().for_each(|value| {
                hasher.update(&value.to_le_bytes());
            });
        };
        let fps = self.performances.first().map_or(0.0, |performance| performance.clip.fps.per_sec());
        numbers(&[f64::from(VERSION), f64::from(CRF), self.number.map_or(0.0, f64::from), fps]);
        numbers(&self.stage.camera.size.map(|px| px as f64));
        let camera = self.stage.camera;
        numbers(&[&[camera.focal_px, camera.axes.w][..], &camera.position, &camera.axes.v].concat());
        for Performance { clip, .. } in self.performances {
            clip.skeleton.joints.iter().for_each(|joint| numbers(&joint.offset));
            for frame in 0..clip.n_frames() {
                numbers(&clip.root_at(frame));
                clip.local[frame].iter().for_each(|turn| numbers(&[&[turn.w][..], &turn.v].concat()));
            }
        }
        for sample in self.sound.into_iter().flat_map(|sound| &sound.samples) {
            hasher.update(&sample.to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Writes the mp4 directly to `path`, not atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        let first = self.performances.first().context("the film has no avatar")?;
        let fps = first.clip.fps;
        let n_frames = self.performances.iter().map(|performance| performance.clip.n_frames()).min().unwrap_or(0);
        let mut view = AvatarView::on(self.stage, self.performances);
        let mut writer = VideoWriter::with_crf(path, self.stage.camera.size, fps, self.sound, CRF)?;
        for frame in 0..n_frames {
            let mut image = view.frame(frame, 0.0);
            if let Some(number) = self.number.filter(|_| 3 * frame / n_frames == 1) {
                draw_number(&mut image, number)?;
            }
            writer.push(&image)?;
        }
        writer.finish()
    }
}

fn draw_number(image: &mut Image, number: u16) -> Result<()> {
    let text = number.to_string();
    let digits = DIGIT_HEIGHT * image.height as f32;
    let width = draw::text_width(&text, digits)?;
    let [x, y] = [image.width as f32 / 2.0, image.height as f32 / 2.0];
    let [half, tall] = [width, digits].map(|length| length / 2.0 + PLATE_MARGIN * digits);
    draw::polygon(
        image,
        &[[x - half, y - tall], [x + half, y - tall], [x + half, y + tall], [x - half, y + tall]],
        [250; 3],
    )?;
    draw::text(image, &text, [x - width / 2.0, y + digits / 2.0], digits, [20; 3])
}
