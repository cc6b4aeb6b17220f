//! Motion as a film: the avatar, alone or beside the source video or another motion; below, the sound's waveform with a
//! position marker.

use super::film_avatar::{AvatarView, FilmCamera};
use super::film_source::SourceCamera;
use crate::animate::draw::figure::{INK, PAPER, mix};
use crate::animate::performance::Performance;
use anyhow::{Context as _, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_media::opencv::draw;
use std::path::Path;
use std::sync::mpsc::sync_channel;

/// Left, top, right, bottom of an area, px.
type FilmArea = [f32; 4];
/// Size of the picture in px.
pub const SIZE: [usize; 2] = [1280, 720];
const WHOLE: FilmArea = [0.0, 0.0, 1280.0, 620.0];
const HALVES: [FilmArea; 2] = [[30.0, 66.0, 630.0, 610.0], [650.0, 66.0, 1250.0, 610.0]];
const WAVE: FilmArea = [40.0, 636.0, 1240.0, 684.0];
const WORDS_PX: f32 = 11.0;
/// How far the mouth is open at the loudest, 0..1.
const WIDEST_MOUTH: f64 = 0.7;
/// Frames that are drawn ahead of the encoder.
const N_AHEAD: usize = 3;

/// Least rate of a film that is given none, frames a second; NTSC's 29.97 passes.
const LEAST_FPS: f64 = 29.9;

/// Rate of a film of a motion: the motion's own, or its smallest multiple from 30 frames a second on, so that every
/// frame of the motion is one of the film's. A rate whose multiple is no number of 32 bits stays.
pub fn smooth_rate(fps: FrameRate) -> FrameRate {
    let times = (LEAST_FPS / fps.per_sec()).ceil().clamp(1.0, 1000.0);
    fps.num.checked_mul(times as u32).map_or(fps, |num| FrameRate::new(num, fps.den))
}

/// What a film shows.
#[derive(Clone, Copy, Debug)]
pub struct FilmSource<'a> {
    pub performance: &'a Performance,
    pub camera: FilmCamera,
    pub sound: Option<&'a Sound>,
    pub beside: SecondPanel<'a>,
}

/// Content of the picture's second half.
#[derive(Clone, Copy, Debug, Default)]
pub enum SecondPanel<'a> {
    /// None: the avatar fills the picture.
    #[default]
    Itself,
    /// Frames of a video from `from_secs` on; given its camera, the avatar is drawn over them at the position of the person.
    Video { path: &'a Path, from_secs: f64, camera: Option<&'a SourceCamera> },
    /// Another avatar, drawn in the same size; the labels of the two, the other last.
    Motion { performance: &'a Performance, labels: [&'a str; 2] },
}

/// Renderer of a film's frames.
pub struct Film<'a> {
    fps: FrameRate,
    n_frames: usize,
    panels: Vec<LabelledPanel<'a>>,
    over: Option<OverVideo<'a>>,
    /// Loudness of each column of the waveform, 0..1; empty without sound.
    wave: Vec<f32>,
    /// Loudness of each frame, 0..1; empty without sound.
    voice: Vec<f32>,
}

/// One avatar in the picture.
struct LabelledPanel<'a> {
    performance: &'a Performance,
    view: AvatarView<'a>,
    /// Left top corner of the view, px.
    corner: [usize; 2],
    label: &'a str,
    /// Left edge of the label, px.
    label_px: f32,
}

impl<'a> LabelledPanel<'a> {
    /// Panel of the first of the `shown` performances, in which all of them fit.
    fn new(shown: &[&'a Performance], camera: FilmCamera, area: FilmArea, label: &'a str) -> Self {
        let [left, top, right, bottom] = area.map(|px| px as usize);
        let view = AvatarView::new(shown[0], shown, [right - left, bottom - top], camera);
        let label_px = (area[0] + area[2]) / 2.0 - 40.0;
        Self { performance: shown[0], view, corner: [left, top], label, label_px }
    }
}

impl<'a> Film<'a> {
    /// Film with one view in which every frame of the body fits.
    pub fn new(content: FilmSource<'a>) -> Self {
        let FilmSource { performance, camera, sound, beside } = content;
        let panel = |shown: &[&'a Performance], area, label| LabelledPanel::new(shown, camera, area, label);
        let panels = match beside {
            SecondPanel::Video { camera: Some(_), .. } => Vec::new(),
            SecondPanel::Itself => vec![panel(&[performance], WHOLE, "")],
            SecondPanel::Video { camera: None, .. } => vec![panel(&[performance], HALVES[1], "")],
            SecondPanel::Motion { performance: other, labels } => vec![
                panel(&[performance, other], HALVES[0], labels[0]),
                panel(&[other, performance], HALVES[1], labels[1]),
            ],
        };
        let over = match beside {
            SecondPanel::Video { path, from_secs, camera: Some(camera) } => {
                Some(OverVideo { performance, path, from_secs, camera, open: None })
            }
            _ => None,
        };
        let (fps, n_frames) = (performance.clip.fps, performance.clip.n_frames());
        let secs = fps.secs(n_frames);
        let loudness = |n_parts: usize| sound.map(|sound| loudness(sound, secs, n_parts)).unwrap_or_default();
        let wave = loudness(((WAVE[2] - WAVE[0]) / COLUMN_PX) as usize);
        Self { fps, n_frames, panels, over, wave, voice: loudness(n_frames) }
    }

    /// Picture of one frame, `SIZE` px; an empty area in place of a video.
    pub fn frame(&mut self, frame_idx: usize) -> anyhow::Result<Image> {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let secs = self.fps.secs(frame_idx);
        let mouth = self.voice.get(frame_idx).map_or(0.0, |loudness| WIDEST_MOUTH * f64::from(*loudness));
        for LabelledPanel { performance, view, corner, label, label_px } in &mut self.panels {
            // The other motion's frame nearest in time, none after its end.
            let clip = &performance.clip;
            let shown = if clip.fps == self.fps { frame_idx } else { (secs * clip.fps.per_sec()).round() as usize };
            if shown < clip.n_frames() {
                draw::paste(&mut image, &view.frame(shown, mouth), *corner);
            }
            draw::text(&mut image, label, [*label_px, 50.0], WORDS_PX, INK)?;
        }
        if let Some(over) = &mut self.over {
            over.draw(&mut image, frame_idx, mouth)?;
        }
        self.draw_wave(&mut image, frame_idx)?;
        let clock = format!("{} / {}", clock(secs), clock(self.fps.secs(self.n_frames)));
        draw::text(&mut image, &clock, [WAVE[0], 706.0], WORDS_PX, INK)?;
        Ok(image)
    }

    fn draw_wave(&self, image: &mut Image, frame_idx: usize) -> anyhow::Result<()> {
        let [left, top, right, bottom] = WAVE;
        let middle = (top + bottom) / 2.0;
        let faint = mix(INK, PAPER, 0.65);
        let now = left + (right - left) * (frame_idx as f32 + 0.5) / self.n_frames.max(1) as f32;
        draw::line(image, [left, middle], [right, middle], 1.0, faint)?;
        for (column, height) in self.wave.iter().enumerate() {
            let x = left + COLUMN_PX * (column as f32 + 0.5);
            let half = (height * (bottom - top) / 2.0).max(0.5);
            let rgb = if x < now { INK } else { faint };
            draw::line(image, [x, middle - half], [x, middle + half], 2.0, rgb)?;
        }
        draw::line(image, [now, top - 4.0], [now, bottom + 4.0], 2.0, mix(INK, [0; 3], 0.4))
    }
}

/// Writes the film as an mp4 with the sound, in place; callers wrap it in `stage::workdir::replace`. Frames are drawn on
/// a thread of their own while those before are encoded.
pub fn write(path: &Path, content: FilmSource, progress: &dyn Progress) -> anyhow::Result<()> {
    let FilmSource { performance, sound, beside, .. } = content;
    let (fps, n_frames) = (performance.clip.fps, performance.clip.n_frames());
    let mut footage = match beside {
        SecondPanel::Video { path, from_secs, camera: None } => {
            Some(FilmFootage::open(path, fps, from_secs, HALVES[0])?)
        }
        _ => None,
    };
    let task = progress.begin("drawing", n_frames as u64);
    let mut writer = VideoWriter::create(path, SIZE[0], SIZE[1], fps, sound)?;
    let (sender, pictures) = sync_channel(N_AHEAD);
    std::thread::scope(|scope| -> anyhow::Result<()> {
        scope.spawn(move || {
            let mut film = Film::new(content);
            // A writer that failed takes no more.
            let _ = (0..n_frames).try_for_each(|frame_idx| sender.send(film.frame(frame_idx)));
        });
        for picture in pictures {
            let mut image = picture?;
            if let Some(footage) = &mut footage {
                footage.show(&mut image)?;
            }
            writer.push(&image)?;
            task.advance(1);
        }
        Ok(())
    })?;
    writer.finish()
}

/// Avatar before the video that its motion was lifted from; frames are drawn one after the other.
struct OverVideo<'a> {
    performance: &'a Performance,
    path: &'a Path,
    from_secs: f64,
    camera: &'a SourceCamera,
    open: Option<(FilmFootage, Box<AvatarView<'a>>)>,
}

impl OverVideo<'_> {
    /// Draws the next frame of the video with the avatar; nothing after the video's last one.
    fn draw(&mut self, image: &mut Image, frame_idx: usize, mouth: f64) -> anyhow::Result<()> {
        let (footage, view) = match &mut self.open {
            Some(open) => open,
            closed => {
                let footage = FilmFootage::open(self.path, self.performance.clip.fps, self.from_secs, WHOLE)?;
                let view = AvatarView::new(self.performance, &[], footage.size, FilmCamera::Front);
                closed.insert((footage, Box::new(view)))
            }
        };
        if let Some(picture) = footage.picture()? {
            footage.paste(image, &view.frame_over(picture, frame_idx, mouth, self.camera));
        }
        Ok(())
    }
}

/// Frames of a video in step with a motion.
struct FilmFootage {
    frames: FrameReader,
    area: FilmArea,
    /// Width and height of its pictures in the film, px.
    size: [usize; 2],
    ended: bool,
}

impl FilmFootage {
    fn open(path: &Path, fps: FrameRate, from_secs: f64, area: FilmArea) -> anyhow::Result<Self> {
        ensure!(from_secs.is_finite() && from_secs >= 0.0, "a video cannot be shown from second {from_secs} on");
        let mut frames = FrameReader::open(path, fps)?;
        for _ in 0..(from_secs * fps.per_sec()).round() as u64 {
            frames.advance()?.with_context(|| {
                let secs = frames.duration_secs();
                format!("{} lasts {secs:.1} s: it cannot be shown from second {from_secs} on", path.display())
            })?;
        }
        let [left, top, right, bottom] = area;
        let [width, height] = frames.image_size().map(|px| px as f32);
        let scale = ((right - left) / width).min((bottom - top) / height);
        let size = [width, height].map(|px| ((px * scale) as usize).max(2));
        Ok(Self { frames, area, size, ended: false })
    }

    /// Draws the next frame into its area; nothing after the last one.
    fn show(&mut self, image: &mut Image) -> anyhow::Result<()> {
        if let Some(picture) = self.picture()? {
            self.paste(image, &picture);
        }
        Ok(())
    }

    /// Next frame; none after the last one.
    fn picture(&mut self) -> anyhow::Result<Option<Image>> {
        self.ended = self.ended || self.frames.advance()?.is_none();
        if self.ended { Ok(None) } else { Ok(Some(self.frames.picture(Some(self.size))?)) }
    }

    /// Puts a picture in the middle of the area.
    fn paste(&self, image: &mut Image, picture: &Image) {
        let [left, top, right, bottom] = self.area.map(|px| px as usize);
        let (x0, y0) = (left + (right - left - picture.width) / 2, top + (bottom - top - picture.height) / 2);
        draw::paste(image, picture, [x0, y0]);
    }
}

/// Width of a column of the wave.
const COLUMN_PX: f32 = 4.0;

/// Root mean square of the sound in `n_parts` equal parts of a time, the loudest 1; 0 after its end.
fn loudness(sound: &Sound, secs: f64, n_parts: usize) -> Vec<f32> {
    let samples = secs * f64::from(sound.rate) / n_parts as f64;
    let mut parts: Vec<f32> = (0..n_parts)
        .map(|part| {
            let at = |part: usize| ((part as f64 * samples) as usize).min(sound.samples.len());
            let part = &sound.samples[at(part)..at(part + 1)];
            (part.iter().map(|v| v * v).sum::<f32>() / part.len().max(1) as f32).sqrt()
        })
        .collect();
    let loudest = parts.iter().copied().fold(1e-4, f32::max);
    parts.iter_mut().for_each(|part| *part /= loudest);
    parts
}

/// Time as minutes and seconds: `1:05.3`.
fn clock(secs: f64) -> String {
    let tenths = (secs * 10.0).round() as u64;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_has_thirty_frames_and_every_one_of_its_motion() {
        let rates = [(15, 1, 30, 1), (25, 1, 50, 1), (24, 1, 48, 1), (30_000, 1001, 30_000, 1001), (10, 1, 30, 1)];
        for (num, den, film_num, film_den) in rates {
            assert_eq!(smooth_rate(FrameRate::new(num, den)), FrameRate::new(film_num, film_den));
        }
        assert_eq!(smooth_rate(FrameRate::new(120, 1)), FrameRate::new(120, 1));
        let huge = FrameRate::new(u32::MAX, u32::MAX - 1);
        assert_eq!(smooth_rate(huge), huge);
    }
}
