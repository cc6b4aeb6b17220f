//! Converts decoded frames to upright RGB: colour conversion and scaling with swscale, tone mapping of HDR, rotation.

use super::filter::{HdrTransfer, ToneMapper};
use super::orientation::Orientation;
use anyhow::{Context, Result, bail};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::format::Pixel;
use ffmpeg_next::software::scaling;
use ffmpeg_next::{color, frame};
use orator_base::types::image::Image;

/// Converts the frames of one stream to images of one size; swscale's tables are reused between frames.
pub(crate) struct Converter {
    orientation: Orientation,
    /// Size of the images before rotation.
    coded_size: [usize; 2],
    scaler: Option<Scaler>,
}

impl Converter {
    /// Creates a converter to upright images of `size` (width, height in px).
    pub(crate) fn new(size: [usize; 2], orientation: Orientation) -> Self {
        Self { orientation, coded_size: orientation.upright_size(size), scaler: None }
    }

    /// Converts `frame` to an upright image of the size of this converter.
    pub(crate) fn picture(&mut self, frame: &frame::Video) -> Result<Image> {
        let source = FrameFormat::of(frame);
        if self.scaler.as_ref().is_none_or(|scaler| scaler.source != source) {
            self.scaler = Some(Scaler::new(source, self.coded_size)?);
        }
        let coded = self.scaler.as_mut().context("the scaler is missing")?.convert(frame)?;
        Ok(self.orientation.apply(coded))
    }
}

/// Properties of a frame that swscale needs.
#[derive(Clone, Copy, PartialEq)]
struct FrameFormat {
    format: Pixel,
    size: [u32; 2],
    /// Colour matrix number of swscale, and 1 for full-range values.
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

/// swscale context from frames of one format to RGB of one size.
struct Scaler {
    source: FrameFormat,
    size: [usize; 2],
    context: scaling::Context,
    rgb: frame::Video,
    tone_mapper: Option<ToneMapper>,
}

// SAFETY: swscale's context is plain memory that is not bound to a thread, and only `convert(&mut self)` uses it.
unsafe impl Send for Scaler {}

impl Scaler {
    fn new(source: FrameFormat, size: [usize; 2]) -> Result<Self> {
        let [width, height] = source.size;
        let is_downscaling = 2 * size[0] <= width as usize;
        let flags = if is_downscaling { scaling::Flags::AREA } else { scaling::Flags::BICUBIC };
        let (w, h) = (u32::try_from(size[0])?, u32::try_from(size[1])?);
        if w == 0 || h == 0 {
            bail!("invalid image size {w} x {h} px: expected at least 1 x 1 px");
        }
        let tone_mapper =
            source.hdr.map(|transfer| ToneMapper::new(transfer, source.has_wide_gamut, [w, h])).transpose()?;
        let rgb = if tone_mapper.is_some() { ToneMapper::FORMAT } else { Pixel::RGB24 };
        let mut context = scaling::Context::get(source.format, width, height, rgb, w, h, flags)
            .with_context(|| format!("cannot convert {:?} images to RGB", source.format))?;
        // SAFETY: the context is live, and the tables are static memory of swscale; one = 1.0 in 16.16.
        unsafe {
            let table = ffmpeg::ffi::sws_getCoefficients(source.colour[0]);
            let one = 1 << 16;
            ffmpeg::ffi::sws_setColorspaceDetails(context.as_mut_ptr(), table, source.colour[1], table, 0, 0, one, one);
        }
        Ok(Self { source, size, context, rgb: frame::Video::empty(), tone_mapper })
    }

    fn convert(&mut self, frame: &frame::Video) -> Result<Image> {
        let [width, height] = self.size;
        self.context.run(frame, &mut self.rgb).context("swscale failed")?;
        let tone_mapped = self.tone_mapper.as_mut().map(|tone_mapper| tone_mapper.map(&self.rgb)).transpose()?;
        let rgb = tone_mapped.as_ref().unwrap_or(&self.rgb);
        // Rows of the frame are padded to a multiple of 32 bytes.
        let mut data = Vec::with_capacity(3 * width * height);
        rgb.data(0).chunks(rgb.stride(0)).take(height).for_each(|row| data.extend_from_slice(&row[..3 * width]));
        Ok(Image { width, height, data })
    }
}

/// Colour matrix number of swscale; unspecified colour spaces are treated as BT.601, its default.
fn colour_matrix(space: color::Space) -> i32 {
    match space {
        color::Space::BT709 => ffmpeg::ffi::SWS_CS_ITU709,
        color::Space::BT2020NCL | color::Space::BT2020CL => ffmpeg::ffi::SWS_CS_BT2020,
        color::Space::SMPTE240M => ffmpeg::ffi::SWS_CS_SMPTE240M,
        color::Space::FCC => ffmpeg::ffi::SWS_CS_FCC,
        _ => ffmpeg::ffi::SWS_CS_DEFAULT,
    }
}
