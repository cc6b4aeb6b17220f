//! Tests of `orator_nn::lifter::heatmap_network`.

use candle_core::{DType, Device, Result, Tensor};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_nn::Mode;
use orator_nn::lifter::heatmap_network::{Conv3x3, HeatmapLifter, MAPS, N_PARAMETERS, NAME, rotation};
use orator_nn::lifter::score_maps::MAP_SIZE;
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

#[test]
fn the_layers_have_the_published_sizes() -> anyhow::Result<()> {
    let mut params = Params::new(1);
    let net = HeatmapLifter::new(&mut params, NAME)?;
    let of = |part: &str| params.trainables().filter(|(n, _)| n.contains(part)).map(|(_, v)| v.elem_count()).sum();
    let (prior, view): (usize, usize) = (of("pose_prior"), of("view_point"));
    assert_eq!((prior, view), (1_637_279, 2_238_403), "1.64 M and 2.24 M");
    assert_eq!(params.n_parameters(), N_PARAMETERS);
    let maps = Tensor::zeros((2, MAP_SIZE, MAP_SIZE, MAPS), DType::F32, &Device::Cpu)?;
    let sides = Tensor::new(&[[0f32, 1.0], [1.0, 0.0]], &Device::Cpu)?;
    assert_eq!(net.forward(&maps, &sides, &mut Mode::Eval)?.dims(), [2, 72]);
    Ok(())
}

#[test]
fn turns_are_those_of_rodrigues_with_right_gradients() -> Result<()> {
    let vectors = (pattern(&[4, 3], 2.0)? * 2.5)?;
    assert!(worst(std::slice::from_ref(&vectors), |v| rotation(&v[0]))? < 1e-6);
    let matrices = rotation(&vectors)?.to_vec2::<f64>()?;
    for (v, m) in vectors.to_vec2::<f64>()?.iter().zip(matrices) {
        let v = [v[0], v[1], v[2]];
        let axes = Rotation::about(vec3::scale(v, 1.0 / vec3::norm(v)), vec3::norm(v)).axes();
        assert!((0..9).all(|k| (m[k] - axes[k % 3][k / 3]).abs() < 1e-6), "{m:?}");
    }
    Ok(())
}

#[test]
fn gradients_are_right_at_even_and_odd_sizes() -> Result<()> {
    for (height, width, stride) in [(4, 5, 1), (4, 6, 2), (5, 3, 2)] {
        let inputs = [pattern(&[2, height, width, 2], 1.0)?, pattern(&[3, 2, 3, 3], 2.0)?, pattern(&[3], 3.0)?];
        let error = worst(&inputs, |v| Conv3x3 { weight: v[1].clone(), bias: v[2].clone(), stride }.forward(&v[0]))?;
        assert!(error < 1e-7, "{height} x {width}, stride {stride}: {error}");
    }
    Ok(())
}

#[test]
fn stride_two_pads_at_the_end_only() -> Result<()> {
    let mut params = Params::with_dtype(0, DType::F64);
    let conv = Conv3x3::new(&mut params, "c", 1, 1, 2)?;
    let x = pattern(&[1, 4, 4, 1], 0.0)?;
    let y = conv.forward(&x)?.flatten_all()?.to_vec1::<f64>()?;
    let (x, w) = (x.flatten_all()?.to_vec1::<f64>()?, conv.weight.flatten_all()?.to_vec1::<f64>()?);
    let first: f64 = (0..9).map(|k| w[k] * x[k / 3 * 4 + k % 3]).sum();
    assert!((y[0] - first - 1e-4).abs() < 1e-12 && y.len() == 4);
    Ok(())
}
