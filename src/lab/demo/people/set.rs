//! Room around a rendered person: floor, walls, chair, desk and furniture, or a plain background.

use super::condition::Seat;
use super::solid::{Colour, Solids};
use crate::demo::scenery;
use orator_avatar::render::{Background, Light, Mesh, PinholeCamera};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add};
use orator_base::types::image::Image;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Half width of the room, height of its walls, half width of the furnished area, and extent of the floor in front of
/// the person, cm.
const ROOM_HALF_WIDTH: f64 = 600.0;
const WALL_HEIGHT: f64 = 290.0;
const FURNISHED_HALF_WIDTH: f64 = 480.0;
const FLOOR_IN_FRONT: f64 = 1000.0;

/// Seat and position of a body.
#[derive(Clone, Copy, Debug)]
pub struct SeatPosition {
    pub seat: Seat,
    /// Hips of the upright body, cm; unit of the body (`Build::unit`); rotation to its left, radians.
    pub hips: Vec3,
    pub unit: f64,
    pub turn: f64,
    /// Height of the desk top, and distance from the hips to its near edge, cm.
    pub desk: [f64; 2],
}

/// Background of a clip with the seats of all persons in it.
pub fn background(camera: &PinholeCamera, light: &Light, seats: &[SeatPosition], rng: &mut ChaCha8Rng) -> Background {
    let mut solids = Solids::new(0.15);
    let wall: Colour = muted(rng, 0.12, 0.75);
    let behind = -rng.random_range(75.0..230.0);
    match rng.random_range(0..10) {
        0..2 => floor(&mut solids, behind, muted(rng, 0.2, 0.6), rng),
        2..5 => {
            floor(&mut solids, behind, muted(rng, 0.08, 0.5), rng);
            back_wall(&mut solids, behind, wall);
        }
        _ => {
            floor(&mut solids, behind, [0.22, 0.15, 0.09], rng);
            back_wall(&mut solids, behind, wall);
            furniture(&mut solids, behind, rng);
        }
    }
    for seat in seats {
        furnish_seat(&mut solids, seat, rng);
    }
    let mut meshes: Vec<Mesh> = vec![solids.mesh];
    for seat in seats.iter().filter(|seat| seat.seat == Seat::Desk) {
        meshes.push(desk(seat, rng));
    }
    let grey = rng.random_range(70..190u8);
    let mut bytes = || std::array::from_fn(|_| grey + rng.random_range(0..60u8) - 30);
    let (top, bottom): ([u8; 3], [u8; 3]) = (bytes(), bytes());
    let plain: Image = Background::gradient(camera.size, top, bottom).image;
    scenery::background(camera, &meshes.iter().collect::<Vec<_>>(), light, plain)
}

/// A random colour of low saturation.
fn muted(rng: &mut ChaCha8Rng, dark: f32, light: f32) -> Colour {
    let grey = rng.random_range(dark..light);
    std::array::from_fn(|_| grey * rng.random_range(0.8..1.2))
}

fn floor(solids: &mut Solids, behind: f64, colour: Colour, rng: &mut ChaCha8Rng) {
    let shades: Vec<f32> = (0..24).map(|_| rng.random_range(0.88..1.1)).collect();
    let shade = |i: usize, k: usize| colour.map(|v| v * shades[(7 * i + 3 * k) % shades.len()]);
    let corner = [-ROOM_HALF_WIDTH, 0.0, FLOOR_IN_FRONT];
    solids.tiles(corner, [[2.0 * ROOM_HALF_WIDTH, 0.0, 0.0], [0.0, 0.0, behind - FLOOR_IN_FRONT]], [24, 16], shade);
}

fn back_wall(solids: &mut Solids, behind: f64, colour: Colour) {
    let shade = |_: usize, k: usize| colour.map(|v| v * (1.06 - 0.03 * k as f32));
    solids.tiles(
        [-ROOM_HALF_WIDTH, 0.0, behind],
        [[2.0 * ROOM_HALF_WIDTH, 0.0, 0.0], [0.0, WALL_HEIGHT, 0.0]],
        [20, 4],
        shade,
    );
    // Skirting board.
    solids.between([-ROOM_HALF_WIDTH, 0.0, behind], [ROOM_HALF_WIDTH, 9.0, behind + 1.5], colour.map(|v| 0.5 * v));
}

fn furniture(solids: &mut Solids, behind: f64, rng: &mut ChaCha8Rng) {
    let mut x = -FURNISHED_HALF_WIDTH + rng.random_range(0.0..80.0);
    while x < FURNISHED_HALF_WIDTH - 100.0 {
        let wide = rng.random_range(70.0..140.0);
        match rng.random_range(0..5) {
            0 | 1 => shelf(solids, [x, 0.0, behind], wide, rng),
            2 => window(solids, [x, 95.0, behind], wide, rng),
            3 => framed_picture(solids, [x, rng.random_range(120.0..150.0), behind], 0.7 * wide, rng),
            _ => lamp(solids, [x + wide / 2.0, 0.0, behind + 35.0], rng),
        }
        x += wide + rng.random_range(10.0..90.0);
    }
}

fn shelf(solids: &mut Solids, at: Vec3, wide: f64, rng: &mut ChaCha8Rng) {
    let wood: Colour = [[0.3, 0.19, 0.1], [0.6, 0.6, 0.58], [0.1, 0.06, 0.04]][rng.random_range(0..3)];
    let (deep, high) = (rng.random_range(24.0..34.0), rng.random_range(110.0..215.0));
    for side in [0.0, wide - 2.5] {
        solids.between(add(at, [side, 0.0, 0.0]), add(at, [side + 2.5, high, deep]), wood);
    }
    let n_boards = (high / 36.0) as usize;
    for board in 0..=n_boards {
        let y = high * board as f64 / n_boards as f64;
        solids.between(add(at, [0.0, y - 1.2, 0.0]), add(at, [wide, y + 1.2, deep]), wood);
        let mut x = 4.0;
        while board < n_boards && x < wide - 10.0 {
            let thick = rng.random_range(1.8..6.0);
            let tall = rng.random_range(16.0..29.0);
            if rng.random_bool(0.8) {
                let colour = std::array::from_fn(|_| rng.random_range(0.02..0.6));
                let front = rng.random_range(14.0..deep - 3.0);
                solids.between(add(at, [x, y + 1.2, 2.0]), add(at, [x + thick, y + tall, front]), colour);
            }
            x += thick + 0.4;
        }
    }
}

fn window(solids: &mut Solids, at: Vec3, wide: f64, rng: &mut ChaCha8Rng) {
    let high = rng.random_range(90.0..140.0);
    let sky: Colour = [0.75, 0.85, 0.98];
    solids.tiles(add(at, [0.0, 0.0, 0.6]), [[wide, 0.0, 0.0], [0.0, high, 0.0]], [1, 4], |_, k| {
        sky.map(|v| v * (0.75 + 0.08 * k as f32))
    });
    for share in [0.0, 0.5, 1.0] {
        let (x, y) = (share * wide, share * high);
        solids.between(add(at, [x - 2.5, 0.0, 0.0]), add(at, [x + 2.5, high, 4.0]), [0.7; 3]);
        solids.between(add(at, [0.0, y - 2.5, 0.0]), add(at, [wide, y + 2.5, 4.0]), [0.7; 3]);
    }
}

fn framed_picture(solids: &mut Solids, at: Vec3, wide: f64, rng: &mut ChaCha8Rng) {
    let high = wide * rng.random_range(0.6..1.3);
    solids.between(add(at, [-3.0, -3.0, 0.0]), add(at, [wide + 3.0, high + 3.0, 2.0]), [0.05; 3]);
    let colours: Vec<Colour> = (0..5).map(|_| std::array::from_fn(|_| rng.random_range(0.05..0.8))).collect();
    solids.tiles(add(at, [0.0, 0.0, 2.3]), [[wide, 0.0, 0.0], [0.0, high, 0.0]], [4, 3], |i, k| {
        colours[(i * k + i) % colours.len()]
    });
}

fn lamp(solids: &mut Solids, at: Vec3, rng: &mut ChaCha8Rng) {
    let high = rng.random_range(135.0..165.0);
    solids.cylinder([at, add(at, [0.0, 2.5, 0.0])], [14.0, 14.0], [0.05; 3]);
    solids.cylinder([at, add(at, [0.0, high, 0.0])], [1.2, 1.2], [0.05; 3]);
    solids.cylinder([add(at, [0.0, high, 0.0]), add(at, [0.0, high + 26.0, 0.0])], [19.0, 13.0], [0.9, 0.8, 0.6]);
}

/// Block in a seat's axes (x to the sitter's left, z forwards, origin on the floor below the hips), from its low to
/// its high corner.
fn seat_block(solids: &mut Solids, seat: &SeatPosition, low: Vec3, high: Vec3, colour: Colour) {
    let turn = Rotation::about([0.0, 1.0, 0.0], seat.turn);
    let middle: Vec3 = std::array::from_fn(|k| (low[k] + high[k]) / 2.0);
    let size = std::array::from_fn(|k| high[k] - low[k]);
    let [x, _, z] = seat.hips;
    solids.block(add([x, 0.0, z], turn.turn(middle)), size, turn, colour);
}

fn furnish_seat(solids: &mut Solids, seat: &SeatPosition, rng: &mut ChaCha8Rng) {
    if seat.seat == Seat::Standing {
        return;
    }
    let unit = seat.unit;
    let cloth: Colour = muted(rng, 0.02, 0.4);
    let top = seat.hips[1] - 11.5 * unit;
    let back = rng.random_range(28.0..55.0) * unit;
    let mut block = |low: Vec3, high: Vec3, colour: Colour| seat_block(solids, seat, low, high, colour);
    block([-23.0, top - 6.0, -22.0], [23.0, top, 24.0 * unit], cloth);
    block([-21.0, top + 8.0, -25.0], [21.0, seat.hips[1] + back, -20.5], cloth);
    for (x, z) in [(-20.0, -23.0), (20.0, -23.0), (-20.0, 18.0), (20.0, 18.0)] {
        let high = if z < 0.0 { seat.hips[1] + 0.6 * back } else { top - 6.0 };
        block([x - 1.5, 0.0, z - 1.5], [x + 1.5, high, z + 1.5], [0.04; 3]);
    }
}

fn desk(seat: &SeatPosition, rng: &mut ChaCha8Rng) -> Mesh {
    let mut solids = Solids::new(0.4);
    let wood: Colour =
        [[0.35, 0.22, 0.11], [0.65, 0.63, 0.6], [0.07, 0.05, 0.04], [0.45, 0.36, 0.25]][rng.random_range(0..4)];
    let [top, near] = seat.desk;
    let (half, far) = (rng.random_range(62.0..85.0), near + rng.random_range(55.0..75.0));
    let mut block = |low: Vec3, high: Vec3, colour: Colour| seat_block(&mut solids, seat, low, high, colour);
    block([-half, top - 3.0, near], [half, top, far], wood);
    for x in [-half + 2.0, half - 6.0] {
        block([x, 0.0, near + 4.0], [x + 4.0, top - 3.0, near + 8.0], wood);
        block([x, 0.0, far - 8.0], [x + 4.0, top - 3.0, far - 4.0], wood);
    }
    if rng.random_bool(0.5) {
        block([-half + 4.0, top * 0.3, far - 6.0], [half - 4.0, top - 3.0, far - 4.5], wood.map(|v| 0.8 * v));
    }
    if rng.random_bool(0.5) {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let x = side * rng.random_range(44.0..54.0);
        let colour = std::array::from_fn(|_| rng.random_range(0.05..0.6));
        block([x - 9.0, top, near + 20.0], [x + 9.0, top + 3.0, near + 44.0], colour);
    }
    solids.mesh
}
