//! Files of weights.

use anyhow::Context;
use candle_core::{DType, Device, Tensor};
use orator_formats::checkpoint::path;
use orator_nn::weights::Contents;
use serde_json::json;
use std::collections::BTreeMap;

#[test]
fn contents_round_trip_to_identical_bytes() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let mut contents = Contents { facts: json!({"step": 7, "kind": "test"}), tensors: BTreeMap::new() };
    let tensor = Tensor::new(&[[1f32, 2.0], [3.0, f32::MIN_POSITIVE]], &Device::Cpu)?;
    contents.add("net.", BTreeMap::from([("w".into(), tensor.clone()), ("a".into(), tensor.clone())]));
    let file = path(folder.path(), 7);
    contents.write(&file)?;
    let read = Contents::read(&file)?;
    assert_eq!(read.facts, contents.facts);
    assert_eq!(read.part("net.")["w"].to_vec2::<f32>()?, tensor.to_vec2::<f32>()?);
    assert_eq!(read.to_bytes()?, std::fs::read(&file)?);
    Ok(())
}

#[test]
fn a_checkpoint_of_another_number_type_is_rejected() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let file = path(folder.path(), 1);
    for dtype in [DType::F16, DType::F64, DType::U32] {
        let tensor = Tensor::new(&[1f32, 2.0], &Device::Cpu)?.to_dtype(dtype)?;
        Contents { facts: json!({}), tensors: BTreeMap::from([("net.w".to_owned(), tensor)]) }.write(&file)?;
        let text = format!("{:#}", Contents::read(&file).err().context("it was read")?);
        let expected = format!("tensor net.w has type {dtype:?}, expected F32");
        assert!(text.contains("step-0000001.safetensors") && text.contains(&expected), "{text}");
        assert_eq!(Contents::from_bytes(&std::fs::read(&file)?).is_ok(), dtype == DType::F16);
    }
    Ok(())
}

#[test]
fn a_tensor_with_a_non_finite_weight_is_named() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let file = path(folder.path(), 1);
    for wrong in [f32::NAN, f32::INFINITY] {
        let tensors = BTreeMap::from([("net.w".to_owned(), Tensor::new(&[1.0, wrong, 2.0], &Device::Cpu)?)]);
        Contents { facts: json!({}), tensors }.write(&file)?;
        let text = format!("{:#}", Contents::read(&file).err().context("it was read")?);
        assert!(text.contains("step-0000001.safetensors") && text.contains("net.w"), "{text}");
    }
    Ok(())
}
