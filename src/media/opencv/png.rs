//! PNG reader and writer.

use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::types::image::Image;
use png::{BitDepth, ColorType, Decoder, Encoder, Transformations};
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

/// Writes an image in place; callers that need an atomic replacement use `stage::workdir::replace` or a stage folder.
pub fn write(path: &Path, image: &Image) -> Result<()> {
    let attempt = || -> Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        let (width, height) = (u32::try_from(image.width)?, u32::try_from(image.height)?);
        let mut encoder = Encoder::new(&mut file, width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&image.data)?;
        writer.finish()?;
        Ok(file.flush()?)
    };
    attempt().with_context(|| format!("cannot write the image {}", path.display()))
}

/// Reads any PNG as 8-bit RGB; transparency is dropped.
pub fn read(path: &Path) -> Result<Image> {
    let read = || -> Result<Image> {
        let mut decoder = Decoder::new(BufReader::new(input::open(path)?));
        decoder.set_transformations(Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let size = reader.output_buffer_size().context("the image is too large")?;
        ensure!(size <= 1 << 30, "more than 1 GiB of pixels");
        let mut data = vec![0; size];
        let info = reader.next_frame(&mut data)?;
        data.truncate(info.buffer_size());
        let rgb = |pixel: &[u8]| match *pixel {
            [grey] | [grey, _] => [grey; 3],
            [r, g, b, ..] => [r, g, b],
            [] => [0; 3],
        };
        let channels = info.color_type.samples();
        let data = if channels == 3 { data } else { data.chunks_exact(channels).flat_map(rgb).collect() };
        Ok(Image { width: info.width as usize, height: info.height as usize, data })
    };
    read().with_context(|| format!("cannot read the image {}", path.display()))
}
