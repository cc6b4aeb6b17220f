//! The heat-map hand lifter agrees with the same network in PyTorch (`fixtures/reference/heatmap_reference.py`). Both
//! sides compute weights and input from the same formula.

use crate::fixtures::networks::fill;
use candle_core::{DType, Device, Tensor};
use orator_nn::Mode;
use orator_nn::lifter::heatmap_network::{HeatmapLifter, NAME};
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;

#[derive(serde::Deserialize)]
struct Golden {
    shape: Vec<usize>,
    values: Vec<f32>,
}

#[test]
fn the_heatmap_lifter_agrees_with_pytorch() -> anyhow::Result<()> {
    let golden: Golden = serde_json::from_str(include_str!("../../../fixtures/reference/heatmap_golden.json"))?;
    let mut params = Params::new(0);
    let net = HeatmapLifter::new(&mut params, NAME)?;
    fill(&params)?;
    let maps = pattern(&[2, 32, 32, 21], 1.0)?.to_dtype(DType::F32)?;
    let sides = Tensor::new(&[[1f32, 0.0], [0.0, 1.0]], &Device::Cpu)?;
    let y = net.forward(&maps, &sides, &mut Mode::Eval)?;
    assert_eq!(y.dims(), golden.shape);
    let scale = golden.values.iter().fold(1.0f32, |most, v| most.max(v.abs()));
    for (i, (y, expected)) in y.flatten_all()?.to_vec1::<f32>()?.iter().zip(&golden.values).enumerate() {
        assert!((y - expected).abs() < 1e-5 * scale, "value {i}: {y}, expected {expected}");
    }
    Ok(())
}
