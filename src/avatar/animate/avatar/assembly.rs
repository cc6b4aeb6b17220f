//! Surfaces of one avatar in the stance, grouped by material, with weights and colours.

use super::appearance::{Appearance, Reflectance, Top, Weave};
use super::body::BodyForm;
use super::face::Feature;
use super::field::{Form, bounding_box, smooth_union};
use super::hand::HandForm;
use super::head::HeadForm;
use super::jaw::{jaw_share, opening};
use super::material::Material;
use super::skin::{Weights, rigid};
use super::surface::Surface;
use orator_base::math::vec3::{Vec3, dot, sub};
use std::collections::BTreeMap;

/// Cell sizes of the surface meshes, cm.
const SHIRT_CELL: f64 = 1.9;
/// Cell size of a shirt with a pattern.
const PATTERN_CELL: f64 = 1.65;
const LEGS_CELL: f64 = 2.4;
const SHOE_CELL: f64 = 1.8;
const PALM_CELL: f64 = 0.62;
const CUFF_CELL: f64 = 0.9;
const FINGER_CELL: f64 = 0.46;
/// Width over which the normals of a hand are computed, as a fraction of a cell.
const NORMAL_WIDTH: f64 = 0.1;
/// Radius around the wrist in which the cells of a bare arm hardly grow, cm.
const ARM_FOCUS_RADIUS: f64 = 7.0;

#[derive(Default)]
pub struct PosedMesh {
    pub surface: Surface,
    pub weights: Vec<Weights>,
    pub colours: Vec<Reflectance>,
    /// Displacement of each vertex when the mouth is fully open, cm; vertices beyond its end do not move.
    pub mouth: Vec<Vec3>,
    /// Position of each vertex along its forearm, 0 (elbow) .. 1 (wrist); 0 for vertices beyond its end.
    pub twist: Vec<f32>,
}

impl PosedMesh {
    fn add(&mut self, weights: Vec<Weights>, surface: Surface, colours: Vec<Reflectance>) {
        self.surface.extend(surface);
        self.weights.extend(weights);
        self.colours.extend(colours);
    }
}

pub struct Assembly<'a> {
    body: &'a BodyForm<'a>,
    appearance: &'a Appearance,
    pub meshes: BTreeMap<Material, PosedMesh>,
}

impl<'a> Assembly<'a> {
    pub fn new(body: &'a BodyForm<'a>, head: &HeadForm, hands: &[HandForm; 2]) -> Self {
        let mut assembly = Self { body, appearance: body.appearance, meshes: BTreeMap::new() };
        assembly.clothes();
        for (side, hand) in hands.iter().enumerate() {
            assembly.hand(side, hand);
        }
        assembly.head(head);
        assembly
    }

    fn add(&mut self, material: Material, weights: Vec<Weights>, surface: Surface, colour: Reflectance) {
        let colours = vec![colour; surface.points.len()];
        self.meshes.entry(material).or_default().add(weights, surface, colours);
    }

    fn clothes(&mut self) {
        let (body, appearance) = (self.body, self.appearance);
        let cm = body.stance.scale;
        let shirt = body.shirt();
        let cell = cm * if appearance.weave == Weave::Plain { SHIRT_CELL } else { PATTERN_CELL };
        let surface = Surface::from_field(&shirt, body.shirt_bounds(), cell).with_normals_of(&shirt, cell);
        let colours = body.cloth(&surface.points, &surface.normals);
        self.meshes.entry(Material::Shirt).or_default().add(body.shirt_weights(&surface), surface, colours);
        let jacket = appearance.top == Top::Jacket;
        if jacket {
            let surface = body.lapels(&shirt);
            self.add(Material::Shirt, body.shirt_weights(&surface), surface, appearance.top_colour.map(|v| 0.9 * v));
        }
        if appearance.collar {
            let surface = body.collar();
            let colour = if jacket { appearance.second_colour } else { appearance.top_colour };
            self.add(Material::Shirt, body.shirt_weights(&surface), surface, colour.map(|v| 0.95 * v));
        }
        let legs = surface_of(&body.trousers(), LEGS_CELL * cm);
        if appearance.skirt {
            let surface = surface_of(&body.skirt(), LEGS_CELL * cm);
            self.add(Material::Trousers, body.skirt_weights(&surface), surface, appearance.legs_colour);
            self.add(Material::Skin, body.leg_weights(&legs), legs, appearance.skin.map(|v| 0.92 * v));
        } else {
            self.add(Material::Trousers, body.leg_weights(&legs), legs, appearance.legs_colour);
        }
        for side in 0..2 {
            let surface = surface_of(&body.shoe(side), SHOE_CELL * cm);
            self.add(Material::Shoes, body.leg_weights(&surface), surface, appearance.shoes_colour);
        }
    }

    /// Adds a hand with its wrist, with the arm if the sleeve is short, otherwise with the cuff.
    fn hand(&mut self, side: usize, hand: &HandForm) {
        let (body, appearance) = (self.body, self.appearance);
        let size = hand.scale;
        let (palm, finger) = (PALM_CELL * size, FINGER_CELL * size);
        let arm = body.bare_arm(side);
        let on_arm = |d: f64, at: Vec3| arm.as_ref().map_or(d, |arm| smooth_union(d, arm.distance(at), 1.0 * size));
        let normals = |at: Vec3| on_arm(hand.blended(at), at);
        let field = |at: Vec3| on_arm(hand.palm(at), at);
        let bounds = hand.bounds(None);
        let surface = match &arm {
            None => Surface::from_field(&field, bounds, palm),
            Some(arm) => {
                let middle = body.stance.positions[body.rig.arms[side].hand];
                let arm_bounds = bounding_box([bounds, arm.bounds()].into_iter());
                Surface::focused(&field, arm_bounds, palm, (middle, ARM_FOCUS_RADIUS * size))
            }
        };
        let surface = surface.with_normals_of(&normals, NORMAL_WIDTH * palm);
        if arm.is_some() {
            let places = self.along_forearm(side, &surface.points);
            let mesh = self.meshes.entry(Material::Skin).or_default();
            mesh.twist.resize(mesh.surface.points.len(), 0.0);
            mesh.twist.extend(places);
        }
        self.add(Material::Skin, body.palm_weights(side, size, &surface), surface, appearance.skin);
        for n in 1..5 {
            let surface = Surface::from_field(&|at| hand.finger(n, at), hand.bounds(Some(n)), finger)
                .with_normals_of(&normals, NORMAL_WIDTH * finger);
            self.add(Material::Skin, body.finger_weights(side, n, size, &surface), surface, appearance.skin);
        }
        if arm.is_none() {
            let surface = surface_of(&body.cuff(side), CUFF_CELL * size);
            let weights = vec![rigid(body.rig.arms[side].forearm); surface.points.len()];
            let colour = if appearance.top == Top::Jacket { appearance.second_colour } else { appearance.top_colour };
            self.add(Material::Shirt, weights, surface, colour);
        }
    }

    /// Position of points along a forearm, 0 (elbow) .. 1 (wrist).
    fn along_forearm(&self, side: usize, points: &[Vec3]) -> Vec<f32> {
        let (arm, places) = (&self.body.rig.arms[side], &self.body.stance.positions);
        let forearm = sub(places[arm.hand], places[arm.forearm]);
        let share =
            |at: &Vec3| (dot(sub(*at, places[arm.forearm]), forearm) / dot(forearm, forearm)).clamp(0.0, 1.0) as f32;
        points.iter().map(share).collect()
    }

    /// Adds head, ears, hair and facial features.
    fn head(&mut self, head: &HeadForm) {
        let (body, appearance) = (self.body, self.appearance);
        let skin = head.skin_surface();
        let colours = skin.points.iter().map(|&at| head.complexion(at, appearance)).collect();
        let shares: Vec<f64> = skin.points.iter().map(|&at| jaw_share(at)).collect();
        let mut features = vec![Feature { material: Material::Face, surface: skin, colours, shares }];
        features.extend(head.features(appearance));
        let ear = head.ear_surface();
        for surface in [ear.clone(), ear.mirrored()] {
            let colours = vec![appearance.skin; surface.points.len()];
            features.push(Feature { material: Material::Face, surface, colours, shares: Vec::new() });
        }
        if let Some(surface) = head.hair_surface() {
            let colours = surface.points.iter().map(|&at| hair_colour_at(appearance.hair_colour, at)).collect();
            features.push(Feature { material: Material::Hair, surface, colours, shares: Vec::new() });
        }
        for (n, Feature { material, surface, colours, shares }) in features.into_iter().enumerate() {
            let displacements = surface.points.iter().zip(shares).map(|(&at, share)| head.scaled(opening(at, share)));
            let displacements: Vec<Vec3> = displacements.collect();
            let is_skinned = n == 0 || material == Material::Hair;
            let surface = head.placed(surface);
            let weights =
                if is_skinned { body.head_weights(&surface) } else { vec![rigid(body.rig.head); surface.points.len()] };
            let mesh = self.meshes.entry(material).or_default();
            if !displacements.is_empty() {
                mesh.mouth.resize(mesh.surface.points.len(), [0.0; 3]);
                mesh.mouth.extend(displacements);
            }
            mesh.add(weights, surface, colours);
        }
    }
}

fn surface_of(form: &Form, cell: f64) -> Surface {
    let field = |at: Vec3| form.distance(at);
    Surface::from_field(&field, form.bounds(), cell).with_normals_of(&field, cell)
}

/// Hair colour at a point, with lighter and darker strands.
fn hair_colour_at(colour: Reflectance, [x, y, z]: Vec3) -> Reflectance {
    let light = 1.0 + 0.16 * (3.1 * x + 0.4 * y).sin() * (1.3 * z + 0.7 * y).cos();
    colour.map(|v| v * light as f32)
}
