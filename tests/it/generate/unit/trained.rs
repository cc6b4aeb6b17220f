//! Unit tests of `orator_gesture::generate::trained`.

use anyhow::Result;
use candle_core::{DType, Device, Tensor};
use orator_gesture::generate::trained::vary;
use orator_nn::weights::Contents;
use std::collections::BTreeMap;

fn contents(dropout: f64) -> Contents {
    let weight = Tensor::ones((2, 64, 3), DType::F32, &Device::Cpu).unwrap();
    Contents {
        facts: serde_json::json!({ "settings": { "dropout": dropout } }),
        tensors: BTreeMap::from([("generator.enter.0.conv.weight".to_owned(), weight)]),
    }
}

#[test]
fn a_seed_drops_complete_channels() -> Result<()> {
    let varied = |seed| -> Result<Vec<f32>> {
        let mut contents = contents(0.25);
        vary(&mut contents, "generator.", seed)?;
        Ok(contents
            .tensors
            .into_values()
            .next()
            .unwrap_or(Tensor::new(0f32, &Device::Cpu)?)
            .flatten_all()?
            .to_vec1()?)
    };
    let first = varied(1)?;
    let n_dropped = first.iter().filter(|value| **value == 0.0).count();
    assert!(n_dropped.is_multiple_of(6) && (120..264).contains(&n_dropped), "{n_dropped}");
    assert!(first.iter().all(|value| *value == 0.0 || (value - 2.0).abs() < 1e-6));
    assert!(first == varied(1)? && first != varied(2)?);
    assert!(vary(&mut contents(0.0), "generator.", 1).is_err());
    Ok(())
}
