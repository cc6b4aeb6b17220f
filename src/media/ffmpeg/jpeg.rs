//! JPEG in memory: written with reproducible bytes, and read.

use anyhow::{Context, Result, ensure};
use ffmpeg_next as ffmpeg;
use ffmpeg_next::codec::{self, Id};
use ffmpeg_next::format::Pixel;
use ffmpeg_next::software::scaling;
use ffmpeg_next::{Packet, Rational, decoder, encoder, frame};
use orator_base::types::image::Image;

/// ffmpeg's quality, 1 (best) to 31: near to what cameras write at "85".
pub const QUALITY: i32 = 4;

/// Bytes of a JPEG file. Errors: a picture without pixels, an ffmpeg without the encoder.
pub fn encode(image: &Image) -> Result<Vec<u8>> {
    encode_at(image, QUALITY)
}

/// Bytes of a JPEG file of this quality, 1 (best) to 31.
pub fn encode_at(image: &Image, quality: i32) -> Result<Vec<u8>> {
    super::source::init();
    let [width, height] = [u32::try_from(image.width)?, u32::try_from(image.height)?];
    ensure!(width > 0 && height > 0 && image.data.len() == 3 * image.width * image.height, "a picture without pixels");
    let jpeg = encoder::find(Id::MJPEG).context("this ffmpeg has no JPEG encoder")?;
    let mut context = codec::Context::new_with_codec(jpeg).encoder().video()?;
    context.set_width(width);
    context.set_height(height);
    context.set_format(Pixel::YUVJ420P);
    context.set_time_base(Rational(1, 25));
    context.set_threading(codec::threading::Config::count(1));
    context.set_flags(codec::Flags::QSCALE | codec::Flags::BITEXACT);
    let quality = quality * ffmpeg::ffi::FF_QP2LAMBDA;
    // SAFETY: the context is ours and not open yet.
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
    // SAFETY: the frame is ours.
    unsafe { (*yuv.as_mut_ptr()).quality = quality };
    opened.send_frame(&yuv)?;
    opened.send_eof()?;
    let mut packet = Packet::empty();
    opened.receive_packet(&mut packet).context("the JPEG encoder gave no picture")?;
    Ok(packet.data().unwrap_or_default().to_vec())
}

/// Most pixels of a picture that is read; a header of a few bytes may claim any number.
const MOST_PIXELS: i64 = 1 << 26;

/// Picture of a JPEG file's bytes. Errors: no JPEG, a damaged one, one of more than 67 million pixels.
pub fn decode(bytes: &[u8]) -> Result<Image> {
    super::source::init();
    let jpeg = decoder::find(Id::MJPEG).context("this ffmpeg has no JPEG decoder")?;
    let mut context = codec::Context::new_with_codec(jpeg);
    context.set_threading(codec::threading::Config::count(1));
    // SAFETY: the context is ours and not open yet.
    unsafe { (*context.as_mut_ptr()).max_pixels = MOST_PIXELS };
    let mut opened = context.decoder().open_as(jpeg)?.video()?;
    opened.send_packet(&Packet::copy(bytes)).context("it is no JPEG")?;
    opened.send_eof()?;
    let mut frame = frame::Video::empty();
    opened.receive_frame(&mut frame).context("it holds no picture")?;
    let (width, height) = (frame.width(), frame.height());
    let flags = scaling::Flags::BICUBIC | scaling::Flags::ACCURATE_RND | scaling::Flags::FULL_CHR_H_INT;
    let mut scaler = scaling::Context::get(frame.format(), width, height, Pixel::RGB24, width, height, flags)?;
    let mut rgb = frame::Video::empty();
    scaler.run(&frame, &mut rgb)?;
    let (stride, row_bytes) = (rgb.stride(0), 3 * width as usize);
    let rows = rgb.data(0).chunks(stride).take(height as usize);
    let data = rows.flat_map(|row| &row[..row_bytes]).copied().collect();
    Ok(Image { width: width as usize, height: height as usize, data })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_becomes_a_small_jpeg_and_the_bytes_repeat() {
        let data = (0..3 * 121 * 80_u32).map(|i| (i % 363 / 3) as u8).collect();
        let image = Image { width: 121, height: 80, data };
        let bytes = encode(&image).unwrap();
        assert!(bytes.starts_with(&[0xff, 0xd8]) && bytes.ends_with(&[0xff, 0xd9]));
        assert!(bytes.len() < 8000, "{} bytes", bytes.len());
        assert_eq!(bytes, encode(&image).unwrap());
        assert!(encode(&Image::filled(0, 3, [0; 3])).is_err());
    }

    #[test]
    fn what_was_written_is_read_and_damage_is_an_error() {
        let data = (0..121 * 80).flat_map(|at| [(at % 121) as u8, (at / 121) as u8, 90]).collect();
        let image = Image { width: 121, height: 80, data };
        let bytes = encode(&image).unwrap();
        let read = decode(&bytes).unwrap();
        assert_eq!((read.width, read.height), (121, 80));
        let off = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b));
        let mean = image.data.iter().zip(&read.data).map(off).sum::<f64>() / image.data.len() as f64;
        assert!(mean < 4.0, "{mean}");
        assert!(decode(b"no picture").is_err() && decode(&bytes[..40]).is_err() && decode(&[]).is_err());
    }
}
