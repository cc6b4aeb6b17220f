//! Images of a video as a stream at the dataset rate, by presentation time: output frame n shows the source frame
//! nearest to n / rate, the earlier one if two are equally near. Only shown frames are converted. Time 0 is the first
//! frame that decodes. The last frame lasts as long as its packet states (or one source frame; ten minutes at most),
//! which determines `duration_secs` and the number of output frames, `FrameRate::frames_in(duration_secs)`. All
//! images have the size of the first; others are scaled, with black bars for another aspect ratio.

use super::decode::StreamDecoder;
use super::filter::{HdrTransfer, deinterlaced};
use super::orientation::Orientation;
use super::picture::Converter;
use super::probe::{self, ProbedMedia};
use super::source::{self, MAX_GAP_SECS, MAX_SECS, UnreadableMedia};
use anyhow::{Context, Result, bail};
use ffmpeg_next::frame;
use orator_base::types::image::{Image, PictureOptions};
use orator_base::types::time::FrameRate;
use std::path::{Path, PathBuf};

/// Maximum number of cached converters, one per image size.
const MAX_CONVERTERS: usize = 8;
/// Decoding starts at least this long before a seek position, seconds: images there may refer to earlier ones.
const LEAD_SECS: f64 = 1.0;
/// Relative difference below which two aspect ratios are equal.
const ASPECT_TOLERANCE: f64 = 0.01;

/// An image at the dataset rate.
#[derive(Clone, Debug)]
pub struct TimedFrame {
    pub frame_idx: usize,
    /// RGB, upright.
    pub image: Image,
    /// Presentation time of the source frame, seconds from the first one.
    pub source_secs: f64,
    /// Whether it shows the same source frame as the previous output frame.
    pub repeated: bool,
}

/// Times of an output frame, without its image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTime {
    pub frame_idx: usize,
    pub source_secs: f64,
    pub repeated: bool,
    /// Change of the coded image size since the previous output frame.
    pub resize: Resize,
    /// Whether another recording of a file of joined recordings begins since the previous output frame.
    pub is_join: bool,
}

/// Change of the image size within a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Resize {
    /// The size is unchanged.
    #[default]
    None,
    /// The aspect ratio is unchanged, so relative positions remain valid.
    Scaled,
    /// The aspect ratio has changed.
    Reshaped,
}

/// A source frame and its time in ticks from the first one.
struct SourceFrame {
    frame: frame::Video,
    ticks: i64,
}

/// Stream of the images of a video at one rate. As an iterator it yields full-size images; `advance` and `picture`
/// return times only and images on demand.
pub struct FrameReader {
    path: PathBuf,
    fps: FrameRate,
    decode: StreamDecoder,
    info: ProbedMedia,
    orientation: Orientation,
    options: PictureOptions,
    image_size: [usize; 2],
    converters: Vec<([usize; 2], Converter)>,
    /// Timestamp of the first frame, in ticks of the stream.
    origin: i64,
    /// The shown frame, and its neighbours.
    before: Option<frame::Video>,
    shown: SourceFrame,
    following: Option<SourceFrame>,
    next_idx: usize,
    /// Output frame at which reading stops.
    end_idx: usize,
    last_shown: Option<i64>,
    last_size: [usize; 2],
    /// Latest plausible time, seconds.
    latest_secs: f64,
    n_misplaced: usize,
    failed: bool,
}

impl FrameReader {
    /// Opens the video `path` with one decoder thread and decodes its first frames.
    ///
    /// # Errors
    ///
    /// The file cannot be opened, has no images, or none that decodes.
    pub fn open(path: &Path, fps: FrameRate) -> Result<Self> {
        Self::open_with(path, fps, 1)
    }

    /// Opens with `threads` decoder threads (0: one per core), which do not change the result.
    pub fn open_with(path: &Path, fps: FrameRate, threads: usize) -> Result<Self> {
        let input = source::open(path)?;
        let info = probe::describe(&input);
        let stream = source::video_stream(&input).ok_or_else(|| {
            UnreadableMedia(format!("{} has no video: expected a video, not only audio", path.display()))
        })?;
        let orientation = Orientation::from_stream(&stream);
        let latest_secs = source::latest_secs(&input, &stream);
        let stream_idx = stream.index();
        let mut decode = StreamDecoder::new(path, input, stream_idx, threads)?;
        let mut first = frame::Video::empty();
        if !decode.next(&mut first)? {
            let reason = decode.damage().unwrap_or_else(|| "it contains no complete image".to_owned());
            let name = path.display();
            let problem = format!("no image of {name} can be decoded ({reason}): copy or download it again");
            return Err(UnreadableMedia(problem).into());
        }
        let image_size = upright_size(&first, orientation);
        let origin = first.timestamp().unwrap_or(0);
        let shown = SourceFrame { frame: first, ticks: 0 };
        let mut reader = Self {
            path: path.to_owned(),
            fps,
            decode,
            info,
            orientation,
            options: PictureOptions::default(),
            image_size,
            converters: Vec::new(),
            origin,
            before: None,
            shown,
            following: None,
            next_idx: 0,
            end_idx: usize::MAX,
            last_shown: None,
            last_size: image_size,
            latest_secs,
            n_misplaced: 0,
            failed: false,
        };
        reader.following = reader.decode_after(0)?;
        Ok(reader)
    }

    /// Seeks to output frame `frame_idx`, which shows the source frame at `source_secs` as reported by an earlier
    /// reading from the start: `advance` returns it next, as not repeated. Decoding starts at a seek point at least
    /// `LEAD_SECS` earlier, so that few frames are decoded in vain.
    ///
    /// # Errors
    ///
    /// The container cannot seek, or has no source frame at exactly that time.
    pub fn seek(&mut self, frame_idx: usize, source_secs: f64) -> Result<()> {
        let ticks = (source_secs / f64::from(self.decode.time_base())).round() as i64;
        let lead = (LEAD_SECS / f64::from(self.decode.time_base())).round() as i64;
        self.decode.seek(self.origin.saturating_add(ticks - lead))?;
        let (mut before, mut frame) = (None, frame::Video::empty());
        loop {
            let found = if self.decode.next(&mut frame)? { frame.timestamp() } else { None };
            match found.map(|at| at.saturating_sub(self.origin)) {
                Some(at) if at < ticks => before = Some(std::mem::replace(&mut frame, frame::Video::empty())),
                Some(at) if at == ticks => break,
                _ => bail!("{} has no image at {source_secs:.3} s after a seek", self.path.display()),
            }
        }
        (self.before, self.shown) = (before, SourceFrame { frame, ticks });
        self.following = self.decode_after(ticks)?;
        (self.next_idx, self.last_shown) = (frame_idx, None);
        Ok(())
    }

    /// Stops before output frame `frame_idx`, or earlier at the end of the video.
    #[must_use]
    pub fn until(self, frame_idx: usize) -> Self {
        Self { end_idx: frame_idx, ..self }
    }

    /// Uses `options` for the following images.
    #[must_use]
    pub fn with_options(mut self, options: PictureOptions) -> Self {
        if options.mirrored != self.options.mirrored {
            self.orientation = self.orientation.mirrored();
        }
        self.options = options;
        self.converters.clear();
        self
    }

    /// Name of the HDR transfer function of the shown frame, `PQ` or `HLG`; `None` for SDR.
    pub fn hdr(&self) -> Option<&'static str> {
        HdrTransfer::of(&self.shown.frame).map(HdrTransfer::name)
    }

    /// Whether the shown frame is flagged as interlaced.
    pub fn is_flagged_interlaced(&self) -> bool {
        self.shown.frame.is_interlaced()
    }

    pub fn info(&self) -> &ProbedMedia {
        &self.info
    }

    /// Width and height of the upright images, px.
    pub fn image_size(&self) -> [usize; 2] {
        self.image_size
    }

    /// Number of frames expected from the headers; `None` if they do not state it reliably.
    pub fn expected_frames(&self) -> Option<usize> {
        let stated = self.info.duration_secs.filter(|_| !self.decode.may_jump());
        stated.map(|secs| self.fps.frames_in(secs))
    }

    /// Times at which another recording begins in a file of joined recordings, as far as it has been read, seconds.
    pub fn joins_secs(&self) -> Vec<f64> {
        self.decode.joins().iter().map(|join| self.secs(join.saturating_sub(self.origin))).collect()
    }

    /// Length of the video read so far, seconds; its total length once all frames have been read.
    pub fn duration_secs(&self) -> f64 {
        let last = self.following.as_ref().unwrap_or(&self.shown);
        self.secs(last.ticks) + self.secs_of(last).min(MAX_GAP_SECS)
    }

    /// Description of damage in a video that could be read; complete after the last frame.
    pub fn damage(&self) -> Option<String> {
        let misplaced = (self.n_misplaced > 0).then(|| format!("{} frames with impossible times", self.n_misplaced));
        let last = self.secs_of(self.following.as_ref().unwrap_or(&self.shown));
        let endless = (last > MAX_GAP_SECS).then(|| format!("the last picture claims to last {last:.0} s"));
        let read = self.duration_secs();
        let is_complete = self.following.is_none() && self.decode.joins().is_empty();
        let stated = self.info.duration_secs.filter(|stated| is_complete && *stated > read + 1.0);
        let short = stated.map(|stated| format!("pictures end at {read:.2} s of {stated:.2} s"));
        let parts: Vec<String> =
            self.decode.damage().into_iter().chain(misplaced).chain(endless).chain(short).collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// Times of the next output frame, whose image `picture` then returns; `None` at the end.
    pub fn advance(&mut self) -> Result<Option<FrameTime>> {
        let frame_idx = self.next_idx;
        if frame_idx >= self.end_idx {
            return Ok(None);
        }
        while let Some(following) = &self.following {
            if self.is_before_middle(frame_idx, self.shown.ticks, following.ticks) {
                break;
            }
            let ticks = following.ticks;
            let after = self.decode_after(ticks)?;
            if let Some(shown) = std::mem::replace(&mut self.following, after) {
                self.before = Some(std::mem::replace(&mut self.shown, shown).frame);
            }
        }
        if self.following.is_none() && frame_idx >= self.fps.frames_in(self.duration_secs()) {
            return Ok(None);
        }
        self.next_idx += 1;
        let shown = self.shown.ticks;
        let last = self.last_shown.replace(shown);
        let is_new =
            |join: &i64| last.is_some_and(|last| (last + 1..=shown).contains(&join.saturating_sub(self.origin)));
        let is_join = self.decode.joins().iter().any(is_new);
        let (repeated, resize) = (last == Some(shown), self.resize());
        Ok(Some(FrameTime { frame_idx, source_secs: self.secs(shown), repeated, resize, is_join }))
    }

    /// The shown image, upright, in full size or scaled to `size` (width, height in px).
    pub fn picture(&mut self, size: Option<[usize; 2]>) -> Result<Image> {
        let size = size.unwrap_or(self.image_size);
        let fitted_size = self.fitted_size(size);
        let at = self.converters.iter().position(|(of, _)| *of == fitted_size).unwrap_or_else(|| {
            if self.converters.len() == MAX_CONVERTERS {
                self.converters.clear();
            }
            self.converters.push((fitted_size, Converter::new(fitted_size, self.orientation)));
            self.converters.len() - 1
        });
        let (shown, after) = (&self.shown.frame, self.following.as_ref().map(|following| &following.frame));
        let picture = if self.options.deinterlace {
            let frame = deinterlaced(self.before.as_ref(), shown, after);
            frame.and_then(|frame| self.converters[at].1.picture(&frame))
        } else {
            self.converters[at].1.picture(shown)
        };
        let picture =
            picture.with_context(|| format!("{}, at {:.3} s", self.path.display(), self.secs(self.shown.ticks)))?;
        Ok(if fitted_size == size { picture } else { picture.framed(size) })
    }

    /// Size of the shown frame within an image of `size`: smaller if its aspect ratio differs from the first frame's.
    fn fitted_size(&self, size: [usize; 2]) -> [usize; 2] {
        let shown = upright_size(&self.shown.frame, self.orientation);
        if has_same_aspect(shown, self.image_size) {
            return size;
        }
        let ratios = [0, 1].map(|axis| shown[axis].max(1) as f64 / self.image_size[axis].max(1) as f64);
        let max_ratio = ratios[0].max(ratios[1]);
        [0, 1].map(|axis| ((size[axis] as f64 * ratios[axis] / max_ratio).round() as usize).clamp(1, size[axis].max(1)))
    }

    /// Change of size since the previous output frame.
    fn resize(&mut self) -> Resize {
        let size = upright_size(&self.shown.frame, self.orientation);
        let before = std::mem::replace(&mut self.last_size, size);
        match (before == size, has_same_aspect(before, size)) {
            (true, _) => Resize::None,
            (false, true) => Resize::Scaled,
            (false, false) => Resize::Reshaped,
        }
    }

    /// Whether output frame `frame_idx` is no farther from `early` than from `late` (ticks), in exact arithmetic.
    fn is_before_middle(&self, frame_idx: usize, early: i64, late: i64) -> bool {
        let base = self.decode.time_base();
        let (num, den) = (i128::from(base.numerator().max(1)), i128::from(base.denominator().max(1)));
        // 2 n den_fps / num_fps <= (early + late) num / den
        let twice_target = 2 * frame_idx as i128 * i128::from(self.fps.den) * den;
        twice_target <= (i128::from(early) + i128::from(late)) * num * i128::from(self.fps.num)
    }

    /// Decodes the next source frame later than `ticks`.
    fn decode_after(&mut self, ticks: i64) -> Result<Option<SourceFrame>> {
        let mut frame = frame::Video::empty();
        while self.decode.next(&mut frame)? {
            // A frame without a timestamp follows the previous frame after that frame's duration.
            let own = frame.timestamp().map(|at| at.saturating_sub(self.origin));
            let at = own.unwrap_or_else(|| ticks.saturating_add(frame.packet().duration.max(1)));
            let is_near = self.secs(at.saturating_sub(ticks)) <= MAX_GAP_SECS;
            // The stated length of joined recordings is that of one of them.
            let latest_secs = if self.decode.joins().is_empty() { self.latest_secs } else { MAX_SECS };
            if at > ticks && is_near && self.secs(at) < latest_secs {
                return Ok(Some(SourceFrame { frame, ticks: at }));
            }
            self.n_misplaced += 1;
        }
        Ok(None)
    }

    fn secs(&self, ticks: i64) -> f64 {
        ticks as f64 * f64::from(self.decode.time_base())
    }

    /// Duration of a source frame as stated by the file, or else from the average frame rate.
    fn secs_of(&self, source: &SourceFrame) -> f64 {
        let stated = self.secs(source.frame.packet().duration);
        if stated > 0.0 {
            return stated;
        }
        let video = self.info.video.as_ref();
        video.and_then(|video| video.fps).unwrap_or(self.fps).secs(1)
    }
}

/// Width and height of a frame, upright and with square pixels.
fn upright_size(frame: &frame::Video, orientation: Orientation) -> [usize; 2] {
    let size = [frame.width() as usize, frame.height() as usize];
    orientation.upright_size(probe::square_pixels(size, frame.aspect_ratio()))
}

fn has_same_aspect(a: [usize; 2], b: [usize; 2]) -> bool {
    let [a, b] = [a, b].map(|[width, height]| width.max(1) as f64 / height.max(1) as f64);
    (a / b - 1.0).abs() < ASPECT_TOLERANCE
}

impl Iterator for FrameReader {
    type Item = Result<TimedFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let frame = self.advance().and_then(|time| {
            let Some(FrameTime { frame_idx, source_secs, repeated, .. }) = time else { return Ok(None) };
            Ok(Some(TimedFrame { frame_idx, image: self.picture(None)?, source_secs, repeated }))
        });
        self.failed = frame.is_err();
        frame.transpose()
    }
}
