//! The software renderer: area and depth of known shapes, visibility, coverage of edges, shadows.

use orator_avatar::render::light::direction;
use orator_avatar::render::{Background, Light, Mesh, PinholeCamera, Renderer, Srgb};
use orator_base::types::image::Image;

const WHITE: Light = Light { to_key: [0.0, 1.0, 0.0], key: [0.0; 3], sky: [1.0; 3], ground: [1.0; 3], rim: [0.0; 3] };

fn mesh(points: Vec<[f32; 3]>, normals: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, label: u16) -> Mesh {
    let n = points.len();
    let (colours, labels) = (vec![[0.5; 3]; n], vec![label; n]);
    Mesh { points, normals, colours, triangles, labels, gloss: 0.3, n_closed: 0 }
}

fn quad(corners: [[f32; 3]; 4], normal: [f32; 3], label: u16) -> Mesh {
    mesh(corners.to_vec(), vec![normal; 4], vec![[0, 1, 2], [0, 2, 3]], label)
}

/// A square that faces +z.
fn square(x: f32, y: f32, z: f32, half: f32, label: u16) -> Mesh {
    let corner = |dx: f32, dy: f32| [x + dx * half, y + dy * half, z];
    quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], [0.0, 0.0, 1.0], label)
}

/// A floor at height `y` that extends by `half` in each direction.
fn floor(y: f32, z: f32, half: f32) -> Mesh {
    let corner = |dx: f32, dz: f32| [dx * half, y, z + dz * half];
    quad([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)], [0.0, 1.0, 0.0], 5)
}

/// A sphere of 6 `n` x `n` patches.
fn ball(middle: [f32; 3], radius: f32, n: usize) -> Mesh {
    // Points on the faces of a cube are normalised, which needs no trigonometry.
    let side = |k: usize| k as f32 / n as f32 * 2.0 - 1.0;
    let (mut normals, mut triangles) = (Vec::new(), Vec::new());
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0f32)] {
        let first = normals.len() as u32;
        let corner = |i: usize, j: usize| {
            let mut at = [0.0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (sign, sign * side(i), side(j));
            direction(at)
        };
        normals.extend((0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))).map(|(i, j)| corner(i, j)));
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |di: usize, dj: usize| first + ((i + di) * (n + 1) + j + dj) as u32;
            triangles.extend([[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]);
        }
    }
    let points = normals.iter().map(|normal| std::array::from_fn(|k| middle[k] + radius * normal[k])).collect();
    mesh(points, normals, triangles, 3)
}

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at([200, 160], 400.0, [0.0, 0.0, 100.0], [0.0; 3], 0.0)
}

fn black() -> Background {
    Background::picture(Image::filled(200, 160, [0; 3]))
}

#[test]
fn a_sphere_has_the_right_area_and_depth() {
    let (ball, mut renderer) = (ball([0.0; 3], 12.0, 24), Renderer::new([200, 160]));
    // The difference between renderings over white and over black is the visible part of the background.
    let [white, black] = [[255; 3], [0; 3]].map(|rgb| {
        let background = Background::picture(Image::filled(200, 160, rgb));
        let image = renderer.draw(&camera(), &[&ball], &WHITE, &background);
        image.data.iter().map(|byte| Srgb::tables().linears([*byte; 3])[0] / 3.0).sum::<f32>()
    });
    let area = 200.0 * 160.0 - (white - black);
    let radius = 400.0 * 12.0 / (100.0f32 * 100.0 - 144.0).sqrt();
    assert!((area / (std::f32::consts::PI * radius * radius) - 1.0).abs() < 0.01, "{area} px");
    let (mesh, label, depth) = renderer.label_at([99.5, 79.5]).unwrap();
    assert_eq!((mesh, label), (0, 3));
    assert!((depth - 88.0).abs() < 0.1, "{depth} cm");
    assert!(renderer.label_at([99.5 + f64::from(radius) - 1.0, 79.5]).is_some());
    assert_eq!(renderer.label_at([99.5 + f64::from(radius) + 2.0, 79.5]), None);
    assert_eq!(renderer.label_at([-3.0, f64::NAN]), None);
}

#[test]
fn the_nearer_surface_is_visible_in_any_order() {
    let (near, far) = (square(2.0, 0.0, 10.0, 6.0, 1), square(-2.0, 0.0, 0.0, 9.0, 2));
    let mut renderer = Renderer::new([200, 160]);
    let one = renderer.draw(&camera(), &[&near, &far], &WHITE, &black());
    assert_eq!(renderer.label_at([105.0, 80.0]).map(|found| (found.0, found.1)), Some((0, 1)));
    let other = renderer.draw(&camera(), &[&far, &near], &WHITE, &black());
    assert_eq!(one, other);
    assert_eq!(renderer.label_at([105.0, 80.0]).map(|found| (found.0, found.1)), Some((1, 1)));
    assert_eq!(renderer.label_at([62.0, 80.0]).map(|found| found.1), Some(2));
}

#[test]
fn coverage_counts_the_samples_inside_an_edge() {
    // The left edge is 20 px from the axis: at half a pixel, or between samples.
    for (edge, samples) in [(20.5f32, 2.0), (20.25, 3.0), (20.75, 1.0), (20.0, 4.0)] {
        let left = edge / 4.0;
        let mesh = square(left + 5.0, 0.0, 0.0, 5.0, 0);
        let image = Renderer::new([200, 160]).draw(&camera(), &[&mesh], &WHITE, &black());
        // The centre of the image is between two pixels.
        let value = Srgb::tables().linears(image.pixel(120, 80))[1];
        assert!((value - 0.5 * samples / 4.0).abs() < 0.004, "{value} at {edge}");
        assert_eq!(image.pixel(119, 80)[1], 0);
    }
}

#[test]
fn a_floor_below_the_camera_is_clipped_and_has_the_right_depth() {
    let floor = floor(-20.0, 0.0, 400.0);
    let mut renderer = Renderer::new([200, 160]);
    let image = renderer.draw(&camera(), &[&floor], &WHITE, &black());
    // The far end of the floor, 500 cm away, is 16 px below the axis.
    assert_eq!((image.pixel(100, 90)[0], image.pixel(100, 100)[0]), (0, Srgb::tables().bytes([0.5; 4])[0]));
    let (_, label, depth) = renderer.label_at([100.0, 119.0]).unwrap();
    assert!(label == 5 && (depth - 200.6).abs() < 0.5, "{depth} cm");
    let bad = square(f32::NAN, 0.0, 99.0, 1.0, 0);
    assert_eq!(renderer.draw(&camera(), &[&bad], &WHITE, &black()), black().image);
}

#[test]
fn a_shadow_falls_away_from_the_light() {
    let camera = PinholeCamera::looking_at([200, 160], 250.0, [0.0, 60.0, 100.0], [0.0; 3], 0.0);
    let light =
        Light { key: [1.0; 3], sky: [0.2; 3], ground: [0.2; 3], rim: [0.0; 3], ..Light::studio([1.0, 1.0, 0.0]) };
    let (floor, ball) = (floor(0.0, 0.0, 60.0), ball([0.0, 20.0, 0.0], 6.0, 8));
    let mut renderer = Renderer::new([200, 160]);
    let together = renderer.draw(&camera, &[&floor, &ball], &light, &black());
    let on_floor = |x: f64| camera.pixel(camera.to_camera_axes([x, 0.0, 0.0])).map(f64::round);
    let at = |x: f64| together.pixel(on_floor(x)[0] as usize, on_floor(x)[1] as usize)[0];
    // The light comes from +x at 45 degrees, so from a height of 20 cm the shadow falls 20 cm towards -x.
    assert!(at(-20.0) < 140 && at(20.0) > 180 && at(-40.0).abs_diff(at(40.0)) < 12, "{} {}", at(-20.0), at(20.0));
}

#[test]
fn frames_do_not_depend_on_earlier_frames() {
    let camera = PinholeCamera::looking_at([200, 160], 250.0, [30.0, 60.0, 100.0], [0.0; 3], 0.0);
    let light = Light::studio([-0.5, 0.75, 0.6]);
    let (floor, ball) = (floor(0.0, 0.0, 60.0), ball([0.0, 12.0, 0.0], 9.0, 12));
    let background = Background::gradient([200, 160], [60; 3], [180; 3]);
    let mut renderer = Renderer::new([200, 160]);
    let image = renderer.draw(&camera, &[&floor, &ball], &light, &background);
    renderer.draw(&camera, &[&square(0.0, 0.0, 40.0, 50.0, 0)], &light, &black());
    assert_eq!(image, renderer.draw(&camera, &[&floor, &ball], &light, &background));
}
