//! Random appearance of rendered persons, and the points of their faces.

use orator_avatar::animate::avatar::Appearance;
use orator_avatar::animate::avatar::appearance::{Hairstyle, Reflectance, Top, Weave, lip_colour_of};
use orator_avatar::animate::avatar::head::{EAR, EYE, EYE_RADIUS, HeadForm};
use orator_avatar::animate::avatar::stance::Stance;
use orator_avatar::animate::rig::rig::Rig;
use orator_base::math::vec3::Vec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Skin from light to dark.
const SKINS: [Reflectance; 8] = [
    [0.78, 0.58, 0.48],
    [0.70, 0.49, 0.39],
    [0.60, 0.42, 0.33],
    [0.52, 0.34, 0.24],
    [0.40, 0.25, 0.17],
    [0.28, 0.165, 0.105],
    [0.17, 0.098, 0.064],
    [0.10, 0.060, 0.042],
];
/// Natural hair: black, browns, red, blond, grey, white.
const HAIRS: [Reflectance; 8] = [
    [0.012, 0.010, 0.009],
    [0.022, 0.015, 0.011],
    [0.050, 0.028, 0.016],
    [0.105, 0.058, 0.030],
    [0.190, 0.070, 0.028],
    [0.360, 0.240, 0.110],
    [0.240, 0.230, 0.220],
    [0.560, 0.540, 0.510],
];
const IRISES: [Reflectance; 4] = [[0.045, 0.022, 0.012], [0.10, 0.055, 0.025], [0.10, 0.17, 0.24], [0.10, 0.14, 0.08]];
const CLOTHS: [Reflectance; 14] = [
    [0.16, 0.30, 0.38],
    [0.62, 0.62, 0.60],
    [0.030, 0.032, 0.036],
    [0.035, 0.055, 0.14],
    [0.10, 0.22, 0.50],
    [0.35, 0.050, 0.055],
    [0.10, 0.035, 0.060],
    [0.045, 0.15, 0.075],
    [0.50, 0.42, 0.12],
    [0.48, 0.36, 0.26],
    [0.15, 0.15, 0.16],
    [0.46, 0.20, 0.24],
    [0.30, 0.22, 0.44],
    [0.55, 0.24, 0.08],
];
const LEGS: [Reflectance; 6] = [
    [0.055, 0.065, 0.085],
    [0.018, 0.018, 0.022],
    [0.035, 0.060, 0.13],
    [0.12, 0.12, 0.12],
    [0.30, 0.25, 0.18],
    [0.09, 0.07, 0.05],
];
const SHOES: [Reflectance; 4] = [[0.30, 0.28, 0.26], [0.02, 0.018, 0.017], [0.10, 0.055, 0.03], [0.55, 0.55, 0.53]];

/// Random appearance, reproducible from the seed.
pub fn random(seed: u64) -> Appearance {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // 45 % have a female body shape, the others a male one; faces and clothes overlap.
    let woman = rng.random_bool(0.45);
    let near = |rng: &mut ChaCha8Rng, middle: f64, spread: f64| middle + spread * rng.random_range(-1.0..1.0);
    let heavy = near(&mut rng, 0.02, 0.14);
    let skin = between(&mut rng, &SKINS);
    let dark = skin[1] < 0.2;
    let n_hairs = if dark && rng.random_bool(0.85) { 2 } else { HAIRS.len() };
    let hair_colour = jittered(&mut rng, &HAIRS[..n_hairs], 0.15);
    let hair = match (woman, rng.random_range(0..10)) {
        (true, 0..5) => Hairstyle::Long,
        (true, 5..8) => Hairstyle::Tied,
        (false, 0) => Hairstyle::Long,
        (false, 1..3) => Hairstyle::Bald,
        _ => Hairstyle::Short,
    };
    let top = match rng.random_range(0..10) {
        0..4 => Top::LongSleeves,
        4..7 => Top::ShortSleeves,
        _ => Top::Jacket,
    };
    let weave = match rng.random_range(0..10) {
        0..6 => Weave::Plain,
        6..9 => Weave::Stripes,
        _ => Weave::Checks,
    };
    let top_colour = jittered(&mut rng, &CLOTHS, 0.2);
    let mut second_colour = jittered(&mut rng, &CLOTHS, 0.2);
    if top == Top::Jacket && rng.random_bool(0.6) {
        second_colour = CLOTHS[1];
    }
    let painted = woman && rng.random_bool(0.5);
    Appearance {
        trunk: 1.0 + heavy,
        limbs: 1.0 + 0.6 * heavy - if woman { 0.06 } else { 0.0 },
        waist: near(&mut rng, if woman { 0.93 } else { 1.0 }, 0.05) + 0.4 * heavy.max(0.0),
        hips: near(&mut rng, if woman { 1.06 } else { 0.99 }, 0.04),
        bust: if woman { rng.random_range(0.4..1.0) } else { 0.0 },
        neck: near(&mut rng, if woman { 0.86 } else { 1.0 }, 0.06) + 0.3 * heavy,
        head: [
            near(&mut rng, if woman { 0.97 } else { 1.0 }, 0.04),
            near(&mut rng, if woman { 0.97 } else { 1.0 }, 0.035),
            near(&mut rng, if woman { 0.98 } else { 1.0 }, 0.03),
        ],
        jaw: near(&mut rng, if woman { 0.92 } else { 1.03 }, 0.07),
        nose: near(&mut rng, if woman { 0.92 } else { 1.03 }, 0.12),
        lips: near(&mut rng, if woman { 1.08 } else { 0.95 }, 0.15),
        brows: near(&mut rng, if woman { 0.8 } else { 1.15 }, 0.2),
        face: true,
        skin,
        lip_colour: lip_colour_of(skin, if painted { 1.0 } else { rng.random_range(0.3..0.6) }),
        iris: IRISES[if dark { 0 } else { rng.random_range(0..IRISES.len()) }],
        hair,
        hair_colour,
        hair_volume: near(&mut rng, 1.05, 0.35),
        fringe: near(&mut rng, 0.3, 1.3),
        parting: near(&mut rng, 0.0, 1.0),
        beard: if !woman && rng.random_bool(0.35) { rng.random_range(0.35..1.0) } else { 0.0 },
        glasses: rng
            .random_bool(0.25)
            .then(|| [[0.015; 3], [0.08, 0.04, 0.02], [0.30, 0.28, 0.22]][rng.random_range(0..3)]),
        top,
        top_colour,
        second_colour,
        weave: if top == Top::Jacket { Weave::Plain } else { weave },
        collar: top == Top::Jacket || rng.random_bool(0.4),
        skirt: woman && rng.random_bool(0.35),
        legs_colour: jittered(&mut rng, &LEGS, 0.25),
        shoes_colour: jittered(&mut rng, &SHOES, 0.2),
    }
}

/// Nose, left eye, right eye, left ear, right ear (COCO order) on the surface of a person of this appearance, cm, in
/// the axes of the head joint.
pub fn face(rig: &Rig, appearance: &Appearance) -> [Vec3; 5] {
    let stance = Stance::new(rig);
    let head = HeadForm::new(rig, &stance, appearance);
    let at_front = |x: f64, y: f64| [x, y, head.front(x, y)];
    let [ex, ey, ez] = EYE;
    let [ax, ay, az] = EAR;
    let sides = |x: f64, y: f64, z: f64| [[x, y, z], [-x, y, z]];
    let ([left_eye, right_eye], [left_ear, right_ear]) = (sides(ex, ey, ez + EYE_RADIUS), sides(ax + 0.6, ay, az));
    [at_front(0.0, 7.5), left_eye, right_eye, left_ear, right_ear].map(|at| head.scaled(at))
}

/// A random colour between two neighbours of a row.
fn between(rng: &mut ChaCha8Rng, row: &[Reflectance]) -> Reflectance {
    let at = rng.random_range(0.0..(row.len() - 1) as f32);
    let (low, share) = (at as usize, at.fract());
    std::array::from_fn(|k| row[low][k] + share * (row[low + 1][k] - row[low][k]))
}

/// One of the colours with random brightness and hue, relative changes of about `spread`.
fn jittered(rng: &mut ChaCha8Rng, colours: &[Reflectance], spread: f32) -> Reflectance {
    let colour = colours[rng.random_range(0..colours.len())];
    let light = 1.0 + spread * rng.random_range(-1.0..1.0);
    colour.map(|v| (v * light * (1.0 + 0.4 * spread * rng.random_range(-1.0..1.0))).clamp(0.004, 0.85))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_avatar::animate::avatar::Avatar;
    use orator_base::math::rotation::Rotation;
    use orator_base::math::vec3::{add, norm, sub};
    use orator_base::types::pose3d::Motion;
    use orator_base::types::skeleton::N_JOINTS;
    use orator_base::types::time::FrameRate;

    #[test]
    fn a_seed_is_one_person_and_seeds_differ() {
        assert_eq!(random(7), random(7));
        let people: Vec<Appearance> = (0..60).map(random).collect();
        assert!((1..60).all(|n| people[n] != people[n - 1]));
        let count = |of: &dyn Fn(&Appearance) -> bool| people.iter().filter(|person| of(person)).count();
        for top in [Top::LongSleeves, Top::ShortSleeves, Top::Jacket] {
            assert!(count(&|person| person.top == top) >= 8);
        }
        for hair in [Hairstyle::Bald, Hairstyle::Short, Hairstyle::Long, Hairstyle::Tied] {
            assert!(count(&|person| person.hair == hair) >= 2);
        }
        assert!(count(&|person| person.glasses.is_some()) >= 5 && count(&|person| person.beard > 0.0) >= 3);
        assert!(count(&|person| person.skin[1] < 0.2) >= 10 && count(&|person| person.skin[1] > 0.4) >= 10);
        assert!(people.iter().all(|person| person.top_colour.iter().all(|v| (0.0..=1.0).contains(v))));
    }

    fn rig() -> Rig {
        let unseen = ndarray::Array3::from_elem((1, N_JOINTS, 3), f32::NAN);
        Rig::from_motion(&Motion::from_joints(FrameRate::new(15, 1), unseen))
    }

    #[test]
    fn every_point_of_the_face_lies_on_the_skin_or_the_eyes() {
        let (rig, appearance) = (rig(), Appearance::plain());
        let local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
        let meshes = Avatar::new(&rig, &appearance).posed(&rig, rig.root, &local, 0.0);
        let points = face(&rig, &appearance);
        let [nose, left, right, left_ear, right_ear] = points;
        assert!(left[0] > 0.0 && left_ear[0] > left[0] && nose[2] > left[2] && left[2] > left_ear[2]);
        assert!((left[0] + right[0]).abs() < 1e-9 && (left_ear[0] + right_ear[0]).abs() < 1e-9);
        for point in points.map(|point| add(rig.skeleton.positions(rig.root, &local)[rig.head], point)) {
            let all = meshes.iter().flat_map(|mesh| &mesh.points);
            let near = all.map(|at| norm(sub(at.map(f64::from), point))).fold(f64::INFINITY, f64::min);
            assert!(near < 0.6, "{point:?} is {near} cm off the surface");
        }
    }

    #[test]
    fn a_seed_gives_the_same_bytes_and_a_whole_avatar() {
        let rig = rig();
        let local = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
        let of = |seed: u64| Avatar::new(&rig, &random(seed)).posed(&rig, rig.root, &local, 0.3);
        let first = of(4);
        assert_eq!(first, of(4));
        assert_ne!(first, of(5));
        for mesh in &first {
            let n = mesh.points.len();
            assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < n) && mesh.colours.len() == n);
            assert!(mesh.points.iter().flatten().chain(mesh.normals.iter().flatten()).all(|v| v.is_finite()));
        }
        assert!((20_000..46_000).contains(&first.iter().map(|mesh| mesh.triangles.len()).sum::<usize>()));
    }
}
