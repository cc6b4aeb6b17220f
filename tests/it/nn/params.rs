//! Parameters of networks.

use candle_core::Result;
use orator_nn::params::{Init, Params};

#[test]
fn the_first_values_depend_on_seed_and_name_only() -> anyhow::Result<()> {
    let values = |seed, names: &[&str]| -> Result<Vec<f32>> {
        let mut params = Params::new(seed);
        for name in names {
            params.trainable(name, &[3, 4, 5], Init::Glorot)?;
        }
        params.tensors()?["b"].flatten_all()?.to_vec1()
    };
    let first = values(1, &["b"])?;
    assert_eq!(first, values(1, &["a", "b"])?);
    assert_ne!(first, values(2, &["b"])?);
    let bound = (6.0f32 / (15.0 + 20.0)).sqrt();
    assert!(first.iter().all(|v| v.abs() <= bound) && first.iter().any(|v| v.abs() > 0.8 * bound));
    Ok(())
}

#[test]
fn loading_names_mismatched_tensors() -> anyhow::Result<()> {
    let mut params = Params::new(0);
    params.trainable("w", &[2, 2], Init::He)?;
    params.buffer("mean", &[2], 0.0)?;
    let mut tensors = params.tensors()?;
    params.load(&tensors)?;
    assert_eq!(params.n_parameters(), 4);
    tensors.insert("extra".into(), tensors["w"].clone());
    assert!(params.load(&tensors).unwrap_err().to_string().contains("extra"));
    tensors.remove("extra");
    tensors.remove("mean");
    assert!(params.load(&tensors).unwrap_err().to_string().contains("mean"));
    tensors.insert("mean".into(), tensors["w"].clone());
    assert!(params.load(&tensors).unwrap_err().to_string().contains("shape"));
    Ok(())
}
