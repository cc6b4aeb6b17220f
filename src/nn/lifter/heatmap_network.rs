//! Hand lifter of Zimmermann & Brox 2017 (section 4.3): score maps of the 21 points and the hand's side to a hand in a
//! canonical frame (`PosePrior`) and the rotation of that frame (`ViewPoint`). The built-in weights are those of the
//! perceptron on coordinates (`hand`), which needs 300 times less computation. Convolutions are matrix products: the
//! input patch of every output pixel becomes a row.

use super::hand;
use super::score_maps::{Crop, MAP_SIZE, N_MAPS, assembled, score_maps};
use crate::Mode;
use crate::cpu::axis::ConvAxis;
use crate::ops::dropout::dropout;
use crate::params::{Init, Params};
use candle_core::{D, Module, Result, Tensor};
use candle_nn::Linear;
use orator_base::motion::view::hand::{HandJoints, HandPoints};
use orator_base::types::skeleton::Side;

/// Prefix of the network's tensors in a weights file.
pub const NAME: &str = hand::NAME;
pub const KIND: &str = "hand-heatmap-lifter";
pub const N_PARAMETERS: usize = 1_637_279 + 2_238_403;
/// Number of heat maps, one per joint of the hand.
pub const MAPS: usize = 21;
/// Batch size when lifting.
const BATCH: usize = 64;
/// Enlargement of the crop when lifting; the mean of the training's range.
const CROP_SCALE: f64 = 1.1;

pub struct HeatmapLifter {
    pose_prior: Tower,
    view_point: Tower,
}

/// Three pairs of convolutions (stride 1, then 2), then fully connected layers; leaky ReLU (0.01) after all layers but
/// the last, dropout between the fully connected ones.
struct Tower {
    convolutions: Vec<Conv3x3>,
    /// Fully connected layers, initialised with Glorot uniform weights and biases of 1e-4.
    layers: Vec<Linear>,
    dropout: f64,
}

impl Tower {
    fn new(params: &mut Params, name: &str, channels: [usize; 3], widths: [usize; 3], dropout: f64) -> Result<Self> {
        let mut convolutions = Vec::new();
        let mut n_in = MAPS;
        for (i, n_out) in channels.into_iter().enumerate() {
            convolutions.push(Conv3x3::new(params, &format!("{name}.conv{}", 2 * i), n_in, n_out, 1)?);
            convolutions.push(Conv3x3::new(params, &format!("{name}.conv{}", 2 * i + 1), n_out, n_out, 2)?);
            n_in = n_out;
        }
        // The side's two values are appended to the flattened output of the convolutions.
        let mut n_in = (MAP_SIZE / 8) * (MAP_SIZE / 8) * n_in + 2;
        let mut layers = Vec::new();
        for (i, n_out) in widths.into_iter().enumerate() {
            layers.push(params.linear(&format!("{name}.dense{i}"), [n_in, n_out], Init::Glorot, 1e-4)?);
            n_in = n_out;
        }
        Ok(Self { convolutions, layers, dropout })
    }

    fn forward(&self, maps: &Tensor, sides: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let leaky = |x: &Tensor| candle_nn::ops::leaky_relu(x, 0.01);
        let mut x = maps.clone();
        for convolution in &self.convolutions {
            x = leaky(&convolution.forward(&x)?)?;
        }
        let mut x = Tensor::cat(&[&x.flatten_from(1)?, sides], 1)?;
        for (i, layer) in self.layers.iter().enumerate() {
            x = layer.forward(&x)?;
            if i + 1 < self.layers.len() {
                x = dropout(&leaky(&x)?, self.dropout, mode)?;
            }
        }
        Ok(x)
    }
}

impl HeatmapLifter {
    /// Creates the networks' tensors under `<name>.pose_prior` (1.64 M parameters) and `<name>.view_point` (2.24 M).
    pub fn new(params: &mut Params, name: &str) -> Result<Self> {
        Ok(Self {
            pose_prior: Tower::new(params, &format!("{name}.pose_prior"), [32, 64, 128], [512, 512, 63], 0.2)?,
            view_point: Tower::new(params, &format!("{name}.view_point"), [64, 128, 256], [256, 128, 3], 0.25)?,
        })
    }

    /// Score maps [B, 32, 32, 21] and sides [B, 2] (left: 1 0, right: 0 1) to [B, 72]: 21 points in the canonical
    /// frame, then the 9 entries of the rotation matrix, row by row.
    pub fn forward(&self, maps: &Tensor, sides: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let points = self.pose_prior.forward(maps, sides, mode)?;
        let turn = rotation(&self.view_point.forward(maps, sides, mode)?)?;
        Tensor::cat(&[&points, &turn], 1)
    }

    /// Lifts hands of one side: wrist at 0, image axes, middle proximal phalanx about 1 long; `None` where too few
    /// points are visible. Left hands are mirrored for the networks.
    pub fn lift(&self, seen: &[HandPoints], side: Side) -> Result<Vec<Option<HandJoints>>> {
        let flip = if side == Side::Left { -1.0 } else { 1.0 };
        let mirrored: Vec<HandPoints> = seen.iter().map(|s| s.map(|p| p.map(|[x, y]| [flip * x, y]))).collect();
        let crops: Vec<Option<Crop>> = mirrored.iter().map(Crop::around).collect();
        let valid_crops: Vec<(usize, Crop)> = crops.iter().enumerate().filter_map(|(i, c)| Some((i, (*c)?))).collect();
        let mut hands = vec![None; seen.len()];
        for batch in valid_crops.chunks(BATCH) {
            let mut maps = vec![0.0; batch.len() * N_MAPS];
            for ((i, crop), maps) in batch.iter().zip(maps.chunks_exact_mut(N_MAPS)) {
                score_maps(&mirrored[*i], Crop { side: CROP_SCALE * crop.side, ..*crop }, maps);
            }
            let shape = (batch.len(), MAP_SIZE, MAP_SIZE, MAPS);
            let maps = Tensor::from_vec(maps, shape, self.pose_prior.layers[0].weight().device())?;
            let rows = self.forward(&maps, &right_sides(batch.len(), &maps)?, &mut Mode::Eval)?.to_vec2::<f32>()?;
            for ((i, _), row) in batch.iter().zip(rows) {
                let at = |j: usize| std::array::from_fn(|k| f64::from(row[3 * j + k]));
                let axes = std::array::from_fn(|k| at(MAPS + k));
                let hand = assembled(&std::array::from_fn(at), &axes);
                hands[*i] = Some(hand.map(|[x, y, z]| [f64::from(flip) * x, y, z]));
            }
        }
        Ok(hands)
    }
}

/// Side input of `n` right hands, of the dtype and on the device of `like`.
pub fn right_sides(n: usize, like: &Tensor) -> Result<Tensor> {
    Tensor::new(&[[0f32, 1.0]], like.device())?.to_dtype(like.dtype())?.repeat((n, 1))
}

/// Axis-angle vectors [B, 3] to rotation matrices [B, 9], by row: Rodrigues' formula with the angle sqrt(|v|^2 + 1e-8).
pub fn rotation(vectors: &Tensor) -> Result<Tensor> {
    let angle = (vectors.sqr()?.sum_keepdim(D::Minus1)? + 1e-8)?.sqrt()?;
    let axis = vectors.broadcast_div(&angle)?;
    let [x, y, z] = [axis.narrow(1, 0, 1)?, axis.narrow(1, 1, 1)?, axis.narrow(1, 2, 1)?];
    let (sin, cos) = (angle.sin()?, angle.cos()?);
    let rest = cos.affine(-1.0, 1.0)?;
    let diagonal = |a: &Tensor| -> Result<Tensor> { &cos + (a.sqr()? * &rest)? };
    let off_diagonal = |a: &Tensor, b: &Tensor, c: &Tensor, sign: f64| -> Result<Tensor> {
        ((a * b)? * &rest)? + ((c * &sin)? * sign)?
    };
    let entries = [
        diagonal(&x)?,
        off_diagonal(&x, &y, &z, -1.0)?,
        off_diagonal(&x, &z, &y, 1.0)?,
        off_diagonal(&x, &y, &z, 1.0)?,
        diagonal(&y)?,
        off_diagonal(&y, &z, &x, -1.0)?,
        off_diagonal(&x, &z, &y, -1.0)?,
        off_diagonal(&y, &z, &x, 1.0)?,
        diagonal(&z)?,
    ];
    Tensor::cat(&entries, 1)
}

/// `<name>.weight` [O, C, 3, 3] (Glorot uniform) and `<name>.bias` [O] (1e-4).
pub struct Conv3x3 {
    pub weight: Tensor,
    pub bias: Tensor,
    pub stride: usize,
}

impl Conv3x3 {
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, stride: usize) -> Result<Self> {
        let (weight, bias) = params.layer(name, &[n_out, n_in, 3, 3], Init::Glorot, Init::Constant(1e-4))?;
        Ok(Self { weight, bias, stride })
    }

    /// [B, H, W, C] to [B, ceil(H / stride), ceil(W / stride), O].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (batch, height, width, n_in) = x.dims4()?;
        let n_out = self.bias.dim(0)?;
        let [down, across] = [height, width].map(|n| ConvAxis::same(n, 3, self.stride));
        let input_indices = Tensor::new(input_indices(batch, down, across), x.device())?;
        let patches =
            x.reshape((batch * height * width, n_in))?.index_select(&input_indices, 0)?.reshape(((), 9 * n_in))?;
        let weight = self.weight.permute((2, 3, 1, 0))?.contiguous()?.reshape((9 * n_in, n_out))?;
        patches.matmul(&weight)?.broadcast_add(&self.bias)?.reshape((batch, down.n_out, across.n_out, n_out))
    }
}

/// Indices of the 3 x 3 input pixels of each output pixel, row by row; `u32::MAX` (zeros) outside the image.
fn input_indices(batch: usize, down: ConvAxis, across: ConvAxis) -> Vec<u32> {
    let at = |axis: ConvAxis, out: usize, offset: usize| {
        (out * axis.stride + offset).checked_sub(axis.pad).filter(|at| *at < axis.n_in)
    };
    let mut input_indices = Vec::with_capacity(batch * down.n_out * across.n_out * 9);
    for (b, row) in (0..batch).flat_map(|b| (0..down.n_out).map(move |row| (b, row))) {
        for (column, offset) in (0..across.n_out).flat_map(|column| (0..9).map(move |offset| (column, offset))) {
            let (y, x) = (at(down, row, offset / 3), at(across, column, offset % 3));
            let index = y.zip(x).map(|(y, x)| ((b * down.n_in + y) * across.n_in + x) as u32);
            input_indices.push(index.unwrap_or(u32::MAX));
        }
    }
    input_indices
}
