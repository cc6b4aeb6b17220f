//! Tests of `orator_nn::lifter::hand`.

use candle_core::DType;
use orator_nn::Mode;
use orator_nn::lifter::hand::{Config, HandLifter};
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

#[test]
fn gradients_and_size_are_correct() -> anyhow::Result<()> {
    let mut params = Params::with_dtype(1, DType::F64);
    let config = Config { n_in: 6, n_out: 5, hidden: 7, dropout: 0.0 };
    let net = HandLifter::new(&mut params, "hand", &config)?;
    assert!(worst(&[pattern(&[3, 6], 1.0)?], |v| net.forward(&v[0], &mut Mode::Eval))? < 1e-7);
    let mut params = Params::new(1);
    HandLifter::new(&mut params, "hand", &Config::default())?;
    assert_eq!(params.n_parameters(), 64 * 512 + 513 * 512 + 513 * 63);
    Ok(())
}
