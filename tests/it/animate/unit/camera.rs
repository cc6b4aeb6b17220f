//! Unit tests of `orator_avatar::render::camera`.

use orator_avatar::render::camera::PinholeCamera;
use orator_base::math::vec3::Vec3;

#[test]
fn the_target_is_in_the_middle_up_is_up_and_a_figure_from_the_front_has_its_left_on_the_right() {
    // The subject faces +z with its left side at +x.
    let camera = PinholeCamera::looking_at([640, 480], 700.0, [0.0, 140.0, 200.0], [0.0, 120.0, 0.0], 0.0);
    let px = |point: Vec3| camera.pixel(camera.to_camera_axes(point));
    let [x, y] = px([0.0, 120.0, 0.0]);
    assert!((x - 319.5).abs() < 1e-9 && (y - 239.5).abs() < 1e-9);
    assert!(px([0.0, 160.0, 0.0])[1] < y - 50.0);
    assert!(px([20.0, 120.0, 0.0])[0] > x + 50.0);
}

#[test]
fn a_roll_turns_the_picture_about_its_middle() {
    let camera = |roll: f64| PinholeCamera::looking_at([200, 200], 300.0, [0.0, 0.0, 100.0], [0.0; 3], roll);
    let px = |roll: f64| camera(roll).pixel(camera(roll).to_camera_axes([0.0, 10.0, 0.0]));
    let (upright, rolled) = (px(0.0), px(0.1));
    assert!((upright[0] - 99.5).abs() < 1e-9 && upright[1] < 99.5);
    // Rolling the camera clockwise turns the image of the world anticlockwise.
    assert!(rolled[0] < 99.0, "{rolled:?}");
}
