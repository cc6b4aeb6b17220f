//! Adam (Kingma & Ba 2015), or AMSGrad (Reddi et al. 2018), as a candle optimiser with moments that can be saved and
//! gradient norm clipping. Each tensor is updated in one pass, bit for bit the same for any number of threads.

use super::device_adam::DeviceAdam;
use anyhow::{Context, ensure};
use candle_core::backprop::GradStore;
use candle_core::{CpuStorage, Device, InplaceOp2, Layout, Result, Tensor, Var};
use candle_nn::Optimizer;
use orator_nn::cpu::spin_pool::{parallel_for, parallel_map};
use orator_nn::gpu::launch::{is_on_device, read};
use orator_nn::params::Params;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Suffixes of the moments in a checkpoint.
const KINDS: [&str; 3] = ["first", "second", "largest"];
/// Elements per task; fixed, so that results do not depend on the number of threads.
const GRAIN: usize = 32 * 1024;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    pub beta1: f64,
    pub beta2: f64,
    pub eps: f64,
    /// Divide by the largest second moment so far instead of the current one.
    pub amsgrad: bool,
    /// Gradients whose Euclidean norm over all tensors is larger are scaled down to this norm.
    pub max_norm: Option<f64>,
    /// Decoupled weight decay per step at learning rate 1 (Loshchilov & Hutter 2019), for tensors of two or more axes.
    pub weight_decay: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { beta1: 0.9, beta2: 0.999, eps: 1e-8, amsgrad: false, max_norm: None, weight_decay: 0.0 }
    }
}

/// Optimiser of the trainable tensors of one [`Params`].
pub struct Adam {
    config: Config,
    learning_rate: f64,
    /// Number of updates so far.
    step: u64,
    /// Norm of the last gradient, before clipping.
    norm: f64,
    slots: Vec<AdamSlot>,
    /// Moments of tensors on a GPU.
    device: Option<DeviceAdam>,
}

struct AdamSlot {
    name: String,
    var: Var,
    /// Factors of the learning rate and of the weight decay for this tensor.
    factors: [f64; 2],
    moments: RefCell<AdamMoments>,
}

/// Factors of a gradient and of an update, equal for all elements of a tensor.
#[derive(Clone, Copy)]
struct AdamScalars {
    beta1: f32,
    beta2: f32,
    eps: f32,
    /// Factor that clips the gradients.
    scale: f32,
    /// Learning rate divided by the bias correction of the first moment.
    rate: f32,
    /// Square root of the inverse bias correction of the second moment.
    correction: f32,
    /// Factor of the weights that applies the weight decay.
    keep: f32,
}

/// First moment, second moment, largest second moment (empty without AMSGrad); all empty on a GPU.
#[derive(Clone, Default)]
struct AdamMoments {
    first: Vec<f32>,
    second: Vec<f32>,
    largest: Vec<f32>,
}

impl Adam {
    /// Optimiser with zero moments for every trainable tensor (f32).
    pub fn new(params: &Params, config: Config) -> Result<Self> {
        Self::with_rates(params, config, |_| [1.0; 2])
    }

    /// Like `new`, with factors of the learning rate and of the weight decay for each tensor by its name; a tensor whose
    /// learning rate has the factor 0 is frozen.
    pub fn with_rates(params: &Params, config: Config, factors: impl Fn(&str) -> [f64; 2]) -> Result<Self> {
        let slot = |(name, var): (&str, &Var)| (name.to_owned(), var.clone(), factors(name));
        Self::of(params.trainables().map(slot).collect(), config)
    }

    fn of(tensors: Vec<(String, Var, [f64; 2])>, config: Config) -> Result<Self> {
        let is_on_device = tensors.first().is_some_and(|(_, var, _)| is_on_device(var));
        let on_device = || tensors.iter().map(|(_, var, factors)| (var.clone(), *factors)).collect();
        let device = if is_on_device { Some(DeviceAdam::new(on_device(), &config)?) } else { None };
        let slot = |(name, var, factors): (String, Var, [f64; 2])| {
            let zeros = vec![0.0; if is_on_device { 0 } else { var.elem_count() }];
            let largest = if config.amsgrad { zeros.clone() } else { Vec::new() };
            let moments = RefCell::new(AdamMoments { first: zeros.clone(), second: zeros, largest });
            AdamSlot { name, var, factors, moments }
        };
        let slots = tensors.into_iter().map(slot).collect();
        Ok(Self { config, learning_rate: 1e-3, step: 0, norm: 0.0, slots, device })
    }

    /// Runs one update at this learning rate; a tensor without a gradient is unchanged. Returns the gradient norm
    /// before clipping; if it is not finite, nothing is updated.
    pub fn step(&mut self, gradients: &GradStore, learning_rate: f64) -> Result<f64> {
        self.learning_rate = learning_rate;
        Optimizer::step(self, gradients)?;
        Ok(self.norm)
    }

    /// Runs one update with the gradients of `loss`, of tensors on a GPU; writes the gradient norm before clipping to
    /// `norm` [1], without reading it.
    pub fn minimise(&mut self, loss: &Tensor, learning_rate: f64, norm: &Tensor) -> Result<()> {
        let Some(device) = &self.device else { candle_core::bail!("Adam: expected tensors on a GPU") };
        device.add_gradients_of(loss)?;
        self.step += 1;
        device.update(&self.config, self.step, learning_rate, Some(norm))?;
        Ok(())
    }

    /// Moments and step count for a checkpoint: `<prefix><tensor>.first`, `.second`, `.largest`, and `<prefix>step`.
    pub fn tensors(&self, prefix: &str) -> Result<BTreeMap<String, Tensor>> {
        let mut tensors = BTreeMap::new();
        // f32, the only type in a checkpoint, represents two halves of 24 bits exactly.
        let halves = [(self.step >> 24) as f32, (self.step & 0xff_ffff) as f32];
        tensors.insert(format!("{prefix}step"), Tensor::new(&halves, &Device::Cpu)?);
        for (number, slot) in self.slots.iter().enumerate() {
            let moments = match &self.device {
                Some(device) => KINDS.into_iter().zip(device.moments(number)?).collect(),
                None => slot.moments()?,
            };
            for (kind, tensor) in moments {
                tensors.insert(format!("{prefix}{}.{kind}", slot.name), tensor);
            }
        }
        Ok(tensors)
    }

    /// Restores the state saved by [`Adam::tensors`]. Fails, naming the tensor, if one is missing or has another size.
    pub fn load(&mut self, prefix: &str, tensors: &BTreeMap<String, Tensor>) -> anyhow::Result<()> {
        let values = |name: String, n: usize| -> anyhow::Result<Vec<f32>> {
            let tensor = tensors.get(&name).with_context(|| format!("tensor {name} is missing"))?;
            ensure!(tensor.elem_count() == n, "tensor {name} has {} values, expected {n}", tensor.elem_count());
            Ok(tensor.flatten_all()?.to_vec1()?)
        };
        let halves = values(format!("{prefix}step"), 2)?;
        for (number, slot) in self.slots.iter_mut().enumerate() {
            let of_kind = |kind: &str, n: usize| match n {
                0 => Ok(Vec::new()),
                n => values(format!("{prefix}{}.{kind}", slot.name), n),
            };
            if let Some(device) = &self.device {
                let n_kinds = if self.config.amsgrad { 3 } else { 2 };
                let all = KINDS[..n_kinds].iter().map(|kind| of_kind(kind, slot.var.elem_count()));
                device.set_moments(number, all.collect::<anyhow::Result<_>>()?)?;
                continue;
            }
            let moments = slot.moments.get_mut();
            *moments = AdamMoments {
                first: of_kind("first", moments.first.len())?,
                second: of_kind("second", moments.second.len())?,
                largest: of_kind("largest", moments.largest.len())?,
            };
        }
        self.step = ((halves[0] as u64) << 24) + halves[1] as u64;
        Ok(())
    }
}

impl Optimizer for Adam {
    type Config = Config;

    /// Optimiser of unnamed tensors with learning rate 0.001.
    fn new(vars: Vec<Var>, config: Config) -> Result<Self> {
        Self::of(vars.into_iter().map(|var| (String::new(), var, [1.0; 2])).collect(), config)
    }

    fn learning_rate(&self) -> f64 {
        self.learning_rate
    }

    fn set_learning_rate(&mut self, learning_rate: f64) {
        self.learning_rate = learning_rate;
    }

    fn step(&mut self, gradients: &GradStore) -> Result<()> {
        let learning_rate = self.learning_rate;
        if let Some(device) = &self.device {
            device.add(gradients)?;
            let norm = device.update(&self.config, self.step + 1, learning_rate, None)?;
            self.norm = f64::from(read(norm)?[0]);
            self.step += u64::from(self.norm.is_finite());
            return Ok(());
        }
        let gradients: Vec<Option<Tensor>> = self
            .slots
            .iter()
            .map(|slot| gradients.get(&slot.var).map(Tensor::contiguous).transpose())
            .collect::<Result<_>>()?;
        let mut squares = 0.0;
        for gradient in gradients.iter().flatten() {
            squares += orator_nn::cpu::tensor::read::<f32, _>(gradient, |g| Ok(sum_of_squares(g)))?;
        }
        let norm = squares.sqrt();
        self.norm = norm;
        if !norm.is_finite() {
            return Ok(());
        }
        self.step += 1;
        let Config { beta1, beta2, eps, max_norm, weight_decay, .. } = self.config;
        let age = self.step.min(i32::MAX as u64) as i32;
        let scale = max_norm.map_or(1.0, |max| if norm > max { max / norm } else { 1.0 });
        let scalars = AdamScalars {
            beta1: beta1 as f32,
            beta2: beta2 as f32,
            eps: eps as f32,
            scale: scale as f32,
            rate: 0.0,
            correction: (1.0 / (1.0 - beta2.powi(age))).sqrt() as f32,
            keep: 1.0,
        };
        for (slot, gradient) in self.slots.iter().zip(&gradients) {
            let [share, decay] = slot.factors;
            let Some(gradient) = gradient.as_ref().filter(|_| share > 0.0) else { continue };
            let keep = if slot.var.rank() > 1 { 1.0 - learning_rate * share * decay * weight_decay } else { 1.0 };
            let rate = learning_rate * share / (1.0 - beta1.powi(age));
            let scalars = AdamScalars { rate: rate as f32, keep: keep as f32, ..scalars };
            slot.var.inplace_op2(gradient, &AdamUpdate { moments: &slot.moments, scalars })?;
        }
        Ok(())
    }
}

impl AdamSlot {
    /// Copies of the existing moments by kind.
    fn moments(&self) -> Result<Vec<(&'static str, Tensor)>> {
        let moments = self.moments.borrow();
        let there = KINDS.into_iter().zip([&moments.first, &moments.second, &moments.largest]);
        let there = there.filter(|(_, values)| !values.is_empty());
        there.map(|(kind, values)| Ok((kind, Tensor::from_slice(values, self.var.shape(), &Device::Cpu)?))).collect()
    }
}

/// Sum of squares over pieces of fixed size, so that the order of summation does not depend on the number of threads.
fn sum_of_squares(values: &[f32]) -> f64 {
    let of_piece = |piece: &[f32]| {
        let mut lanes = [0.0f32; 16];
        for chunk in piece.chunks(16) {
            lanes.iter_mut().zip(chunk).for_each(|(lane, v)| *lane += v * v);
        }
        lanes.iter().map(|lane| f64::from(*lane)).sum::<f64>()
    };
    let pieces: Vec<&[f32]> = values.chunks(GRAIN).collect();
    parallel_map(pieces.len(), |piece| of_piece(pieces[piece])).into_iter().sum()
}

struct AdamUpdate<'a> {
    moments: &'a RefCell<AdamMoments>,
    scalars: AdamScalars,
}

impl InplaceOp2 for AdamUpdate<'_> {
    fn name(&self) -> &'static str {
        "adam"
    }

    fn cpu_fwd(&self, values: &mut CpuStorage, layout: &Layout, grad: &CpuStorage, grad_layout: &Layout) -> Result<()> {
        let CpuStorage::F32(values) = values else { candle_core::bail!("Adam needs f32 tensors") };
        let Some((start, end)) = layout.contiguous_offsets() else { candle_core::bail!("Adam: not contiguous") };
        let grad = orator_nn::cpu::tensor::slice::<f32>(grad, grad_layout)?;
        let moments = &mut *self.moments.borrow_mut();
        let AdamScalars { beta1, beta2, eps, scale, rate, correction, keep } = self.scalars;
        let update = |value: &mut f32, grad: &f32, first: &mut f32, second: &mut f32, largest: Option<&mut f32>| {
            let grad = grad * scale;
            *first = beta1 * *first + (1.0 - beta1) * grad;
            *second = beta2 * *second + (1.0 - beta2) * grad * grad;
            let spread = match largest {
                Some(largest) => {
                    *largest = largest.max(*second);
                    *largest
                }
                None => *second,
            };
            *value = keep * *value - rate * *first / (spread.sqrt() * correction + eps);
        };
        let values = values[start..end].chunks_mut(GRAIN).zip(grad.chunks(GRAIN));
        let both = values.zip(moments.first.chunks_mut(GRAIN)).zip(moments.second.chunks_mut(GRAIN));
        let mut largest = moments.largest.chunks_mut(GRAIN);
        let pieces: Vec<_> = both.map(|piece| Mutex::new((piece, largest.next()))).collect();
        parallel_for(pieces.len(), |piece| {
            // Each piece is locked by exactly one task, so the lock is never contended.
            let Ok(mut piece) = pieces[piece].lock() else { return };
            let piece = &mut *piece;
            let (((values, grad), first), second) = &mut piece.0;
            let scalars = values.iter_mut().zip(grad.iter()).zip(first.iter_mut().zip(second.iter_mut()));
            match &mut piece.1 {
                Some(largest) => {
                    scalars.zip(largest.iter_mut()).for_each(|(((v, g), (f, s)), l)| update(v, g, f, s, Some(l)));
                }
                None => scalars.for_each(|((v, g), (f, s))| update(v, g, f, s, None)),
            }
        });
        Ok(())
    }
}
