//! Unit tests of `orator_base::types::image`.

use orator_base::types::image::{Image, PixelArea};

#[test]
fn crop_is_clipped_to_the_image() {
    let image = Image { width: 3, height: 2, data: (0..18).collect() };
    let area = |x, y, width, height| PixelArea { x, y, width, height };
    assert_eq!(image.cropped(area(0, 0, 3, 2)), image);
    assert_eq!(image.cropped(area(1, 1, 9, 9)).data, (12..18).collect::<Vec<u8>>());
    assert_eq!(image.cropped(area(7, 7, 1, 1)).data, [0; 0]);
    let framed = image.framed([5, 4]);
    assert_eq!((framed.width, framed.height, framed.pixel(0, 0), framed.pixel(1, 1)), (5, 4, [0; 3], [0, 1, 2]));
    assert_eq!(framed.cropped(area(1, 1, 3, 2)), image);
    assert_eq!(image.framed([3, 2]), image);
}
