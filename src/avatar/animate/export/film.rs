//! Motion as a film: the avatar, alone or next to the source video or another motion, above the waveform of the audio
//! with a position marker. The times and names of limbs that were not detected in the video are marked below.

use super::film_avatar::{AvatarView, FilmCamera};
use super::film_source::SourceCamera;
use crate::animate::draw::figure::{INK, PAPER, mix};
use crate::animate::performance::{AnimationReport, Performance};
use anyhow::{Context as _, ensure};
use orator_base::stage::progress::Progress;
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_media::opencv::draw;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::mpsc::sync_channel;

/// Left, top, right, bottom of an area, px.
type FilmArea = [f32; 4];
/// Size of the image, px.
pub const SIZE: [usize; 2] = [1280, 720];
const FULL_AREA: FilmArea = [0.0, 0.0, 1280.0, 620.0];
const HALF_AREAS: [FilmArea; 2] = [[30.0, 66.0, 630.0, 610.0], [650.0, 66.0, 1250.0, 610.0]];
const WAVE_AREA: FilmArea = [40.0, 636.0, 1240.0, 684.0];
const TEXT_PX: f32 = 11.0;
/// Colour of the marks of limbs that were not detected.
const HIDDEN: [u8; 3] = [190, 60, 40];
/// Left edge of the text about visibility, px.
const HIDDEN_TEXT_PX: f32 = 260.0;
/// Opening of the mouth at the loudest frame, 0..1.
const MAX_MOUTH_OPENING: f64 = 0.7;
/// Number of frames drawn ahead of the encoder.
const N_BUFFERED: usize = 3;

/// Minimum default frame rate of a film; NTSC's 29.97 is accepted.
const MIN_FPS: f64 = 29.9;

/// Default rate of a film of a motion: the motion's rate, or its smallest multiple of at least 30 fps, so that every
/// frame of the motion is a frame of the film. If the multiple exceeds 32 bits, the rate is unchanged.
pub fn smooth_rate(fps: FrameRate) -> FrameRate {
    let times = (MIN_FPS / fps.per_sec()).ceil().clamp(1.0, 1000.0);
    fps.num.checked_mul(times as u32).map_or(fps, |num| FrameRate::new(num, fps.den))
}

#[derive(Clone, Copy, Debug)]
pub struct FilmSource<'a> {
    pub performance: &'a Performance,
    pub camera: FilmCamera,
    pub sound: Option<&'a Sound>,
    pub second_panel: SecondPanel<'a>,
}

/// Content of the second half of the image.
#[derive(Clone, Copy, Debug, Default)]
pub enum SecondPanel<'a> {
    /// No second half: the avatar fills the image.
    #[default]
    Itself,
    /// Frames of a video from `from_secs` on. If its camera is given, the avatar is drawn over the person in the video.
    Video { path: &'a Path, from_secs: f64, camera: Option<&'a SourceCamera> },
    /// Another avatar at the same size; the labels of the two, the other one last.
    Motion { performance: &'a Performance, labels: [&'a str; 2] },
}

pub struct Film<'a> {
    fps: FrameRate,
    n_frames: usize,
    report: &'a AnimationReport,
    /// Frames in which a limb of the performance was not detected.
    hidden: BTreeMap<&'static str, Vec<[usize; 2]>>,
    panels: Vec<LabelledPanel<'a>>,
    overlay: Option<VideoOverlay<'a>>,
    /// Loudness of each column of the waveform, 0..1; empty without audio.
    wave: Vec<f32>,
    /// Loudness of each frame, 0..1; empty without audio.
    voice: Vec<f32>,
}

struct LabelledPanel<'a> {
    performance: &'a Performance,
    view: AvatarView<'a>,
    /// Top left corner of the view, px.
    corner: [usize; 2],
    label: &'a str,
    /// Left edge of the label, px.
    label_px: f32,
}

impl<'a> LabelledPanel<'a> {
    /// Panel of the first of the `shown` performances, framed so that all of them fit.
    fn new(shown: &[&'a Performance], camera: FilmCamera, area: FilmArea, label: &'a str) -> Self {
        let [left, top, right, bottom] = area.map(|px| px as usize);
        let view = AvatarView::new(shown[0], shown, [right - left, bottom - top], camera);
        let label_px = (area[0] + area[2]) / 2.0 - 40.0;
        Self { performance: shown[0], view, corner: [left, top], label, label_px }
    }
}

impl<'a> Film<'a> {
    /// Film with a fixed view in which every frame of the body fits.
    pub fn new(content: FilmSource<'a>) -> Self {
        let FilmSource { performance, camera, sound, second_panel } = content;
        let panel = |shown: &[&'a Performance], area, label| LabelledPanel::new(shown, camera, area, label);
        let panels = match second_panel {
            SecondPanel::Video { camera: Some(_), .. } => Vec::new(),
            SecondPanel::Itself => vec![panel(&[performance], FULL_AREA, "")],
            SecondPanel::Video { camera: None, .. } => vec![panel(&[performance], HALF_AREAS[1], "")],
            SecondPanel::Motion { performance: other, labels } => vec![
                panel(&[performance, other], HALF_AREAS[0], labels[0]),
                panel(&[other, performance], HALF_AREAS[1], labels[1]),
            ],
        };
        let overlay = match second_panel {
            SecondPanel::Video { path, from_secs, camera: Some(camera) } => {
                Some(VideoOverlay { performance, path, from_secs, camera, open: None })
            }
            _ => None,
        };
        let (fps, n_frames) = (performance.clip.fps, performance.clip.n_frames());
        let secs = fps.secs(n_frames);
        let loudness = |n_parts: usize| sound.map(|sound| loudness(sound, secs, n_parts)).unwrap_or_default();
        let wave = loudness(((WAVE_AREA[2] - WAVE_AREA[0]) / COLUMN_PX) as usize);
        let (report, voice) = (&performance.report, loudness(n_frames));
        Self { fps, n_frames, report, hidden: report.hidden_ranges(n_frames), panels, overlay, wave, voice }
    }

    /// Image of one frame, `SIZE` px; the area of a separate video is left empty.
    pub fn frame(&mut self, frame_idx: usize) -> anyhow::Result<Image> {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let secs = self.fps.secs(frame_idx);
        let mouth = self.voice.get(frame_idx).map_or(0.0, |loudness| MAX_MOUTH_OPENING * f64::from(*loudness));
        for LabelledPanel { performance, view, corner, label, label_px } in &mut self.panels {
            // The nearest frame in time of the other motion; none after its end.
            let clip = &performance.clip;
            let shown = if clip.fps == self.fps { frame_idx } else { (secs * clip.fps.per_sec()).round() as usize };
            if shown < clip.n_frames() {
                draw::paste(&mut image, &view.frame(shown, mouth), *corner);
            }
            draw::text(&mut image, label, [*label_px, 50.0], TEXT_PX, INK)?;
        }
        if let Some(overlay) = &mut self.overlay {
            overlay.draw(&mut image, frame_idx, mouth)?;
        }
        self.draw_wave(&mut image, frame_idx)?;
        self.draw_visibility(&mut image, frame_idx)?;
        let clock = format!("{} / {}", clock(secs), clock(self.fps.secs(self.n_frames)));
        draw::text(&mut image, &clock, [WAVE_AREA[0], 706.0], TEXT_PX, INK)?;
        Ok(image)
    }

    fn draw_visibility(&self, image: &mut Image, frame_idx: usize) -> anyhow::Result<()> {
        let [left, _, right, bottom] = WAVE_AREA;
        let at = |frame: usize| [left + (right - left) * frame as f32 / self.n_frames.max(1) as f32, bottom + 5.0];
        for &[start, end] in self.hidden.values().flatten() {
            draw::line(image, at(start), at(end), 3.0, HIDDEN)?;
        }
        let limbs = self.report.hidden_limbs(frame_idx, self.n_frames);
        let hidden = (!limbs.is_empty()).then(|| format!("not visible: {}", limbs.join(", ")));
        let fingers = self.report.fingers_unusable.then(|| "fingers unusable".to_owned());
        let notes: Vec<String> = fingers.into_iter().chain(hidden).collect();
        draw::text(image, &notes.join("; "), [HIDDEN_TEXT_PX, 706.0], TEXT_PX, HIDDEN)
    }

    fn draw_wave(&self, image: &mut Image, frame_idx: usize) -> anyhow::Result<()> {
        let [left, top, right, bottom] = WAVE_AREA;
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

/// Writes the film as an mp4 with audio directly to `path`; callers wrap it in `stage::workdir::replace`. Frames are
/// drawn on a separate thread while earlier ones are encoded.
///
/// # Errors
/// A video cannot be read or is too short, or the film cannot be written.
pub fn write(path: &Path, content: FilmSource, progress: &dyn Progress) -> anyhow::Result<()> {
    let FilmSource { performance, sound, second_panel, .. } = content;
    let (fps, n_frames) = (performance.clip.fps, performance.clip.n_frames());
    let mut footage = match second_panel {
        SecondPanel::Video { path, from_secs, camera: None } => {
            Some(FilmFootage::open(path, fps, from_secs, HALF_AREAS[0])?)
        }
        _ => None,
    };
    let task = progress.begin("drawing", n_frames as u64);
    let mut writer = VideoWriter::create(path, SIZE[0], SIZE[1], fps, sound)?;
    let (sender, pictures) = sync_channel(N_BUFFERED);
    std::thread::scope(|scope| -> anyhow::Result<()> {
        scope.spawn(move || {
            let mut film = Film::new(content);
            // Sending fails if the writer has failed.
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

/// Avatar drawn over the video from which its motion was lifted; frames are drawn in order.
struct VideoOverlay<'a> {
    performance: &'a Performance,
    path: &'a Path,
    from_secs: f64,
    camera: &'a SourceCamera,
    open: Option<(FilmFootage, Box<AvatarView<'a>>)>,
}

impl VideoOverlay<'_> {
    /// Draws the next frame of the video with the avatar; does nothing after the end of the video.
    fn draw(&mut self, image: &mut Image, frame_idx: usize, mouth: f64) -> anyhow::Result<()> {
        let (footage, view) = match &mut self.open {
            Some(open) => open,
            closed => {
                let footage = FilmFootage::open(self.path, self.performance.clip.fps, self.from_secs, FULL_AREA)?;
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

/// Frames of a video, synchronised with a motion.
struct FilmFootage {
    frames: FrameReader,
    area: FilmArea,
    /// Width and height of its frames in the film, px.
    size: [usize; 2],
    ended: bool,
}

impl FilmFootage {
    fn open(path: &Path, fps: FrameRate, from_secs: f64, area: FilmArea) -> anyhow::Result<Self> {
        ensure!(
            from_secs.is_finite() && from_secs >= 0.0,
            "invalid start {from_secs} s of the video: expected seconds >= 0"
        );
        let mut frames = FrameReader::open(path, fps)?;
        for _ in 0..(from_secs * fps.per_sec()).round() as u64 {
            frames.advance()?.with_context(|| {
                let secs = frames.duration_secs();
                format!("{} lasts {secs:.1} s: expected a start before its end, got {from_secs} s", path.display())
            })?;
        }
        let [left, top, right, bottom] = area;
        let [width, height] = frames.image_size().map(|px| px as f32);
        let scale = ((right - left) / width).min((bottom - top) / height);
        let size = [width, height].map(|px| ((px * scale) as usize).max(2));
        Ok(Self { frames, area, size, ended: false })
    }

    /// Draws the next frame into its area; does nothing after the last one.
    fn show(&mut self, image: &mut Image) -> anyhow::Result<()> {
        if let Some(picture) = self.picture()? {
            self.paste(image, &picture);
        }
        Ok(())
    }

    /// The next frame; `None` after the last one.
    fn picture(&mut self) -> anyhow::Result<Option<Image>> {
        self.ended = self.ended || self.frames.advance()?.is_none();
        if self.ended { Ok(None) } else { Ok(Some(self.frames.picture(Some(self.size))?)) }
    }

    /// Draws an image centred in the area.
    fn paste(&self, image: &mut Image, picture: &Image) {
        let [left, top, right, bottom] = self.area.map(|px| px as usize);
        let (x0, y0) = (left + (right - left - picture.width) / 2, top + (bottom - top - picture.height) / 2);
        draw::paste(image, picture, [x0, y0]);
    }
}

/// Width of a column of the waveform, px.
const COLUMN_PX: f32 = 4.0;

/// Root mean square of the audio in `n_parts` equal parts of `secs` seconds, with maximum 1; 0 after its end.
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
