//! Drawing of a pose: arms and hands as tapered limbs, left and right in two colours, darker where nearer, over a
//! schematic trunk and head (no data describes them). Missing joints are omitted.

use ndarray::ArrayView2;
use orator_base::types::image::Image;
use orator_base::types::skeleton::{self, L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, R_HAND, R_SHOULDER, R_WRIST, Side};
use orator_media::opencv::draw;

/// Background colour of all images.
pub const PAPER: [u8; 3] = [248, 247, 244];
/// Colour of text and marks.
pub const INK: [u8; 3] = [92, 98, 106];
/// Colours of the speaker's left and right side.
pub const LEFT: [u8; 3] = [20, 118, 150];
pub const RIGHT: [u8; 3] = [214, 98, 38];
const TRUNK: [u8; 3] = [212, 214, 216];
const HEAD: [u8; 3] = [196, 199, 203];

/// Number of pieces into which an arm bone is divided, so that its shade can change along it.
const PIECES: usize = 12;
/// Depth relative to the neck, metres, beyond which the shade no longer changes.
const SHADE_METRES: f32 = 0.45;

/// View of a pose and its position in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FigureView {
    /// Pixel position of the neck.
    pub neck_px: [f32; 2],
    pub px_per_metre: f32,
    /// Yaw of the view: 0 from the front, 90 from the speaker's left.
    pub yaw_degrees: f32,
    /// Distance of the camera from the neck, metres; infinite for an orthographic view.
    pub camera_metres: f32,
    /// Size of trunk and head relative to an adult with 0.55 m from shoulder to wrist; 0 draws neither.
    pub trunk: f32,
    /// Colour of the outline that separates a limb from what is behind it.
    pub seam: Option<[u8; 3]>,
}

impl FigureView {
    /// Front view on `PAPER` with the neck at `neck_px`.
    pub fn front(neck_px: [f32; 2], px_per_metre: f32) -> Self {
        Self { neck_px, px_per_metre, yaw_degrees: 0.0, camera_metres: 3.0, trunk: 1.0, seam: Some(PAPER) }
    }

    /// Position in px, and depth in metres (away from the camera, 0 at the neck), of a point in metres.
    pub fn project(&self, [x, y, z]: [f32; 3]) -> ([f32; 2], f32) {
        let (sin, cos) = self.yaw_degrees.to_radians().sin_cos();
        let (across, depth) = (cos * x + sin * z, cos * z - sin * x);
        let scale = self.px_per_metre * self.perspective_scale(depth);
        ([self.neck_px[0] + scale * across, self.neck_px[1] + scale * y], depth)
    }

    /// Magnification at a depth, relative to the neck's depth.
    fn perspective_scale(&self, depth: f32) -> f32 {
        1.0 / (1.0 + (depth / self.camera_metres).max(-0.8))
    }
}

/// Draws one frame [49, 3] (metres, joint order of `types::skeleton`).
pub fn draw_pose(image: &mut Image, joints: ArrayView2<f32>, view: &FigureView) -> anyhow::Result<()> {
    let place = |joint: usize| -> [f32; 3] { std::array::from_fn(|k| joints[[joint, k]]) };
    let mut limbs: Vec<DrawnLimb> = (1..N_JOINTS).flat_map(|joint| limbs_to(joint, place)).collect();
    limbs.retain(|limb| limb.ends.iter().flatten().all(|v| v.is_finite()));
    let depth = |limb: &DrawnLimb| limb.ends.iter().map(|&end| view.project(end).1).sum::<f32>() / 2.0;
    limbs.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
    // Only an arm whose shoulder is on the far side can be behind the trunk.
    let far = |shoulder: usize| view.project(place(shoulder)).1 > 0.08;
    let (left_far, right_far) = (far(L_SHOULDER), far(R_SHOULDER));
    let behind = |limb: &&DrawnLimb| depth(limb) > 0.1 && if limb.left { left_far } else { right_far };
    for limb in limbs.iter().filter(behind) {
        limb.draw(image, view)?;
    }
    if view.trunk > 0.0 {
        draw_trunk(image, view, place(L_SHOULDER), place(R_SHOULDER))?;
    }
    for limb in limbs.iter().filter(|limb| !behind(limb)) {
        limb.draw(image, view)?;
    }
    Ok(())
}

/// Piece of a bone: two ends in metres, their radii, and a colour for the mean depth.
struct DrawnLimb {
    ends: [[f32; 3]; 2],
    radii: [f32; 2],
    left: bool,
    rgb: [u8; 3],
    /// Fraction of the length at which the outline begins (1: no outline); earlier, it would cut into the parent limb.
    seam_from: f32,
}

/// The pieces of the bone that ends at `joint`, radii in metres.
fn limbs_to(joint: usize, place: impl Fn(usize) -> [f32; 3]) -> Vec<DrawnLimb> {
    let Some(parent) = skeleton::parent(joint) else { return Vec::new() };
    let left = skeleton::side(joint) == Side::Left;
    let rgb = if left { LEFT } else { RIGHT };
    let root = if joint < R_HAND { L_HAND } else { R_HAND };
    let (radii, pieces) = match joint {
        L_HAND | R_HAND | L_SHOULDER | R_SHOULDER => return Vec::new(),
        L_WRIST | R_WRIST => ([0.034, 0.023], PIECES),
        _ if joint < L_HAND => ([0.043, 0.035], PIECES),
        // The first bone is the palm (wrist to knuckle), then come three phalanges.
        _ => (
            match (joint - root - 1) % 4 {
                0 => [0.021, 0.0145],
                1 => [0.0115, 0.0105],
                2 => [0.0105, 0.0095],
                _ => [0.0095, 0.0075],
            },
            1,
        ),
    };
    let is_hand = joint > L_HAND;
    // Neighbouring fingers differ slightly in shade.
    let rgb = if is_hand && (joint - root - 1) / 4 % 2 == 1 { mix(rgb, [0; 3], 0.14) } else { rgb };
    let (from, to) = (place(parent), place(joint));
    let at = |share: f32| -> [f32; 3] { std::array::from_fn(|k| from[k] + share * (to[k] - from[k])) };
    let radius = |share: f32| radii[0] + share * (radii[1] - radii[0]);
    (0..pieces)
        .map(|piece| {
            let shares = [piece, piece + 1].map(|end| end as f32 / pieces as f32);
            let seam_from = match piece {
                _ if is_hand => SEAM_FROM[(joint - root - 1) % 4],
                2..=10 => 0.0,
                _ => 1.0,
            };
            DrawnLimb { ends: shares.map(at), radii: shares.map(radius), left, rgb, seam_from }
        })
        .collect()
}

/// Fraction of the length at which the outline begins, for each of a finger's four bones.
const SEAM_FROM: [f32; 4] = [1.0, 0.15, 0.2, 0.2];

impl DrawnLimb {
    fn draw(&self, image: &mut Image, view: &FigureView) -> anyhow::Result<()> {
        let [(a, near), (b, far)] = self.ends.map(|end| view.project(end));
        let radius =
            |k: usize, depth: f32| (self.radii[k] * view.px_per_metre * view.perspective_scale(depth)).max(1.0);
        let (ra, rb) = (radius(0, near), radius(1, far));
        if let Some(seam) = view.seam.filter(|_| self.seam_from < 1.0) {
            // Outlines run along the sides only, so that they do not cut into the parent limb.
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length = dx.hypot(dy).max(1e-3);
            let (nx, ny) = (-dy / length, dx / length);
            let wide = (0.004 * view.px_per_metre).max(1.0);
            let corner = |p: [f32; 2], r: f32| [p[0] + nx * r, p[1] + ny * r];
            let start = [a[0] + self.seam_from * dx, a[1] + self.seam_from * dy];
            let rs = ra + self.seam_from * (rb - ra);
            let quad =
                [corner(start, rs + wide), corner(b, rb + wide), corner(b, -rb - wide), corner(start, -rs - wide)];
            draw::polygon(image, &quad, seam)?;
        }
        draw::capsule(image, a, ra, b, rb, shade(self.rgb, (near + far) / 2.0))
    }
}

/// Colour at a depth: lighter away from the camera, darker towards it.
fn shade(rgb: [u8; 3], depth: f32) -> [u8; 3] {
    let share = (depth / SHADE_METRES).clamp(-1.0, 1.0);
    if share > 0.0 { mix(rgb, PAPER, 0.55 * share) } else { mix(rgb, [0; 3], -0.28 * share) }
}

/// Colour at fraction `share` from `a` to `b`.
pub fn mix(a: [u8; 3], b: [u8; 3], share: f32) -> [u8; 3] {
    std::array::from_fn(|k| (f32::from(a[k]) + share * (f32::from(b[k]) - f32::from(a[k]))).round() as u8)
}

/// Draws trunk, neck and head, upright and centred on the neck joint, turned with the shoulders.
fn draw_trunk(image: &mut Image, view: &FigureView, left: [f32; 3], right: [f32; 3]) -> anyhow::Result<()> {
    let size = view.trunk;
    let seen = left.iter().chain(&right).all(|v| v.is_finite());
    let [left, right] =
        if seen { [left, right] } else { [[0.16 * size, 0.04 * size, 0.0], [-0.16 * size, 0.04 * size, 0.0]] };
    let (dx, dz) = (left[0] - right[0], left[2] - right[2]);
    let width = dx.hypot(dz).max(1e-3);
    let side = |metres: f32, down: f32| [dx / width * metres, down * size, dz / width * metres];
    let ahead = |metres: f32, down: f32| [dz / width * metres * size, down * size, -dx / width * metres * size];

    // The hem is drawn without perspective, so that it is one level line in a side view.
    let plain = FigureView { camera_metres: f32::INFINITY, ..*view };
    let hem = [side(-0.115 * size, 0.52), side(0.115 * size, 0.52)].map(|corner| plain.project(corner).0);
    let corners = [view.project(left).0, view.project(right).0, hem[0], hem[1]];
    let px = |metres: f32| metres * size * view.px_per_metre;
    let spine = [view.project(ahead(-0.02, 0.09)).0, view.project(ahead(-0.01, 0.485)).0];
    draw::capsule(image, spine[0], px(0.095), spine[1], px(0.085), TRUNK)?;
    for k in 0..4 {
        draw::capsule(image, corners[k], px(0.05), corners[(k + 1) % 4], px(0.05), TRUNK)?;
    }
    draw::polygon(image, &corners, TRUNK)?;

    let (neck, _) = view.project(side(0.0, -0.015));
    let (throat, _) = view.project(ahead(0.015, -0.10));
    for shoulder in &corners[..2] {
        draw::capsule(image, neck, px(0.055), *shoulder, px(0.05), TRUNK)?;
    }
    draw::capsule(image, neck, px(0.052), throat, px(0.046), TRUNK)?;
    let (head, _) = view.project(ahead(0.03, -0.20));
    let (nose, _) = view.project(ahead(0.128, -0.19));
    for (seam, rgb) in [(view.seam.map_or(0.0, |_| 0.006), view.seam.unwrap_or(HEAD)), (0.0, HEAD)] {
        draw::circle(image, nose, px(0.020 + seam), rgb)?;
        draw::circle(image, head, px(0.100 + seam), rgb)?;
    }
    Ok(())
}
