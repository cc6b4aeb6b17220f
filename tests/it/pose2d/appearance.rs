//! Appearance of persons.

use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use orator_media::opencv::draw;
use orator_pipeline::pose2d::appearance::BodyColours;
use orator_pipeline::pose2d::decode::ScoredPoint;
use orator_pipeline::pose2d::patch::colours;

fn person(shirt: [u8; 3], light: f32, x: f64) -> (Image, [ScoredPoint; 17]) {
    let lit = |rgb: [u8; 3]| rgb.map(|part| (f32::from(part) * light) as u8);
    let mut image = Image::filled(320, 240, lit([90, 90, 90]));
    let at = |dx: f32, dy: f32| [x as f32 + dx, 100.0 + dy];
    draw::polygon(&mut image, &[at(-40.0, 0.0), at(40.0, 0.0), at(40.0, 100.0), at(-40.0, 100.0)], lit(shirt)).unwrap();
    draw::circle(&mut image, at(0.0, -40.0), 22.0, lit([220, 180, 150])).unwrap();
    let mut body = [[0.0; 3]; 17];
    body[coco::NOSE] = [x, 60.0, 0.9];
    body[coco::L_SHOULDER] = [x + 35.0, 102.0, 0.9];
    body[coco::R_SHOULDER] = [x - 35.0, 102.0, 0.9];
    (image, body)
}

#[test]
fn clothes_distinguish_persons_at_any_position_and_light() {
    let of = |(image, body): (Image, [ScoredPoint; 17])| BodyColours::measure(&image, &body, 0.3).unwrap();
    let red = of(person([180, 40, 40], 1.0, 100.0));
    let same = red.distance(&of(person([180, 40, 40], 0.9, 200.0)));
    let other = red.distance(&of(person([40, 60, 160], 1.0, 100.0)));
    assert!(same < 8.0 && other > 4.0 * same, "{same} {other}");
    let mut followed = red.clone();
    (0..99).for_each(|_| followed.move_towards(&of(person([40, 60, 160], 1.0, 100.0)), 0.1));
    assert!(followed.distance(&red) > 0.99 * other);
}

#[test]
fn without_shoulders_there_is_no_appearance() {
    let (image, mut body) = person([1, 2, 3], 1.0, 100.0);
    body[coco::L_SHOULDER][2] = 0.1;
    assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
    body[coco::L_SHOULDER] = [f64::NAN, f64::NAN, 0.9];
    assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
}

#[test]
fn cells_are_means_and_edges_are_repeated() {
    let mut image = Image::filled(8, 8, [0; 3]);
    image.data.as_chunks_mut::<3>().0.iter_mut().enumerate().for_each(|(at, p)| *p = [10 * (at % 8) as u8; 3]);
    let found = colours(&image, [0.0, 0.0, 8.0, 8.0], [2, 1]);
    assert_eq!(found, [[15.0; 3], [55.0; 3]]);
    assert_eq!(colours(&image, [-100.0, 2.0, 10.0, 2.0], [1, 1]), [[0.0; 3]]);
    assert_eq!(colours(&image, [f64::NAN; 4], [1, 1]), [[0.0; 3]]);
    assert_eq!(colours(&Image::filled(0, 0, [0; 3]), [0.0; 4], [2, 2]), [[0.0; 3]; 4]);
}
