//! Tests of `orator_nn::lifter::temporal`.

use candle_core::DType;
use orator_nn::Mode;
use orator_nn::lifter::temporal::{Config, TemporalLifter};
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

#[test]
fn size_is_the_published_one() -> anyhow::Result<()> {
    let mut params = Params::frozen();
    let config = Config { n_in: 34, n_out: 51, channels: 1024, widths: vec![3, 3, 3], dropout: 0.0 };
    let net = TemporalLifter::new(&mut params, "lifter", &config)?;
    assert_eq!(net.config().receptive_field(), 27);
    assert!((params.n_parameters() as f64 / 8.56e6 - 1.0).abs() < 0.001, "{}", params.n_parameters());
    Ok(())
}

#[test]
fn gradients_of_the_input_are_correct() -> anyhow::Result<()> {
    let mut params = Params::with_dtype(1, DType::F64);
    let small = Config { n_in: 2, n_out: 3, channels: 4, widths: vec![3, 3], dropout: 0.0 };
    let net = TemporalLifter::new(&mut params, "l", &small)?;
    let windows = pattern(&[3, 2, 9], 1.0)?;
    assert!(worst(&[windows], |v| net.forward(&v[0], &mut Mode::Eval))? < 1e-7);
    assert!(TemporalLifter::new(&mut params, "even", &Config { widths: vec![3, 4], ..small }).is_err());
    Ok(())
}
