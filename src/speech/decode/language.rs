//! The language spoken in a window.

use super::search::TokenModel;
use crate::tokenizer::Tokenizer;
use anyhow::{Context as _, Result};

/// Most probable language token, and its probability among all languages; of equals the first.
///
/// # Errors
/// The network fails or has no language tokens.
pub(crate) fn detect(model: &mut impl TokenModel, tokenizer: &Tokenizer) -> Result<(u32, f32)> {
    let logits = model.step(&[vec![tokenizer.sot()]])?;
    let tokens = tokenizer.language_tokens();
    let logit = |token: u32| logits.get((0, token as usize)).copied().filter(|logit| logit.is_finite());
    let known: Vec<(u32, f32)> = tokens.filter_map(|token| Some((token, logit(token)?))).collect();
    let best = known.iter().copied().reduce(|best, other| if other.1 > best.1 { other } else { best });
    let (token, top) = best.context("the network gives no probability of a language")?;
    Ok((token, 1.0 / known.iter().map(|(_, logit)| (logit - top).exp()).sum::<f32>()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tokenizer::tests::byte_tokenizer;
    use ndarray::Array2;

    struct Fixed(Array2<f32>);

    impl TokenModel for Fixed {
        fn step(&mut self, _: &[Vec<u32>]) -> Result<Array2<f32>> {
            Ok(self.0.clone())
        }

        fn reorder(&mut self, _: &[usize]) -> Result<()> {
            Ok(())
        }
    }

    #[test]
    fn language_is_the_most_probable_of_the_language_tokens() {
        let tokenizer = byte_tokenizer();
        let mut logits = Array2::from_elem((1, 300), 5.0);
        for (token, logit) in tokenizer.language_tokens().zip([1.0, 3.0, f32::NAN]) {
            logits[(0, token as usize)] = logit;
        }
        let (token, probability) = detect(&mut Fixed(logits), &tokenizer).unwrap();
        assert_eq!(tokenizer.language_code(token), "de");
        assert!((probability - 0.8808).abs() < 1e-4, "{probability}");
        assert!(detect(&mut Fixed(Array2::zeros((0, 0))), &tokenizer).is_err());
    }
}
