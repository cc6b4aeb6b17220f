//! JPEG encoding in memory, with reproducible bytes.

use anyhow::{Context, Result, ensure};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::codec::{self, Id};
use ffmpeg_next::format::Pixel;
use ffmpeg_next::software::scaling;
use ffmpeg_next::{Packet, Rational, encoder, frame};
use orator_base::types::image::Image;

/// ffmpeg's quality scale, 1 (best) to 31; about what cameras write at quality 85.
const QUALITY: i32 = 4;

pub fn encode(image: &Image) -> Result<Vec<u8>> {
    super::source::init();
    let [width, height] = [u32::try_from(image.width)?, u32::try_from(image.height)?];
    ensure!(width > 0 && height > 0 && image.data.len() == 3 * image.width * image.height, "the image has no pixels");
    let jpeg = encoder::find(Id::MJPEG).context("this ffmpeg has no JPEG encoder")?;
    let mut context = codec::Context::new_with_codec(jpeg).encoder().video()?;
    context.set_width(width);
    context.set_height(height);
    context.set_format(Pixel::YUVJ420P);
    context.set_time_base(Rational(1, 25));
    context.set_threading(codec::threading::Config::count(1));
    context.set_flags(codec::Flags::QSCALE | codec::Flags::BITEXACT);
    let quality = QUALITY * ffmpeg::ffi::FF_QP2LAMBDA;
    // SAFETY: the context is owned here and not open yet.
    unsafe { (*context.as_mut_ptr()).global_quality = quality };
    let mut opened = context.open_as(jpeg)?;
    let mut rgb = frame::Video::new(Pixel::RGB24, width, height);
    let (stride, row_bytes) = (rgb.stride(0), 3 * image.width);
    for (to, from) in rgb.data_mut(0).chunks_mut(stride).zip(image.data.chunks_exact(row_bytes)) {
        to.fill(0);
        to[..row_bytes].copy_from_slice(from);
    }
    let flags = scaling::Flags::BICUBIC | scaling::Flags::ACCURATE_RND;
    let mut scaler = scaling::Context::get(Pixel::RGB24, width, height, Pixel::YUVJ420P, width, height, flags)?;
    let mut yuv = frame::Video::empty();
    scaler.run(&rgb, &mut yuv)?;
    yuv.set_pts(Some(0));
    // SAFETY: the frame is owned here.
    unsafe { (*yuv.as_mut_ptr()).quality = quality };
    opened.send_frame(&yuv)?;
    opened.send_eof()?;
    let mut packet = Packet::empty();
    opened.receive_packet(&mut packet).context("the JPEG encoder returned no image")?;
    Ok(packet.data().unwrap_or_default().to_vec())
}
