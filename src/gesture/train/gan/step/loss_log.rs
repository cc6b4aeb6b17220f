//! Losses of the steps of a training. On a GPU they remain in its memory until several steps are read at once, since a read
//! waits for all of its work.

use anyhow::Result;
use candle_core::{Device, Tensor};
use orator_dataset::config::GanSettings;
use orator_nn::gpu::launch::read;

/// Number of steps that are read at once at most.
const N_STEPS: usize = 10;

/// Unweighted losses of one step, and the gradient norm of the generator.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Losses {
    pub l1: f64,
    /// `None` if its weight is 0, and so for `energy`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    pub velocity: f64,
    pub bone: f64,
    pub adversarial: f64,
    pub discriminator: f64,
    pub gradient_norm: f64,
}

impl Losses {
    /// Losses by name, for the check that the training has not diverged.
    pub fn named(&self) -> [(&'static str, f64); 5] {
        [
            ("L1", self.l1),
            ("velocity", self.velocity),
            ("bone", self.bone),
            ("adversarial", self.adversarial),
            ("discriminator", self.discriminator),
        ]
    }
}

/// Values of a step on a GPU, in their order in memory.
#[derive(Clone, Copy)]
pub(super) enum StepValue {
    /// Followed by `speed` and `energy`.
    L1 = 0,
    Velocity = 3,
    Bone = 4,
    Adversarial = 5,
    Discriminator = 6,
    GradientNorm = 7,
    DiscriminatorNorm = 8,
}
const N_VALUES: usize = 9;

/// Losses with the number of their step that have not been taken.
#[derive(Default)]
pub(super) struct LossLog {
    losses: Vec<(usize, Losses)>,
    /// Values of [`N_STEPS`] steps on the GPU, and the steps of those that have been written.
    values: Option<Tensor>,
    written: Vec<usize>,
}

/// Place of the values of one step on a GPU.
pub(super) struct StepValues(Tensor);

impl StepValues {
    /// Tensor [n] that begins with a value.
    pub(super) fn part(&self, value: StepValue, n: usize) -> candle_core::Result<Tensor> {
        self.0.narrow(0, value as usize, n)
    }

    /// Writes a scalar.
    pub(super) fn set(&self, value: StepValue, scalar: &Tensor) -> candle_core::Result<()> {
        self.part(value, 1)?.slice_set(&scalar.detach().reshape(1)?, 0, 0)
    }
}

impl LossLog {
    pub(super) fn push(&mut self, step: usize, losses: Losses) {
        self.losses.push((step, losses));
    }

    /// Place for the values of `step`, initially 0.
    pub(super) fn on_device(&mut self, step: usize, settings: &GanSettings, device: &Device) -> Result<StepValues> {
        if self.written.len() == N_STEPS {
            self.read(settings)?;
        }
        let values = match &self.values {
            Some(values) => values.clone(),
            None => Tensor::zeros(N_STEPS * N_VALUES, candle_core::DType::F32, device)?,
        };
        let of_step = values.narrow(0, self.written.len() * N_VALUES, N_VALUES)?;
        self.values = Some(values);
        self.written.push(step);
        Ok(StepValues(of_step))
    }

    /// Reads the values on the GPU, and starts with new ones.
    fn read(&mut self, settings: &GanSettings) -> Result<()> {
        let Some(values) = self.values.take() else { return Ok(()) };
        let values = read(&values)?;
        for (step, values) in self.written.drain(..).zip(values.chunks_exact(N_VALUES)) {
            let value = |of: StepValue| f64::from(values[of as usize]);
            let weighted = |weight: f64, i: usize| (weight > 0.0).then(|| f64::from(values[i]));
            let losses = Losses {
                l1: value(StepValue::L1),
                speed: weighted(settings.lambda_speed, 1),
                energy: weighted(settings.lambda_energy, 2),
                velocity: value(StepValue::Velocity),
                bone: value(StepValue::Bone),
                adversarial: value(StepValue::Adversarial),
                discriminator: value(StepValue::Discriminator),
                gradient_norm: value(StepValue::GradientNorm),
            };
            self.losses.push((step, losses));
        }
        Ok(())
    }

    /// Takes the losses of all steps since the last call, with the number of their step.
    pub(super) fn take(&mut self, settings: &GanSettings) -> Result<Vec<(usize, Losses)>> {
        self.read(settings)?;
        Ok(std::mem::take(&mut self.losses))
    }
}
