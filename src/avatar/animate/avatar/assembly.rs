//! Surfaces of one person by material, with weights and colours, in the stance.

use super::appearance::{Appearance, Reflectance, Top, Weave};
use super::body::BodyForm;
use super::face::Feature;
use super::field::{Form, around, joined};
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
/// Cells of a shirt with a pattern.
const WOVEN_CELL: f64 = 1.65;
const LEGS_CELL: f64 = 2.4;
const SHOE_CELL: f64 = 1.8;
const PALM_CELL: f64 = 0.62;
const CUFF_CELL: f64 = 0.9;
const FINGER_CELL: f64 = 0.46;
/// Width over which the light of a hand is seen, as a share of a cell.
const FINE: f64 = 0.1;
/// Radius within which the cells of a bare arm are as small as the palm's, cm.
const ARM_EVEN: f64 = 7.0;

/// Mesh of one material in the stance.
#[derive(Default)]
pub struct PosedMesh {
    pub surface: Surface,
    pub weights: Vec<Weights>,
    pub colours: Vec<Reflectance>,
    /// Way of each vertex to the open mouth, cm; shorter than the points where nothing more moves.
    pub mouth: Vec<Vec3>,
    /// Place of each vertex along its forearm, 0 (elbow) .. 1 (wrist); shorter than the points where none is bare.
    pub twist: Vec<f32>,
}

impl PosedMesh {
    fn add(&mut self, weights: Vec<Weights>, surface: Surface, colours: Vec<Reflectance>) {
        self.surface.extend(surface);
        self.weights.extend(weights);
        self.colours.extend(colours);
    }
}

/// Meshes of one person by material.
pub struct Assembly<'a> {
    body: &'a BodyForm<'a>,
    looks: &'a Appearance,
    pub meshes: BTreeMap<Material, PosedMesh>,
}

impl<'a> Assembly<'a> {
    pub fn new(body: &'a BodyForm<'a>, head: &HeadForm, hands: &[HandForm; 2]) -> Self {
        let mut whole = Self { body, looks: body.looks, meshes: BTreeMap::new() };
        whole.clothes();
        for (side, hand) in hands.iter().enumerate() {
            whole.hand(side, hand);
        }
        whole.head(head);
        whole
    }

    fn add(&mut self, material: Material, weights: Vec<Weights>, surface: Surface, colour: Reflectance) {
        let colours = vec![colour; surface.points.len()];
        self.meshes.entry(material).or_default().add(weights, surface, colours);
    }

    fn clothes(&mut self) {
        let (body, looks) = (self.body, self.looks);
        let cm = body.stance.scale;
        let shirt = body.shirt();
        let cell = cm * if looks.weave == Weave::Plain { SHIRT_CELL } else { WOVEN_CELL };
        let surface = Surface::from_field(&shirt, body.shirt_bounds(), cell).lit(&shirt, cell);
        let colours = body.cloth(&surface.points, &surface.normals);
        self.meshes.entry(Material::Shirt).or_default().add(body.shirt_weights(&surface), surface, colours);
        let jacket = looks.top == Top::Jacket;
        if jacket {
            let surface = body.lapels(&shirt);
            self.add(Material::Shirt, body.shirt_weights(&surface), surface, looks.top_colour.map(|v| 0.9 * v));
        }
        if looks.collar {
            let surface = body.collar();
            let colour = if jacket { looks.second_colour } else { looks.top_colour };
            self.add(Material::Shirt, body.shirt_weights(&surface), surface, colour.map(|v| 0.95 * v));
        }
        let legs = surface_of(&body.trousers(), LEGS_CELL * cm);
        if looks.skirt {
            let surface = surface_of(&body.skirt(), LEGS_CELL * cm);
            self.add(Material::Trousers, body.skirt_weights(&surface), surface, looks.legs_colour);
            self.add(Material::Skin, body.leg_weights(&legs), legs, looks.skin.map(|v| 0.92 * v));
        } else {
            self.add(Material::Trousers, body.leg_weights(&legs), legs, looks.legs_colour);
        }
        for side in 0..2 {
            let surface = surface_of(&body.shoe(side), SHOE_CELL * cm);
            self.add(Material::Shoes, body.leg_weights(&surface), surface, looks.shoes_colour);
        }
    }

    /// Hand with the wrist, and the arm where the sleeve is short.
    fn hand(&mut self, side: usize, hand: &HandForm) {
        let (body, looks) = (self.body, self.looks);
        let size = hand.scale;
        let (palm, finger) = (PALM_CELL * size, FINGER_CELL * size);
        let arm = body.bare_arm(side);
        let on_arm = |d: f64, at: Vec3| arm.as_ref().map_or(d, |arm| joined(d, arm.distance(at), 1.0 * size));
        let light = |at: Vec3| on_arm(hand.whole(at), at);
        let field = |at: Vec3| on_arm(hand.palm(at), at);
        let bounds = hand.bounds(None);
        let surface = match &arm {
            None => Surface::from_field(&field, bounds, palm),
            Some(arm) => {
                let middle = body.stance.positions[body.rig.arms[side].hand];
                let whole = around([bounds, arm.bounds()].into_iter());
                Surface::focused(&field, whole, palm, (middle, ARM_EVEN * size))
            }
        };
        let surface = surface.lit(&light, FINE * palm);
        if arm.is_some() {
            let places = self.along_forearm(side, &surface.points);
            let mesh = self.meshes.entry(Material::Skin).or_default();
            mesh.twist.resize(mesh.surface.points.len(), 0.0);
            mesh.twist.extend(places);
        }
        self.add(Material::Skin, body.palm_weights(side, size, &surface), surface, looks.skin);
        for n in 1..5 {
            let surface =
                Surface::from_field(&|at| hand.finger(n, at), hand.bounds(Some(n)), finger).lit(&light, FINE * finger);
            self.add(Material::Skin, body.finger_weights(side, n, size, &surface), surface, looks.skin);
        }
        if arm.is_none() {
            let surface = surface_of(&body.cuff(side), CUFF_CELL * size);
            let weights = vec![rigid(body.rig.arms[side].fore); surface.points.len()];
            let colour = if looks.top == Top::Jacket { looks.second_colour } else { looks.top_colour };
            self.add(Material::Shirt, weights, surface, colour);
        }
    }

    /// Place of points along a forearm, 0 at the elbow .. 1 at the wrist.
    fn along_forearm(&self, side: usize, points: &[Vec3]) -> Vec<f32> {
        let (arm, places) = (&self.body.rig.arms[side], &self.body.stance.positions);
        let way = sub(places[arm.hand], places[arm.fore]);
        let share = |at: &Vec3| (dot(sub(*at, places[arm.fore]), way) / dot(way, way)).clamp(0.0, 1.0) as f32;
        points.iter().map(share).collect()
    }

    /// Head, ears, hair and the features of the face.
    fn head(&mut self, head: &HeadForm) {
        let (body, looks) = (self.body, self.looks);
        let skin = head.skin_surface();
        let colours = skin.points.iter().map(|&at| head.complexion(at, looks)).collect();
        let shares: Vec<f64> = skin.points.iter().map(|&at| jaw_share(at)).collect();
        let mut features = vec![Feature { material: Material::Face, surface: skin, colours, shares }];
        features.extend(head.features(looks));
        let ear = head.ear_surface();
        for surface in [ear.clone(), ear.mirrored()] {
            let colours = vec![looks.skin; surface.points.len()];
            features.push(Feature { material: Material::Face, surface, colours, shares: Vec::new() });
        }
        if let Some(surface) = head.hair_surface() {
            let colours = surface.points.iter().map(|&at| strand(looks.hair_colour, at)).collect();
            features.push(Feature { material: Material::Hair, surface, colours, shares: Vec::new() });
        }
        for (n, Feature { material, surface, colours, shares }) in features.into_iter().enumerate() {
            let ways = surface.points.iter().zip(shares).map(|(&at, share)| head.scaled(opening(at, share)));
            let ways: Vec<Vec3> = ways.collect();
            let hangs = n == 0 || material == Material::Hair;
            let surface = head.placed(surface);
            let weights =
                if hangs { body.head_weights(&surface) } else { vec![rigid(body.rig.head); surface.points.len()] };
            let mesh = self.meshes.entry(material).or_default();
            if !ways.is_empty() {
                mesh.mouth.resize(mesh.surface.points.len(), [0.0; 3]);
                mesh.mouth.extend(ways);
            }
            mesh.add(weights, surface, colours);
        }
    }
}

fn surface_of(form: &Form, cell: f64) -> Surface {
    let field = |at: Vec3| form.distance(at);
    Surface::from_field(&field, form.bounds(), cell).lit(&field, cell)
}

/// Colour of the hair at a point: lighter and darker strands.
fn strand(colour: Reflectance, [x, y, z]: Vec3) -> Reflectance {
    let light = 1.0 + 0.16 * (3.1 * x + 0.4 * y).sin() * (1.3 * z + 0.7 * y).cos();
    colour.map(|v| v * light as f32)
}
