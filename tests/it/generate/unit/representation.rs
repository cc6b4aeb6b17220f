//! Tests of `orator_gesture::generate::representation`.

use candle_core::{DType, Device, Tensor};
use ndarray::{Array2, ArrayView2};
use orator_base::motion::bones;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_BONES, N_JOINTS, R_HAND, is_duplicate, parent};
use orator_base::types::time::FrameRate;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::{Representation, real_parent};
use orator_test_support::gradcheck::{pattern, worst};

fn normal() -> Normalisation {
    let table = |value: f32| Array2::from_shape_fn((N_JOINTS, 3), |(j, k)| value + 0.003 * (j + 2 * k) as f32);
    let length = |bone: usize| if bone + 1 == L_HAND || bone + 1 == R_HAND { 0.0 } else { 0.05 + 0.004 * bone as f32 };
    Normalisation::new(&table(0.1), &table(0.1), (0..N_BONES).map(length).collect())
}

/// Features and mask of moving poses with one hidden joint.
fn poses(normal: &Normalisation) -> (Array2<f32>, Array2<bool>) {
    let value = |i: usize, t: usize| (i as f32 * 1.7 + t as f32 * 0.3).sin();
    let mut motion = Motion::from_joints(
        FrameRate::new(15, 1),
        normal.joints(Array2::from_shape_fn((N_FEATURES, 40), |(i, t)| value(i, t)).view()),
    );
    let lengths = std::array::from_fn(|bone| normal.bone_lengths[bone]);
    bones::with_lengths(&mut motion, &lengths);
    motion.mask[[3, 9]] = false;
    normal.features(&motion)
}

#[test]
fn gradients_match_finite_differences() -> anyhow::Result<()> {
    let normal = normal();
    let (features, mask) = poses(&normal);
    let bones = Representation::bones(&normal, [Ok((features.clone(), mask.clone()))].into_iter())?;
    let decoder = bones.decoder(&normal, DType::F64, &Device::Cpu)?;
    for n_channels in [0, 2] {
        let numbers = pattern(&[2, N_FEATURES + 3 * n_channels, 2], 0.0)?;
        let error = worst(std::slice::from_ref(&numbers), |v| decoder.poses(&v[0]))?;
        assert!(error < 1e-6, "{error}");
        let channels = |x: &Tensor| x.narrow(1, N_FEATURES, 3 * n_channels)?.flatten_all()?.to_vec1::<f64>();
        assert_eq!(channels(&decoder.poses(&numbers)?)?, channels(&numbers)?);
    }
    Ok(())
}

#[test]
fn tensors_and_arrays_agree_and_bone_lengths_are_constant() -> anyhow::Result<()> {
    let normal = normal();
    let (features, mask) = poses(&normal);
    let bones = Representation::bones(&normal, [Ok((features.clone(), mask.clone()))].into_iter())?;
    bones.check()?;
    let raw = pattern(&[1, N_FEATURES, 50], 0.0)?.affine(6.0, 0.0)?.to_dtype(DType::F32)?;
    let decoded = bones.decoder(&normal, DType::F32, &Device::Cpu)?.poses(&raw)?.flatten_all()?.to_vec1::<f32>()?;
    let tensors = normal.joints(ArrayView2::from_shape((N_FEATURES, 50), &decoded)?);
    let raw = raw.flatten_all()?.to_vec1::<f32>()?;
    let arrays = bones.joints(ArrayView2::from_shape((N_FEATURES, 50), &raw)?, &normal);
    for (a, b) in tensors.iter().zip(&arrays) {
        assert!((a - b).abs() < 2e-6, "{a} {b}");
    }
    for (t, joint) in (0..50).flat_map(|t| (1..N_JOINTS).map(move |joint| (t, joint))) {
        let bone = |k: usize| arrays[[t, joint, k]] - arrays[[t, parent(joint).unwrap(), k]];
        let length = (0..3).map(|k| bone(k).powi(2)).sum::<f32>().sqrt();
        assert!((length - normal.bone_lengths[joint - 1]).abs() < 2e-6, "joint {joint}: {length}");
    }
    Ok(())
}

#[test]
fn directions_round_trip() -> anyhow::Result<()> {
    let normal = normal();
    let (features, mask) = poses(&normal);
    let bones = Representation::bones(&normal, [Ok((features.clone(), mask.clone()))].into_iter())?;
    let Representation::Bones { mean, std } = &bones else { anyhow::bail!("not bones") };
    let joints = normal.joints(features.view());
    let raw = Array2::from_shape_fn((N_FEATURES, features.ncols()), |(i, t)| {
        let joint = i / 3 + 1;
        let bone = |k: usize| joints[[t, joint, k]] - joints[[t, real_parent(joint), k]];
        let length = (0..3).map(|k| bone(k).powi(2)).sum::<f32>().sqrt().max(1e-9);
        (bone(i % 3) / length - mean[i]) / std[i]
    });
    for (a, b) in bones.joints(raw.view(), &normal).iter().zip(&joints) {
        assert!((a - b).abs() < 1e-5);
    }
    let (numbers, known) = bones.directions(&Motion::from_joints(FrameRate::new(15, 1), joints.clone()));
    assert!(known.iter().all(|known| *known));
    for ((t, i), number) in numbers.indexed_iter().filter(|((_, i), _)| !is_duplicate(i / 3 + 1)) {
        assert!((number - raw[[i, t]]).abs() < 1e-4, "{number} {}", raw[[i, t]]);
    }
    // Feature 0 is visible in all 40 frames: mean 0, deviation 1.
    let row = raw.row(0);
    assert!((row.sum() / 40.0).abs() < 1e-4 && (row.mapv(|v| v * v).sum() / 40.0 - 1.0).abs() < 1e-3);
    Ok(())
}
