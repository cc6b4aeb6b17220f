//! Tests of `orator_nn::gan::speaker_layer`.

use candle_core::{DType, IndexOp, Result, Tensor};
use orator_nn::gan::speaker_layer::{SPEAKER_EMBEDDING, SpeakerLayer};
use orator_nn::params::Params;
use orator_test_support::gradcheck::{pattern, worst};

#[test]
fn each_sample_uses_the_layer_of_its_speaker() -> Result<()> {
    let mut params = Params::with_dtype(0, DType::F64);
    let layer = SpeakerLayer::new(&mut params, 3, 4, true)?;
    let encoded = pattern(&[2, 5, 4], 0.0)?;
    let vectors = params.tensors()?[SPEAKER_EMBEDDING].clone();
    let max_difference = |a: Tensor, b: Tensor| (a - b)?.abs()?.flatten_all()?.max(0)?.to_scalar::<f64>();
    // Before the first training step the layers only add the vectors.
    let out = layer.forward(&encoded, &[2, 1])?;
    let expected = encoded.i(0)?.broadcast_add(&vectors.narrow(0, 2, 1)?)?;
    assert!(max_difference(out.i(0)?, expected)? < 1e-12);

    let weights = pattern(&[3, 4, 4], 0.5)?;
    let layer = SpeakerLayer { vectors: vectors.clone(), weights: Some(weights.clone()) };
    let out = layer.forward(&encoded, &[2, 1])?;
    for (sound, speaker) in [(0, 2), (1, 1)] {
        let x = encoded.i(sound)?;
        let expected = (&x + x.matmul(&weights.i(speaker)?)?)?.broadcast_add(&vectors.narrow(0, speaker, 1)?)?;
        assert!(max_difference(out.i(sound)?, expected.clone())? < 1e-12);
        let row = |table: &Tensor| table.narrow(0, speaker, 1);
        let alone = SpeakerLayer { vectors: row(&vectors)?, weights: Some(row(&weights)?) };
        assert!(max_difference(alone.forward(&encoded.narrow(0, sound, 1)?, &[])?.i(0)?, expected)? < 1e-12);
    }
    assert!([&[0][..], &[0, 3], &[]].iter().all(|speakers| layer.forward(&encoded, speakers).is_err()));
    for (n, speakers) in [(3, &[1, 2][..]), (1, &[])] {
        let row = |table: &Tensor| table.narrow(0, 0, n)?.copy();
        let error = worst(&[encoded.clone(), row(&vectors)?, row(&weights)?], |v| {
            SpeakerLayer { vectors: v[1].clone(), weights: Some(v[2].clone()) }.forward(&v[0], speakers)?.sqr()
        })?;
        assert!(error < 1e-7, "{n} speakers: {error}");
    }
    Ok(())
}
