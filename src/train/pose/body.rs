//! What the body network learns: from the picture of a person, for each point a bell at its place. A hidden point counts
//! half; one without a label, or outside the crop, shall give an empty map.

use super::crop::PersonCrop;
use super::disturb::disturb;
use super::measure;
use super::measure::PredictedPoint;
use super::people::LabelledPerson;
use crate::external::opencv::tensor::Normaliser;
use crate::nn::Mode;
use crate::nn::params::Params;
use crate::nn::pose::body::{BodyNet, BodyNetConfig, CELL_PX};
use crate::train::supervised::TrainingTask;
use crate::types::pose2d::N_BODY;
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::OnceLock;

/// Mean and deviation of the three channels, as of ImageNet, on bytes / 255.
const MEAN: [f64; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f64; 3] = [0.229, 0.224, 0.225];
/// Standard deviation of a bell, cells.
const BELL: f64 = 1.5;
/// Weight of each point in the loss: face, shoulders, elbows, wrists, hips, legs.
const WEIGHTS: [f32; N_BODY] = [1.0, 1.0, 1.0, 1.0, 1.0, 1.2, 1.2, 1.5, 1.5, 2.0, 2.0, 0.8, 0.8, 0.4, 0.4, 0.4, 0.4];
/// Weight of a point that cannot be seen.
const UNSEEN: f32 = 0.5;
/// Cell of a bell that lies outside of every map.
const NOWHERE: f32 = -1000.0;
/// People that errors are measured on, on the way and at the end.
const MEASURED_BRIEFLY: usize = 96;
const MEASURED: usize = 1000;
/// People that go through the network together when measuring.
const BATCH: usize = 16;

/// Training task of the network.
pub struct BodyNetTask {
    params: Params,
    net: BodyNet,
    people: Vec<LabelledPerson>,
    held_out: Vec<LabelledPerson>,
    normaliser: Normaliser,
    /// Why a picture could not be read.
    failure: OnceLock<String>,
}

impl BodyNetTask {
    /// A network with first values from `seed` that learns from `people`; `held_out` are only measured on. Errors:
    /// nobody to learn from.
    pub fn new(
        people: Vec<LabelledPerson>,
        held_out: Vec<LabelledPerson>,
        config: &BodyNetConfig,
        seed: u64,
    ) -> Result<Self> {
        ensure!(!people.is_empty(), "nobody is labelled: the body network learns from people");
        let mut params = Params::new(seed);
        let net = BodyNet::new(&mut params, config)?;
        let normaliser = Normaliser::new(false, false, 1.0 / 255.0, MEAN, DEVIATION);
        Ok(Self { params, net, people, held_out, normaliser, failure: OnceLock::new() })
    }

    pub fn net(&self) -> &BodyNet {
        &self.net
    }

    /// A training picture with its bells; a picture that cannot be read stops the training at the next loss.
    fn draw(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) -> Result<()> {
        let person = &self.people[rng.random_range(0..self.people.len())];
        let crop = self.crop(person)?.disturbed(rng);
        self.normaliser.fill(&disturb(person.picture(&crop)?, rng)?, x);
        for (point, y) in y.chunks_exact_mut(3).enumerate() {
            let [px, py, v] = person.points[if crop.is_mirrored { mirror(point) } else { point }];
            let place = crop.place([px, py]).map(|px| (px / CELL_PX as f64) as f32);
            let [cell_x, cell_y] = if v > 0.0 { place } else { [NOWHERE; 2] };
            y.copy_from_slice(&[cell_x, cell_y, if v == 2.0 { 1.0 } else { UNSEEN }]);
        }
        Ok(())
    }

    fn crop(&self, person: &LabelledPerson) -> Result<PersonCrop> {
        let none = || format!("{}: a person's box is no place", person.picture.display());
        PersonCrop::around(person.bbox, self.net.config().size).with_context(none)
    }

    /// Points of people in their pictures, by the network as it is.
    pub fn predict(&self, people: &[LabelledPerson]) -> Result<Vec<[PredictedPoint; N_BODY]>> {
        let [height, width] = self.net.config().size;
        let n_in = 3 * height * width;
        let mut points = Vec::with_capacity(people.len());
        for some in people.chunks(BATCH) {
            let mut x = vec![0.0; some.len() * n_in];
            let crops = some.iter().map(|person| self.crop(person)).collect::<Result<Vec<_>>>()?;
            x.par_chunks_mut(n_in).zip(some).zip(&crops).try_for_each(|((x, person), crop)| -> Result<()> {
                self.normaliser.fill(&person.picture(crop)?, x);
                Ok(())
            })?;
            let x = Tensor::from_vec(x, (some.len(), height, width, 3), &Device::Cpu)?;
            let maps = self.net.forward(&x, false)?.permute((0, 3, 1, 2))?.contiguous()?;
            let maps = maps.flatten_all()?.to_vec1::<f32>()?;
            let [rows, columns] = self.net.config().cells();
            for (maps, crop) in maps.chunks_exact(N_BODY * rows * columns).zip(&crops) {
                let mut of_point = maps.chunks_exact(rows * columns).map(|map| {
                    let ([x, y], score) = peak(map, columns);
                    let [x, y] = crop.src_from_dst().apply([x, y].map(|cell| CELL_PX as f64 * cell));
                    [x, y, score]
                });
                points.push(std::array::from_fn(|_| of_point.next().unwrap_or_default()));
            }
        }
        Ok(points)
    }
}

/// Counterpart of a point on the other side of the body.
fn mirror(point: usize) -> usize {
    match point {
        0 => 0,
        left if left % 2 == 1 => left + 1,
        right => right - 1,
    }
}

/// Place of the highest cell, a quarter towards its higher neighbours, and its height.
fn peak(map: &[f32], columns: usize) -> ([f64; 2], f64) {
    let (at, height) =
        map.iter().enumerate().fold((0, f32::MIN), |best, (at, v)| if *v > best.1 { (at, *v) } else { best });
    let (x, y) = (at % columns, at / columns);
    let towards = |is_inside: bool, step: usize| {
        let sides = is_inside.then(|| Some((map.get(at.checked_sub(step)?)?, map.get(at + step)?))).flatten();
        sides.map_or(0.0, |(before, after)| {
            0.25 * f64::from(u8::from(after > before)) - 0.25 * f64::from(u8::from(after < before))
        })
    };
    let place = [x as f64 + towards(x > 0 && x + 1 < columns, 1), y as f64 + towards(true, columns)];
    (place, f64::from(height))
}

impl TrainingTask for BodyNetTask {
    fn kind(&self) -> &'static str {
        "body-net"
    }

    fn metadata(&self) -> Value {
        let mut hash = blake3::Hasher::new();
        for person in &self.people {
            hash.update(person.picture.file_name().unwrap_or_default().as_encoded_bytes());
            for number in person.bbox.iter().chain(person.points.iter().flatten()) {
                hash.update(&number.to_le_bytes());
            }
        }
        json!({
            "config": self.net.config(),
            "people": self.people.len(),
            "held_out": self.held_out.len(),
            "labels": hash.finalize().to_hex().as_str(),
        })
    }

    fn params(&self) -> &Params {
        &self.params
    }

    fn shape_in(&self) -> Vec<usize> {
        let [height, width] = self.net.config().size;
        vec![height, width, 3]
    }

    fn weights(&self) -> Vec<f32> {
        WEIGHTS.to_vec()
    }

    /// What should come out is of each point column and row in cells, and its weight.
    fn sample(&self, rng: &mut ChaCha8Rng, x: &mut [f32], y: &mut [f32]) {
        if let Err(error) = self.draw(rng, x, y) {
            let _ = self.failure.set(format!("{error:#}"));
        }
    }

    /// [B, H, W, 3] to heat-maps [B, H / 4, W / 4, 17].
    fn forward(&self, x: &Tensor, mode: &mut Mode) -> candle_core::Result<Tensor> {
        self.net.forward(x, mode.trains())
    }

    /// Squared difference from the bells, summed over a map; an empty map for a bell costs 1.
    fn loss(&self, out: &Tensor, wanted: &Tensor, weights: &Tensor) -> candle_core::Result<Tensor> {
        if let Some(failure) = self.failure.get() {
            candle_core::bail!("{failure}");
        }
        let (_, rows, columns, _) = out.dims4()?;
        let along = |axis: usize, n: usize| -> candle_core::Result<Tensor> {
            let cells = Tensor::arange(0.0, n as f32, out.device())?.reshape((1, 1, n))?;
            let off = wanted.narrow(2, axis, 1)?.broadcast_sub(&cells)?.sqr()?;
            (off * (-0.5 / (BELL * BELL)))?.exp()
        };
        let bells = along(1, rows)?.unsqueeze(3)?.broadcast_mul(&along(0, columns)?.unsqueeze(2)?)?;
        let maps = out.permute((0, 3, 1, 2))?.contiguous()?;
        let off = (maps - bells)?.sqr()?.flatten_from(2)?.sum(2)?;
        let weights = wanted.narrow(2, 2, 1)?.squeeze(2)?.broadcast_mul(weights)?;
        (off * weights)?.mean_all()? / (std::f64::consts::PI * BELL * BELL)
    }

    fn set_momentum(&mut self, momentum: f64) {
        self.net.set_momentum(momentum);
    }

    fn errors(&self, brief: bool) -> Result<Vec<String>> {
        let n = if brief { MEASURED_BRIEFLY } else { MEASURED };
        let some = &self.held_out[..n.min(self.held_out.len())];
        Ok(measure::lines(some, &self.predict(some)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_leans_to_its_higher_neighbour() {
        let mut map = vec![0.0; 20];
        (map[11], map[12], map[16]) = (0.8, 0.3, 0.1);
        assert_eq!(peak(&map, 5), ([1.25, 2.25], f64::from(0.8f32)));
        map[0] = 0.9;
        assert_eq!(peak(&map, 5).0, [0.0, 0.0]);
        assert_eq!([0, 1, 2, 9, 16].map(mirror), [0, 2, 1, 10, 15]);
    }
}
