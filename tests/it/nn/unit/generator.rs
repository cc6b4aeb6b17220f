//! Unit tests of `orator_nn::gan::generator`.

use candle_core::DType;
use candle_core::{Result, Tensor};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

#[test]
fn output_has_the_requested_number_of_frames() -> Result<()> {
    let mut params = Params::new(0);
    let config = Config { width: 16, ..Config::from_preset(Preset::Light, 6) };
    let net = Generator::new(&mut params, &config)?;
    for (n_mel, n_frames) in [(418, 64), (427, 64), (213, 32), (1000, 160)] {
        let mels = pattern(&[2, 64, n_mel], 0.0)?.to_dtype(DType::F32)?;
        assert_eq!(net.forward(&mels, &[], n_frames, true)?.dims(), [2, 6, n_frames]);
    }
    let mels = pattern(&[2, 64, 100], 0.0)?.to_dtype(DType::F32)?;
    assert!(net.forward(&mels, &[], 0, false).is_err());
    Ok(())
}

#[test]
fn other_numbers_of_frames_are_padded_and_cropped() -> Result<()> {
    let mut params = Params::with_dtype(3, DType::F64);
    let net = Generator::new(&mut params, &Config { width: 8, ..Config::from_preset(Preset::Light, 6) })?;
    let encoded = pattern(&[2, 60, 8], 0.0)?;
    let padded = Tensor::cat(&[&encoded, &Tensor::zeros((2, 4, 8), DType::F64, encoded.device())?], 1)?;
    let (short, long) = (net.decode(&encoded, false)?, net.decode(&padded, false)?);
    assert_eq!(short.dims(), [2, 6, 60]);
    let difference = (short - long.narrow(2, 0, 60)?)?.abs()?.max_all()?.to_scalar::<f64>()?;
    assert_eq!(difference, 0.0);
    assert!(worst(&[encoded.narrow(1, 0, 20)?], |v| net.decode(&v[0], false))? < 1e-5);
    Ok(())
}
