//! Writes mp4 files: H.264 with libx264 if available, otherwise MPEG-4 part 2, with AAC audio. The bytes are
//! reproducible. The caller replaces the file atomically.

use crate::ffmpeg::source;
use anyhow::{Context, Result, ensure};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::codec::{self, Id};
use ffmpeg_next::format::{self, Pixel, Sample, sample};
use ffmpeg_next::software::scaling;
use ffmpeg_next::{ChannelLayout, Dictionary, Packet, Rational, color, encoder, frame};
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use std::path::{Path, PathBuf};

/// An mp4 file being written; it is invalid until `finish` is called.
pub struct VideoWriter {
    path: PathBuf,
    output: format::context::Output,
    size: [usize; 2],
    even: [usize; 2],
    fps: FrameRate,
    video: encoder::video::Encoder,
    scaler: scaling::Context,
    n_frames: usize,
    sound: Option<SoundTrack>,
}

struct SoundTrack {
    encoder: encoder::audio::Encoder,
    sound: Sound,
    n_sent: usize,
}

/// Constant rate factor for good quality; each increase by 6 halves the bit rate.
pub const GOOD_CRF: u32 = 18;

const VIDEO: usize = 0;
const AUDIO: usize = 1;

impl VideoWriter {
    /// Creates the mp4 `path` for images of `width` x `height` px (an odd side is extended by repeating its last row
    /// or column), with all of `sound` from time 0 on.
    pub fn create(path: &Path, width: usize, height: usize, fps: FrameRate, sound: Option<&Sound>) -> Result<Self> {
        Self::with_crf(path, [width, height], fps, sound, GOOD_CRF)
    }

    /// [`Self::create`] with another constant rate factor of libx264, 0..=51.
    pub fn with_crf(
        path: &Path,
        [width, height]: [usize; 2],
        fps: FrameRate,
        sound: Option<&Sound>,
        crf: u32,
    ) -> Result<Self> {
        source::init();
        ensure!(width > 0 && height > 0, "invalid size {width} x {height} px for the video {}", path.display());
        let even = [width, height].map(|n| n.next_multiple_of(2));
        let what = || format!("cannot write the video {}", path.display());
        let mut output = format::output_as(&source::url(path)?, "mp4").with_context(what)?;
        // SAFETY: the context is owned here; the flag omits the library version and the time of day.
        unsafe { (*output.as_mut_ptr()).flags |= ffmpeg::ffi::AVFMT_FLAG_BITEXACT };
        let video = open_video(even, fps, crf).with_context(what)?;
        output.add_stream_with(&video).with_context(what)?.set_time_base(video_tick(fps));
        let sound = match sound {
            Some(sound) if !sound.samples.is_empty() => Some(SoundTrack::open(sound).with_context(what)?),
            _ => None,
        };
        if let Some(track) = &sound {
            output.add_stream_with(&track.encoder).with_context(what)?.set_time_base(track.tick());
        }
        output.write_header_with(Dictionary::from_iter([("movflags", "+faststart")])).with_context(what)?;
        let [w, h] = [u32::try_from(even[0])?, u32::try_from(even[1])?];
        let flags = scaling::Flags::BICUBIC | scaling::Flags::ACCURATE_RND;
        let scaler = scaling::Context::get(Pixel::RGB24, w, h, Pixel::YUV420P, w, h, flags).with_context(what)?;
        let path = path.to_owned();
        Ok(Self { path, output, size: [width, height], even, fps, video, scaler, n_frames: 0, sound })
    }

    /// Appends an image, shown for one frame.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let [width, height] = self.size;
        ensure!(
            [image.width, image.height] == self.size && image.data.len() == 3 * width * height,
            "{}: image {} has {} x {} px, expected {width} x {height} px",
            self.path.display(),
            self.n_frames,
            image.width,
            image.height
        );
        let sound_until = self.fps.secs(self.n_frames + 1);
        self.encode(image, sound_until).with_context(|| format!("cannot write the video {}", self.path.display()))
    }

    /// Writes the remaining data and closes the file.
    pub fn finish(mut self) -> Result<()> {
        self.close().with_context(|| format!("cannot write the video {}", self.path.display()))
    }

    fn encode(&mut self, image: &Image, sound_until: f64) -> Result<()> {
        let [w, h] = [u32::try_from(self.even[0])?, u32::try_from(self.even[1])?];
        let mut rgb = frame::Video::new(Pixel::RGB24, w, h);
        let stride = rgb.stride(0);
        let row_bytes = 3 * image.width;
        for (row_idx, row) in rgb.data_mut(0).chunks_mut(stride).take(self.even[1]).enumerate() {
            let from = row_bytes * row_idx.min(image.height - 1);
            row[..row_bytes].copy_from_slice(&image.data[from..from + row_bytes]);
            // The padding at the end of a row is filled, since swscale reads beyond the last pixel.
            for at in row_bytes..row.len() {
                row[at] = row[at - 3];
            }
        }
        // A new frame for each image: the encoder retains the frames it was given.
        let mut yuv = frame::Video::empty();
        self.scaler.run(&rgb, &mut yuv)?;
        yuv.set_pts(Some(self.n_frames as i64));
        self.n_frames += 1;
        self.video.send_frame(&yuv)?;
        self.write_video()?;
        self.write_sound(sound_until)
    }

    fn close(&mut self) -> Result<()> {
        self.video.send_eof()?;
        self.write_video()?;
        self.write_sound(f64::INFINITY)?;
        Ok(self.output.write_trailer()?)
    }

    fn write_video(&mut self) -> Result<()> {
        let to = self.output.stream(VIDEO).context("the video stream is missing")?.time_base();
        let mut packet = Packet::empty();
        while self.video.receive_packet(&mut packet).is_ok() {
            packet.set_stream(VIDEO);
            // Encoders omit the duration, without which the last frame has no length and is dropped by readers.
            packet.set_duration(1);
            packet.rescale_ts(video_tick(self.fps), to);
            packet.write_interleaved(&mut self.output)?;
        }
        Ok(())
    }

    /// Encodes the audio up to `until` seconds; for infinity, all of it, and flushes the encoder.
    fn write_sound(&mut self, until: f64) -> Result<()> {
        let Some(track) = &mut self.sound else { return Ok(()) };
        let to = self.output.stream(AUDIO).context("the audio stream is missing")?.time_base();
        let mut packet = Packet::empty();
        let mut more = true;
        while more {
            more = track.send(until)?;
            if !more && until.is_infinite() {
                track.encoder.send_eof()?;
            }
            while track.encoder.receive_packet(&mut packet).is_ok() {
                packet.set_stream(AUDIO);
                packet.rescale_ts(track.tick(), to);
                packet.write_interleaved(&mut self.output)?;
            }
        }
        Ok(())
    }
}

impl SoundTrack {
    fn open(sound: &Sound) -> Result<Self> {
        let aac = encoder::find(Id::AAC).context("this ffmpeg has no AAC encoder")?;
        let mut context = codec::Context::new_with_codec(aac).encoder().audio()?;
        context.set_rate(i32::try_from(sound.rate)?);
        context.set_format(Sample::F32(sample::Type::Planar));
        context.set_channel_layout(ChannelLayout::MONO);
        // SAFETY: the context is owned here; ffmpeg before 7 needs the layout in both its old and its new field.
        unsafe { ffmpeg::ffi::av_channel_layout_default(&raw mut (*context.as_mut_ptr()).ch_layout, 1) };
        context.set_bit_rate(96_000);
        context.set_time_base(Rational(1, i32::try_from(sound.rate)?));
        context.set_flags(codec::Flags::GLOBAL_HEADER | codec::Flags::BITEXACT);
        let opened =
            context.open_as(aac).with_context(|| format!("AAC does not support a sample rate of {} Hz", sound.rate))?;
        Ok(Self { encoder: opened, sound: sound.clone(), n_sent: 0 })
    }

    fn tick(&self) -> Rational {
        Rational(1, self.sound.rate as i32)
    }

    /// Passes the next frame to the encoder if it ends before `until` seconds; returns false if there is none.
    fn send(&mut self, until: f64) -> Result<bool> {
        let n_until = (until * f64::from(self.sound.rate)).min(self.sound.samples.len() as f64) as usize;
        // Only the last frame may be shorter.
        let end = self.n_sent + (self.encoder.frame_size() as usize).max(1);
        let end = if until.is_infinite() { end.min(n_until) } else { end };
        if end > n_until || end == self.n_sent {
            return Ok(false);
        }
        let samples = &self.sound.samples[self.n_sent..end];
        let mut frame = frame::Audio::new(Sample::F32(sample::Type::Planar), samples.len(), ChannelLayout::MONO);
        frame.set_rate(self.sound.rate);
        frame.set_pts(Some(self.n_sent as i64));
        frame.plane_mut::<f32>(0).copy_from_slice(samples);
        self.encoder.send_frame(&frame)?;
        self.n_sent = end;
        Ok(true)
    }
}

/// Whether videos are written as H.264, which every browser plays, rather than MPEG-4 part 2, which none does.
pub fn has_h264() -> bool {
    source::init();
    encoder::find_by_name("libx264").is_some()
}

/// Opens an encoder for images of even size, with one thread so that the bytes do not depend on the number of cores.
fn open_video([width, height]: [usize; 2], fps: FrameRate, crf: u32) -> Result<encoder::video::Encoder> {
    let x264 = encoder::find_by_name("libx264");
    let codec = x264.or_else(|| encoder::find(Id::MPEG4)).context("this ffmpeg has no encoder for H.264 or MPEG-4")?;
    let mut context = codec::Context::new_with_codec(codec).encoder().video()?;
    context.set_width(u32::try_from(width)?);
    context.set_height(u32::try_from(height)?);
    context.set_format(Pixel::YUV420P);
    // The default of swscale, written explicitly so that players of large images do not assume BT.709.
    context.set_colorspace(color::Space::SMPTE170M);
    context.set_color_range(color::Range::MPEG);
    context.set_time_base(video_tick(fps));
    context.set_frame_rate(Some(Rational(i32::try_from(fps.num)?, i32::try_from(fps.den)?)));
    context.set_threading(codec::threading::Config::count(1));
    context.set_flags(codec::Flags::GLOBAL_HEADER | codec::Flags::BITEXACT);
    let (factor, crf) = (f64::from(crf), crf.to_string());
    let options: &[(&str, &str)] = match x264 {
        // The SIMD code of libx264 reads beyond the edge of very narrow images: their bytes would vary between runs.
        Some(_) if width < 128 => &[("preset", "veryfast"), ("crf", &crf), ("x264-params", "no-asm=1")],
        // Its macroblock tree reads uninitialised memory at any width.
        Some(_) => &[("preset", "veryfast"), ("crf", &crf), ("x264-params", "mbtree=0")],
        None => {
            // A quarter of a bit per pixel at good quality.
            let quality_factor = 2f64.powf((f64::from(GOOD_CRF) - factor) / 6.0);
            context.set_bit_rate((quality_factor * width as f64 * height as f64 * fps.per_sec() / 4.0) as usize);
            &[]
        }
    };
    Ok(context.open_as_with(codec, options.iter().copied().collect::<Dictionary>())?)
}

fn video_tick(fps: FrameRate) -> Rational {
    Rational(fps.den as i32, fps.num as i32)
}
