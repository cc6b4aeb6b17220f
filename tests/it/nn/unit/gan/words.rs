//! Tests of `orator_nn::gan::words`.

use candle_core::{DType, Device, Result, Tensor};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::gan::words::{KERNEL, N_TIMES, WordFrames, WordLayer};
use orator_nn::ops::conv2d::Conv;
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

fn frames() -> Result<WordFrames> {
    let numbers = Tensor::new(&[[0u32, 2, 2, 4, 0], [3, 3, 1, 0, 2]], &Device::Cpu)?;
    Ok(WordFrames { numbers, times: pattern(&[2, 5, N_TIMES], 0.7)?, added: None })
}

#[test]
fn gradients_of_table_and_audio_are_correct() -> Result<()> {
    let inputs = [pattern(&[2, 5, 6], 0.0)?, pattern(&[5, 3], 1.0)?];
    let output = Conv::new(&mut Params::with_dtype(0, DType::F64), "output", &[6, 5, KERNEL], 1)?;
    let error = worst(&inputs, |v| {
        WordLayer { table: v[1].clone(), output: output.clone() }.forward(&v[0], Some(&frames()?))?.sqr()
    })?;
    assert!(error < 1e-7, "{error}");
    Ok(())
}

#[test]
fn added_vectors_follow_those_of_the_table_and_missing_words_are_padding() -> Result<()> {
    let mut params = Params::with_dtype(0, DType::F64);
    let config = Config { width: 8, vocabulary: 4, word: 3, ..Config::from_preset(Preset::Light, 2) };
    let net = Generator::new(&mut params, &config)?;
    let mels = pattern(&[2, 64, 33], 0.0)?;
    let run = |words: Option<&WordFrames>| -> Result<Vec<f64>> {
        net.decode(&net.frames(&mels, &[], words, 5, false)?, false)?.flatten_all()?.to_vec1()
    };
    let words = |added| Ok::<_, candle_core::Error>(WordFrames { added, ..frames()? });
    assert!(run(Some(&words(None)?)).is_err(), "index 4 is after the table");
    let [first, second] = [0.0, 5.0].map(|phase| run(Some(&words(Some(pattern(&[1, 3], phase)?))?)));
    assert_ne!(first?, second?);
    let none = WordFrames {
        numbers: Tensor::zeros((2, 5), DType::U32, &Device::Cpu)?,
        times: Tensor::zeros((2, 5, N_TIMES), DType::F64, &Device::Cpu)?,
        added: None,
    };
    assert_eq!(run(None)?, run(Some(&none))?);
    assert!(run(Some(&none.part(1..3)?)).is_err(), "other number of frames");
    Ok(())
}
