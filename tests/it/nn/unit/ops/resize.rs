//! Tests of `orator_nn::ops::resize`.

use candle_core::{Device, Result, Tensor};
use orator_nn::cpu::frames::FrameInterpolation;
use orator_nn::ops::resize::{ResizedPart, linear, linear_part, mix, repeat_frames_and_add, transposed};
use orator_test_support::gradcheck::{max_difference, pattern, worst};

#[test]
fn gradients_are_correct_even_if_the_input_is_used_twice() -> Result<()> {
    let x = pattern(&[2, 3, 5], 0.0)?;
    for n_out in [3, 5, 7, 11] {
        assert!(worst(std::slice::from_ref(&x), |v| linear(&v[0].sqr()?, n_out))? < 1e-7);
    }
    for is_delayed in [false, true] {
        let skip = |v: &[Tensor]| {
            let early = v[0].sqr()?;
            repeat_frames_and_add(&early.sin()?, &(linear(&early, 6)? * linear(&early.sin()?, 6)?)?, is_delayed)
        };
        assert!(worst(std::slice::from_ref(&x), skip)? < 1e-7);
    }
    assert!(worst(&[x], |v| transposed(&v[0].sqr()?)? * transposed(&v[0])?)? < 1e-7);
    Ok(())
}

#[test]
fn results_equal_those_of_candle() -> Result<()> {
    let (x, skip) = (pattern(&[2, 3, 5], 0.0)?, pattern(&[2, 7, 5], 1.0)?);
    let of = vec![(0, 1, 0.25), (1, 2, 0.5), (2, 2, 0.0), (0, 0, 0.0), (2, 1, 0.9), (1, 1, 0.3), (0, 2, 0.7)];
    let composed = |v: &[Tensor]| {
        let frames = |which: fn(&(usize, usize, f64)) -> usize| {
            let of: Vec<u32> = of.iter().map(|of| which(of) as u32).collect();
            v[0].index_select(&Tensor::new(of, &Device::Cpu)?, 1)
        };
        let (a, b) = (frames(|of| of.0)?, frames(|of| of.1)?);
        let share = Tensor::new(of.iter().map(|of| of.2).collect::<Vec<_>>(), &Device::Cpu)?.reshape((1, (), 1))?;
        (&a + (b - &a)?.broadcast_mul(&share)?)? + &v[1]
    };
    let own = |v: &[Tensor]| mix(&v[0], Some(&v[1]), FrameInterpolation { n_in: 3, of: of.clone() });
    let off = max_difference(&[x, skip], own, composed)?;
    assert!(off < 1e-12, "{off:e}");
    assert!(repeat_frames_and_add(&pattern(&[2, 3, 5], 0.0)?, &pattern(&[2, 5, 5], 0.0)?, false).is_err());
    Ok(())
}

#[test]
fn positions_equal_those_of_tensorflow() -> Result<()> {
    let x = transposed(&Tensor::new(&[[[0.0f64, 1.0, 2.0, 3.0]]], &Device::Cpu)?)?;
    let at = |n_out| linear(&x, n_out)?.flatten_all()?.to_vec1::<f64>();
    assert_eq!(at(8)?, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.0]);
    assert_eq!(at(2)?, [0.0, 2.0]);
    let part = ResizedPart::new(3..6, 4, 8);
    assert_eq!(part.needed(), 1..4);
    let some = linear_part(&x.narrow(1, 1, 3)?, &part)?.flatten_all()?.to_vec1::<f64>()?;
    assert_eq!(some, [1.5, 2.0, 2.5]);
    assert!(linear_part(&x, &part).is_err());
    let repeated = repeat_frames_and_add(&x, &Tensor::zeros((1, 8, 1), x.dtype(), x.device())?, false)?;
    assert_eq!(repeated.flatten_all()?.to_vec1::<f64>()?, [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
    Ok(())
}
