//! Vocabulary of hand postures: rests and gestures of a speaker. Lengths in metres of a body of unit 1, in the axes of
//! `ArmPosture`.

use super::body::{ArmPosture, FingerShape};
use super::condition::{GestureStyle, Seat};
use orator_base::math::vec3::Vec3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Postures of the left and the right arm.
pub type Arms = [ArmPosture; 2];

/// Distance of the desk top below the neck, and of its near edge in front of it, metres of a body of unit 1.
pub const DESK_BELOW_NECK: f64 = 0.365;
pub const DESK_AHEAD: f64 = 0.27;

/// Rest with the hands hidden under a desk.
pub fn under_desk() -> Arms {
    folded([0.06, 0.43, -0.2], false)
}

/// Both hands above the near edge of a desk, on the path to and from the rest under it.
pub fn over_edge() -> Arms {
    [posture([0.17, 0.27, -0.2], 0.4, 0.6, 0.4, 0.4, FingerShape::RELAXED); 2]
}

/// Rests of a gesture style on a seat, between which a clip changes.
pub fn rests(gesture_style: GestureStyle, seat: Seat, rng: &mut ChaCha8Rng) -> Vec<Arms> {
    let front = usize::from(rng.random_bool(0.5));
    let position: Vec3 = match seat {
        Seat::Standing => [0.08, 0.43, -0.19],
        Seat::Chair => [0.08, 0.38, -0.23],
        Seat::Desk => [0.08, 0.33, -0.34],
    };
    let separate = match seat {
        Seat::Standing => [posture([0.215, 0.5, -0.06], 0.3, 0.15, 0.0, 0.05, FingerShape::RELAXED); 2],
        Seat::Chair => [posture([0.14, 0.39, -0.27], 0.35, 1.25, 0.15, 0.15, FingerShape::RELAXED); 2],
        Seat::Desk => [posture([0.15, 0.33, -0.34], 0.5, 1.2, 0.1, 0.5, FingerShape::FLAT); 2],
    };
    let interlaced = interlaced(position);
    let stacked = swapped(folded(position, true), front);
    match gesture_style {
        GestureStyle::Folded => vec![interlaced, stacked, swapped(fist_in_hand(position), front)],
        GestureStyle::Crossing => {
            vec![swapped(arms_crossed(), front), swapped(wrists_crossed(position), front), separate]
        }
        GestureStyle::Low => vec![separate, stacked],
        GestureStyle::Holding => vec![separate],
        _ => {
            let first_rest = rng.random_range(0..3);
            let mut all = vec![separate, interlaced, stacked];
            all.rotate_left(first_rest);
            all.truncate(2);
            all
        }
    }
}

/// Samples a gesture of one hand (the other is `None` and rests) or of both.
pub fn stroke(gesture_style: GestureStyle, rng: &mut ChaCha8Rng) -> [Option<ArmPosture>; 2] {
    let side = usize::from(rng.random_bool(0.5));
    let mut arms = [None; 2];
    match gesture_style {
        GestureStyle::Crossing if rng.random_bool(0.7) => {
            arms[side] = Some(across(rng));
            if rng.random_bool(0.5) {
                arms[1 - side] = Some(if rng.random_bool(0.5) { across(rng) } else { open(rng) });
            }
        }
        GestureStyle::Wide if rng.random_bool(0.75) => {
            let first = wide(rng);
            arms = if rng.random_bool(0.6) { [Some(first), Some(wide(rng))] } else { arms };
            arms[side] = Some(first);
        }
        GestureStyle::Low if rng.random_bool(0.8) => {
            let middle = if rng.random_bool(0.5) { [0.2, 0.42, -0.22] } else { [0.2, 0.1, -0.22] };
            let first = ArmPosture { wrist: near(middle, [0.08, 0.07, 0.06], rng), ..open(rng) };
            arms[side] = Some(first);
            let second = ArmPosture { wrist: near(first.wrist, [0.04; 3], rng), ..first };
            arms[1 - side] = rng.random_bool(0.6).then_some(second);
        }
        GestureStyle::Fast if rng.random_bool(0.5) => {
            let far = ArmPosture { wrist: near([0.26, 0.14, -0.26], [0.16, 0.18, 0.08], rng), ..open(rng) };
            arms[side] = Some(far);
            arms[1 - side] = rng.random_bool(0.6).then(|| open(rng));
        }
        _ => match rng.random_range(0..100) {
            0..40 => {
                let first = open(rng);
                let near_first = ArmPosture { wrist: near(first.wrist, [0.03; 3], rng), ..first };
                arms[side] = Some(first);
                arms[1 - side] = Some(if rng.random_bool(0.65) { near_first } else { open(rng) });
            }
            40..58 => arms[side] = Some(open(rng)),
            58..70 => arms[side] = Some(pointing(rng)),
            70..80 => arms[side] = Some(counting(rng)),
            80..90 => arms[side] = Some(ArmPosture { fingers: FingerShape::PINCH, roll: 0.9, ..open(rng) }),
            90..95 => arms = [Some(steeple()); 2],
            _ => arms[side] = Some(wide(rng)),
        },
    }
    arms
}

fn posture(wrist: Vec3, elbow: f64, roll: f64, raise: f64, inwards: f64, fingers: FingerShape) -> ArmPosture {
    ArmPosture { wrist, elbow, forward: 0.0, roll, raise, inwards, fingers }
}

fn near(middle: Vec3, half: Vec3, rng: &mut ChaCha8Rng) -> Vec3 {
    std::array::from_fn(|k| middle[k] + half[k] * rng.random_range(-1.0..1.0))
}

/// Exchanges left and right if `side` is 1.
fn swapped([a, b]: Arms, side: usize) -> Arms {
    if side == 0 { [a, b] } else { [b, a] }
}

/// A hand in front of the body in a random shape.
fn open(rng: &mut ChaCha8Rng) -> ArmPosture {
    use FingerShape as F;
    let shapes = [F::RELAXED, F::RELAXED, F::FLAT, F::OPEN, F::OPEN, F::FIST, F::PINCH];
    ArmPosture {
        wrist: near([0.21, 0.2, -0.25], [0.09, 0.14, 0.07], rng),
        elbow: rng.random_range(0.15..0.7),
        forward: 0.0,
        roll: rng.random_range(-1.1..1.2),
        raise: rng.random_range(-0.1..0.8),
        inwards: rng.random_range(-0.3..0.5),
        fingers: shapes[rng.random_range(0..shapes.len())],
    }
}

fn pointing(rng: &mut ChaCha8Rng) -> ArmPosture {
    let (middle, raise) = match rng.random_range(0..3) {
        0 => ([0.2, 0.12, -0.36], rng.random_range(-0.1..0.3)),
        1 => ([0.36, 0.12, -0.22], rng.random_range(-0.1..0.4)),
        _ => ([0.22, 0.06, -0.2], rng.random_range(0.6..1.2)),
    };
    posture(near(middle, [0.05; 3], rng), 0.4, rng.random_range(-0.2..1.2), raise, 0.0, FingerShape::POINT)
}

fn counting(rng: &mut ChaCha8Rng) -> ArmPosture {
    let shapes = [FingerShape::ONE, FingerShape::TWO, FingerShape::THREE];
    let wrist = near([0.22, 0.08, -0.24], [0.05, 0.06, 0.04], rng);
    posture(wrist, 0.4, rng.random_range(0.9..1.5), 1.1, 0.0, shapes[rng.random_range(0..3)])
}

fn wide(rng: &mut ChaCha8Rng) -> ArmPosture {
    ArmPosture { wrist: near([0.44, 0.14, -0.2], [0.07, 0.16, 0.06], rng), inwards: -0.3, ..open(rng) }
}

/// A hand on the opposite side of the body.
fn across(rng: &mut ChaCha8Rng) -> ArmPosture {
    let wrist = near([-0.09, 0.2, -0.29], [0.08, 0.12, 0.05], rng);
    ArmPosture { wrist, elbow: 0.6, inwards: rng.random_range(0.1..0.5), ..open(rng) }
}

/// Hands on top of each other, the right one below; flatter on a low surface.
fn folded([x, down, away]: Vec3, flat: bool) -> Arms {
    let roll = if flat { 1.0 } else { 0.5 };
    [
        posture([x, down - 0.012, away - 0.03], 0.35, roll, 0.1, 1.0, FingerShape::RELAXED),
        posture([x, down + 0.012, away + 0.01], 0.35, roll, 0.1, 1.0, FingerShape::RELAXED),
    ]
}

fn interlaced([x, down, away]: Vec3) -> Arms {
    let hand = posture([x, down, away], 0.35, 0.35, 0.15, 0.55, FingerShape::INTERLACED);
    [hand, ArmPosture { wrist: [x, down + 0.012, away + 0.006], ..hand }]
}

fn fist_in_hand([x, down, away]: Vec3) -> Arms {
    [
        posture([x - 0.01, down, away - 0.04], 0.35, 0.3, 0.1, 0.9, FingerShape::CUP),
        posture([x + 0.005, down + 0.005, away], 0.35, 0.4, 0.1, 0.7, FingerShape::FIST),
    ]
}

fn steeple() -> ArmPosture {
    posture([0.095, 0.2, -0.27], 0.5, 0.1, 0.9, 0.5, FingerShape { spread: 0.1, ..FingerShape::FLAT })
}

/// Arms crossed in front of the chest, the left one in front.
fn arms_crossed() -> Arms {
    [
        posture([-0.09, 0.2, -0.215], 0.45, 0.3, 0.1, 0.0, FingerShape::INTERLACED),
        posture([-0.07, 0.25, -0.155], 0.45, 0.1, 0.1, 0.1, FingerShape::RELAXED),
    ]
}

/// Wrists crossed low in front of the body, the left one in front.
fn wrists_crossed([_, down, away]: Vec3) -> Arms {
    [
        posture([-0.03, down - 0.04, away - 0.055], 0.4, 0.5, 0.1, 0.2, FingerShape::RELAXED),
        posture([-0.03, down - 0.015, away + 0.01], 0.4, 0.5, 0.0, 0.2, FingerShape::RELAXED),
    ]
}
