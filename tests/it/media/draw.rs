//! Drawing into images.

use orator_base::types::image::Image;
use orator_media::opencv::draw::{capsule, circle, line, polygon, text, text_width};

const WHITE: [u8; 3] = [255; 3];
const RED: [u8; 3] = [200, 10, 20];

#[test]
fn shapes_are_drawn_at_their_position_in_their_colour() {
    let mut image = Image::filled(60, 40, WHITE);
    circle(&mut image, [15.0, 20.0], 6.0, RED).unwrap();
    assert_eq!(image.pixel(15, 20), RED);
    assert_eq!(image.pixel(24, 20), WHITE);
    line(&mut image, [30.0, 5.0], [30.0, 35.0], 3.0, [1, 2, 3]).unwrap();
    assert_eq!(image.pixel(30, 20), [1, 2, 3]);
    polygon(&mut image, &[[40.0, 10.0], [55.0, 10.0], [55.0, 30.0], [40.0, 30.0]], RED).unwrap();
    assert_eq!(image.pixel(48, 20), RED);
}

#[test]
fn capsule_covers_its_area() {
    let mut image = Image::filled(200, 100, WHITE);
    capsule(&mut image, [50.0, 50.0], 20.0, [150.0, 50.0], 10.0, [0; 3]).unwrap();
    let drawn_area: f64 = image.data.chunks(3).map(|p| 1.0 - f64::from(p[0]) / 255.0).sum();
    // Trapezium between the tangents, plus the circle sectors outside it.
    let (d, big, small) = (100.0f64, 20.0f64, 10.0f64);
    let tangent_angle = ((big - small) / d).acos();
    let tangent = (d * d - (big - small).powi(2)).sqrt();
    let area =
        tangent * (big + small) + (std::f64::consts::PI - tangent_angle) * big * big + tangent_angle * small * small;
    // OpenCV blurs edges about half a pixel outwards.
    let area = area + 0.6 * (2.0 * tangent + std::f64::consts::PI * (big + small));
    assert!((drawn_area / area - 1.0).abs() < 0.02, "{drawn_area} against {area}");
    assert_eq!((image.pixel(32, 50), image.pixel(158, 50)), ([0; 3], [0; 3]));
    assert_eq!((image.pixel(27, 50), image.pixel(163, 50)), (WHITE, WHITE));
}

#[test]
fn out_of_range_and_non_finite_points_draw_nothing() {
    let mut image = Image::filled(20, 10, WHITE);
    circle(&mut image, [f32::NAN, 5.0], 3.0, RED).unwrap();
    line(&mut image, [5.0, 5.0], [f32::INFINITY, 5.0], 3.0, RED).unwrap();
    capsule(&mut image, [5.0, 5.0], 2.0, [f32::NAN, 5.0], 2.0, RED).unwrap();
    circle(&mut image, [1e9, -1e9], 3.0, RED).unwrap();
    text(&mut image, "far", [500.0, 500.0], 12.0, RED).unwrap();
    assert_eq!(image, Image::filled(20, 10, WHITE));
    line(&mut Image::filled(0, 0, WHITE), [0.0; 2], [1.0; 2], 1.0, RED).unwrap();
}

#[test]
fn text_width_matches_the_drawn_text() {
    let mut image = Image::filled(300, 40, WHITE);
    text(&mut image, "12.3 s", [10.0, 30.0], 20.0, [0; 3]).unwrap();
    let dark = |x: usize| (0..40).any(|y| image.pixel(x, y)[0] < 128);
    let last = (0..300).rev().find(|&x| dark(x)).unwrap() as f32;
    assert!((last - 10.0 - text_width("12.3 s", 20.0).unwrap()).abs() < 6.0);
    assert!(!(0..10).any(dark));
}
