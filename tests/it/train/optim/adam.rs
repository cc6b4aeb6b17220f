//! Adam against the formulas of its papers: resumed, with scaled rates, with clipped gradients.

use candle_core::{Device, Result, Tensor};
use orator_gesture::train::optim::adam::{Adam, Config};
use orator_nn::params::{Init, Params};

/// Reference implementation for one f64 parameter that starts at 1.
fn reference(gradients: &[f64], rate: f64, amsgrad: bool) -> f64 {
    let (mut x, mut m, mut v, mut largest) = (1.0, 0.0, 0.0, 0.0f64);
    for (t, g) in (1..).zip(gradients) {
        m = 0.9 * m + 0.1 * g;
        v = 0.999 * v + 0.001 * g * g;
        largest = largest.max(v);
        let spread: f64 = if amsgrad { largest } else { v };
        x -= rate * (m / (1.0 - 0.9f64.powi(t))) / ((spread / (1.0 - 0.999f64.powi(t))).sqrt() + 1e-8);
    }
    x
}

fn descend(config: Config, gradients: &[f64], resume_at: Option<usize>) -> anyhow::Result<f32> {
    let mut params = Params::new(0);
    let w = params.trainable("w", &[3], Init::Constant(1.0))?;
    let mut adam = Adam::new(&params, config)?;
    for (i, gradient) in gradients.iter().enumerate() {
        if resume_at == Some(i) {
            let saved = adam.tensors("adam.")?;
            adam = Adam::new(&params, config)?;
            adam.load("adam.", &saved)?;
        }
        adam.step(&(&w * *gradient)?.sum_all()?.backward()?, 0.1)?;
    }
    Ok(w.to_vec1::<f32>()?[1])
}

#[test]
fn agrees_with_the_papers_and_resumes_exactly() -> anyhow::Result<()> {
    let gradients = [1.0, -3.0, 0.2, 0.1, 0.4, -0.3];
    for amsgrad in [false, true] {
        let config = Config { amsgrad, ..Config::default() };
        let w = descend(config, &gradients, None)?;
        assert!((f64::from(w) - reference(&gradients, 0.1, amsgrad)).abs() < 1e-5);
        assert_eq!(w.to_bits(), descend(config, &gradients, Some(3))?.to_bits());
    }
    Ok(())
}

#[test]
fn rates_of_tensors_are_scaled() -> anyhow::Result<()> {
    let mut params = Params::new(0);
    let shares = [("all", 1.0), ("some", 0.25), ("none", 0.0)];
    let tensors = shares.map(|(name, _)| params.trainable(name, &[2, 1], Init::Constant(1.0)));
    let tensors = tensors.into_iter().collect::<Result<Vec<_>>>()?;
    let share = |name: &str| shares.iter().find(|(of, _)| *of == name).map_or(f64::NAN, |(_, share)| *share);
    let config = Config { weight_decay: 0.5, ..Config::default() };
    let mut adam = Adam::with_rates(&params, config, |name| [share(name), 0.0])?;
    let gradients = [1.0, -3.0, 0.2, 0.1];
    for gradient in gradients {
        let sum = tensors.iter().try_fold(Tensor::new(0f32, &Device::Cpu)?, |sum, w| sum + w.sum_all()?)?;
        adam.step(&(sum * gradient)?.backward()?, 0.1)?;
    }
    for (w, (name, share)) in tensors.iter().zip(shares) {
        let w = f64::from(w.flatten_all()?.to_vec1::<f32>()?[1]);
        assert!((w - reference(&gradients, 0.1 * share, false)).abs() < 1e-5, "{name}: {w}");
    }
    Ok(())
}

#[test]
fn large_gradients_are_clipped_and_non_finite_ones_are_ignored() -> anyhow::Result<()> {
    let mut params = Params::new(0);
    let w = params.trainable("w", &[4], Init::Constant(1.0))?;
    let mut adam = Adam::new(&params, Config { max_norm: Some(1.0), ..Config::default() })?;
    let norm = adam.step(&(&w * 5.0)?.sum_all()?.backward()?, 0.1)?;
    assert!((norm - 10.0).abs() < 1e-5);
    assert!((adam.tensors("")?["w.first"].to_vec1::<f32>()?[0] - 0.05).abs() < 1e-6);
    let before = w.to_vec1::<f32>()?;
    assert!(adam.step(&(&w * f64::NAN)?.sum_all()?.backward()?, 0.1)?.is_nan());
    assert_eq!(w.to_vec1::<f32>()?, before);
    Ok(())
}
