//! Unit tests of `orator_media::opencv::png`.

use orator_base::types::image::Image;
use orator_media::opencv::png::{read, write};

#[test]
fn image_round_trips_through_png() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let image = Image { width: 3, height: 2, data: (0..18).collect() };
    write(&path, &image).unwrap();
    assert_eq!(read(&path).unwrap(), image);
    std::fs::write(&path, b"not an image").unwrap();
    assert!(format!("{:#}", read(&path).unwrap_err()).contains("a.png"));
}
