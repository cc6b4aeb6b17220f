//! Parameters of a network: named tensors, initialised from a seed, sorted by name, and their device. The initial
//! values of a tensor depend only on the seed and its name, so that adding a layer leaves the others unchanged.
//! (candle-nn's `VarMap` uses one generator for all tensors and does not distinguish buffers from trainable tensors.)

use anyhow::{Context, bail, ensure};
use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::Linear;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Init {
    Constant(f64),
    /// Uniform in +-sqrt(6 / (fan in + fan out)), fans of a weight [out, in, taps...] (Glorot 2010).
    Glorot,
    /// Uniform in +-sqrt(6 / fan in) (He 2015).
    He,
    /// Uniform in +- this bound.
    Uniform(f64),
}

/// Named tensors of one or more networks.
pub struct Params {
    /// Seed of the initial values; `None` for inference.
    seed: Option<u64>,
    dtype: DType,
    device: Device,
    trainable: BTreeMap<String, Var>,
    /// Tensors that are saved but not updated by the optimiser, such as running statistics.
    buffers: BTreeMap<String, Var>,
}

impl Params {
    /// Creates an empty set in f32.
    pub fn new(seed: u64) -> Self {
        Self::with_dtype(seed, DType::F32)
    }

    /// Creates an empty set of this type (f64 for gradient checks).
    pub fn with_dtype(seed: u64, dtype: DType) -> Self {
        let (trainable, buffers) = (BTreeMap::new(), BTreeMap::new());
        Self { seed: Some(seed), dtype, device: Device::Cpu, trainable, buffers }
    }

    /// Sets the device of the tensors that are created afterwards. Initial values do not depend on the device.
    pub fn on(self, device: &Device) -> Self {
        Self { device: device.clone(), ..self }
    }

    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Creates an empty set in f32 for a network that is loaded and not trained. Forward passes build no graph, so
    /// that intermediate results are freed early. All values are 0 until loaded.
    pub fn frozen() -> Self {
        Self { seed: None, ..Self::new(0) }
    }

    /// Creates a tensor that the optimiser updates.
    ///
    /// # Errors
    /// The name is already used.
    pub fn trainable(&mut self, name: &str, shape: &[usize], init: Init) -> Result<Tensor> {
        let var = self.make(name, shape, init)?;
        let tensor = if self.seed.is_some() { var.as_tensor().clone() } else { var.as_detached_tensor() };
        self.trainable.insert(name.to_owned(), var);
        Ok(tensor)
    }

    /// Creates a layer's `<name>.weight` of this shape [out, ...] and `<name>.bias` [out].
    pub fn layer(&mut self, name: &str, shape: &[usize], weight: Init, bias: Init) -> Result<(Tensor, Tensor)> {
        let weight = self.trainable(&format!("{name}.weight"), shape, weight)?;
        Ok((weight, self.trainable(&format!("{name}.bias"), &shape[..1], bias)?))
    }

    /// Creates a fully connected layer.
    pub fn linear(&mut self, name: &str, [n_in, n_out]: [usize; 2], weight: Init, bias: f64) -> Result<Linear> {
        let (weight, bias) = self.layer(name, &[n_out, n_in], weight, Init::Constant(bias))?;
        Ok(Linear::new(weight, Some(bias)))
    }

    /// Creates a tensor that is saved with the others but updated only by its owner.
    pub fn buffer(&mut self, name: &str, shape: &[usize], value: f64) -> Result<Var> {
        let var = self.make(name, shape, Init::Constant(value))?;
        self.buffers.insert(name.to_owned(), var.clone());
        Ok(var)
    }

    fn make(&self, name: &str, shape: &[usize], init: Init) -> Result<Var> {
        if self.trainable.contains_key(name) || self.buffers.contains_key(name) {
            candle_core::bail!("duplicate tensor name {name}");
        }
        let fan = |dims: &[usize]| dims.iter().product::<usize>().max(1) as f64;
        let kernel_len = fan(shape.get(2..).unwrap_or(&[]));
        let (fan_out, fan_in) = (fan(&shape[..shape.len().min(1)]) * kernel_len, fan(shape.get(1..).unwrap_or(&[])));
        let n: usize = shape.iter().product();
        let values: Vec<f64> = match (self.seed, init) {
            (None, _) => vec![0.0; n],
            (_, Init::Constant(value)) => vec![value; n],
            (Some(seed), Init::Glorot) => uniform(seed, name, n, (6.0 / (fan_in + fan_out)).sqrt()),
            (Some(seed), Init::He) => uniform(seed, name, n, (6.0 / fan_in).sqrt()),
            (Some(seed), Init::Uniform(bound)) => uniform(seed, name, n, bound),
        };
        let values = Tensor::from_vec(values, shape, &Device::Cpu)?.to_dtype(self.dtype)?;
        Var::from_tensor(&values.to_device(&self.device)?)
    }

    /// Tensors that the optimiser updates, sorted by name.
    pub fn trainables(&self) -> impl Iterator<Item = (&str, &Var)> {
        self.trainable.iter().map(|(name, var)| (name.as_str(), var))
    }

    /// All saved tensors: the trainable ones, then the buffers, each sorted by name.
    pub fn all(&self) -> impl Iterator<Item = (&str, &Var)> {
        self.trainable.iter().chain(&self.buffers).map(|(name, var)| (name.as_str(), var))
    }

    /// Number of values that the optimiser updates.
    pub fn n_parameters(&self) -> usize {
        self.trainable.values().map(|var| var.elem_count()).sum()
    }

    pub fn tensors(&self) -> Result<BTreeMap<String, Tensor>> {
        let copy = |var: &Var| if var.device().is_cpu() { var.copy() } else { var.to_device(&Device::Cpu) };
        self.all().map(|(name, var)| Ok((name.to_owned(), copy(var)?))).collect()
    }

    /// Overwrites every tensor with the one of the same name.
    ///
    /// # Errors
    /// A tensor is missing, unknown or has another shape; the message names it.
    pub fn load(&self, tensors: &BTreeMap<String, Tensor>) -> anyhow::Result<()> {
        for (name, var) in self.all() {
            let tensor = tensors.get(name).with_context(|| format!("tensor {name} is missing"))?;
            ensure!(
                tensor.shape() == var.shape(),
                "tensor {name} has shape {:?}, expected {:?}",
                tensor.dims(),
                var.dims()
            );
            var.set(&tensor.to_dtype(self.dtype)?.to_device(&self.device)?)?;
        }
        match tensors.keys().find(|name| !self.all().any(|(own, _)| own == name.as_str())) {
            Some(name) => bail!("unexpected tensor {name}: this network has no such layer"),
            None => Ok(()),
        }
    }
}

fn uniform(seed: u64, name: &str, n: usize, bound: f64) -> Vec<f64> {
    let key = [&seed.to_le_bytes(), name.as_bytes()].concat();
    let mut rng = ChaCha8Rng::from_seed(*blake3::hash(&key).as_bytes());
    (0..n).map(|_| rng.random_range(-bound..bound)).collect()
}
