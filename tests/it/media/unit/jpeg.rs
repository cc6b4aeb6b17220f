//! Unit tests of `orator_media::ffmpeg::jpeg`.

use orator_base::types::image::Image;
use orator_media::ffmpeg::jpeg::encode;

#[test]
fn encodes_small_jpegs_with_reproducible_bytes() {
    let data = (0..3 * 121 * 80_u32).map(|i| (i % 363 / 3) as u8).collect();
    let image = Image { width: 121, height: 80, data };
    let bytes = encode(&image).unwrap();
    assert!(bytes.starts_with(&[0xff, 0xd8]) && bytes.ends_with(&[0xff, 0xd9]));
    assert!(bytes.len() < 8000, "{} bytes", bytes.len());
    assert_eq!(bytes, encode(&image).unwrap());
    assert!(encode(&Image::filled(0, 3, [0; 3])).is_err());
}
