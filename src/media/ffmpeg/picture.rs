//! Conversion of a decoded frame to an upright RGB `Image`: colour conversion and scaling by swscale, tone mapping of
//! HDR, deinterlacing, rotation.

use super::deinterlace;
use super::orientation::Orientation;
use super::tone_map::{HdrTransfer, ToneMapper};
use anyhow::{Context, Result, bail};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::Pixel;
use ffmpeg_next::software::scaling;
use ffmpeg_next::{color, frame};
use orator_base::types::image::{Image, PictureOptions};

/// Converter of one stream's frames to pictures of one size; swscale's tables are kept between frames.
pub(crate) struct Converter {
    orientation: Orientation,
    deinterlace: bool,
    /// Size of the pictures before rotation.
    coded_size: [usize; 2],
    scaler: Option<Scaler>,
}

impl Converter {
    /// Pictures of `size` (width, height in px, upright).
    pub fn new(size: [usize; 2], orientation: Orientation, options: PictureOptions) -> Self {
        let coded_size = orientation.upright_size(size);
        Self { orientation, deinterlace: options.deinterlace, coded_size, scaler: None }
    }

    /// `frame`, upright, in the size this converter was made for. Of an interlaced frame at its full height both fields
    /// are converted by themselves, so that their colours do not mix; any other height is scaled from the first field.
    pub fn picture(&mut self, frame: &frame::Video) -> Result<Image> {
        let [width, height] = self.coded_size;
        let fields = if self.deinterlace { deinterlace::fields(frame) } else { None };
        let coded = match fields {
            None => self.convert(frame, [width, height])?,
            Some([top, bottom]) => {
                let keeps_top = frame.is_top_first() || !frame.is_interlaced();
                if height == frame.height() as usize {
                    let fields =
                        [self.convert(&top, [width, height / 2])?, self.convert(&bottom, [width, height / 2])?];
                    deinterlace::interpolate(&deinterlace::woven(&fields), keeps_top)
                } else {
                    self.convert(if keeps_top { &top } else { &bottom }, [width, height])?
                }
            }
        };
        Ok(self.orientation.apply(coded))
    }

    fn convert(&mut self, frame: &frame::Video, size: [usize; 2]) -> Result<Image> {
        let source = FrameFormat::of(frame);
        if self.scaler.as_ref().is_none_or(|scaler| scaler.source != source || scaler.size != size) {
            self.scaler = Some(Scaler::new(source, size)?);
        }
        self.scaler.as_mut().context("the scaler was just made")?.convert(frame)
    }
}

/// What swscale must know of a frame.
#[derive(Clone, Copy, PartialEq)]
struct FrameFormat {
    format: Pixel,
    size: [u32; 2],
    /// Matrix number of swscale, and whether the values use the full range.
    colour: [i32; 2],
    hdr: Option<HdrTransfer>,
    has_wide_gamut: bool,
}

impl FrameFormat {
    fn of(frame: &frame::Video) -> Self {
        Self {
            format: frame.format(),
            size: [frame.width(), frame.height()],
            colour: [colour_matrix(frame.color_space()), i32::from(frame.color_range() == color::Range::JPEG)],
            hdr: HdrTransfer::of(frame),
            has_wide_gamut: frame.color_primaries() == color::Primaries::BT2020,
        }
    }
}

/// swscale for frames of one format to RGB of one size.
struct Scaler {
    source: FrameFormat,
    size: [usize; 2],
    context: scaling::Context,
    rgb: frame::Video,
    tones: Option<ToneMapper>,
}

// SAFETY: swscale's context is plain memory without ties to a thread, and only `convert(&mut self)` touches it.
unsafe impl Send for Scaler {}

impl Scaler {
    fn new(source: FrameFormat, size: [usize; 2]) -> Result<Self> {
        let [width, height] = source.size;
        let shrinks = 2 * size[0] <= width as usize;
        let flags = if shrinks { scaling::Flags::AREA } else { scaling::Flags::BICUBIC };
        let (w, h) = (u32::try_from(size[0])?, u32::try_from(size[1])?);
        if w == 0 || h == 0 {
            bail!("a picture of {w} x {h} px was asked for");
        }
        let tones = source.hdr.map(|transfer| ToneMapper::new(transfer, source.has_wide_gamut));
        let rgb = if tones.is_some() { Pixel::RGB48LE } else { Pixel::RGB24 };
        let mut context = scaling::Context::get(source.format, width, height, rgb, w, h, flags)
            .with_context(|| format!("cannot turn {:?} pictures into RGB", source.format))?;
        // SAFETY: the context is live, the tables are swscale's own static ones; one = 1.0 in 16.16.
        unsafe {
            let table = ffmpeg::ffi::sws_getCoefficients(source.colour[0]);
            let one = 1 << 16;
            ffmpeg::ffi::sws_setColorspaceDetails(context.as_mut_ptr(), table, source.colour[1], table, 0, 0, one, one);
        }
        Ok(Self { source, size, context, rgb: frame::Video::empty(), tones })
    }

    fn convert(&mut self, frame: &frame::Video) -> Result<Image> {
        let [width, height] = self.size;
        self.context.run(frame, &mut self.rgb).context("swscale failed")?;
        let mut data = Vec::with_capacity(3 * width * height);
        // Rows of the frame are padded to a multiple of 32 bytes.
        for row in self.rgb.data(0).chunks(self.rgb.stride(0)).take(height) {
            match &self.tones {
                None => data.extend_from_slice(&row[..3 * width]),
                Some(tones) => tones.push_row(&row[..6 * width], &mut data),
            }
        }
        Ok(Image { width, height, data })
    }
}

/// Matrix number of swscale; unspecified spaces are BT.601, its default.
fn colour_matrix(space: color::Space) -> i32 {
    match space {
        color::Space::BT709 => ffmpeg::ffi::SWS_CS_ITU709,
        color::Space::BT2020NCL | color::Space::BT2020CL => ffmpeg::ffi::SWS_CS_BT2020,
        color::Space::SMPTE240M => ffmpeg::ffi::SWS_CS_SMPTE240M,
        color::Space::FCC => ffmpeg::ffi::SWS_CS_FCC,
        _ => ffmpeg::ffi::SWS_CS_DEFAULT,
    }
}
