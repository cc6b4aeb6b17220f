//! Unit tests of `orator_nn::cpu::channel_stats`.

use orator_nn::cpu::channel_stats::{ChannelMoments, sums};

#[test]
fn moments_of_blocks_combine_to_those_of_all_values() {
    let n_channels = 3;
    let values: Vec<f64> = (0..3 * 20_000).map(|i| (f64::from(i) * 0.37).sin() + f64::from(i % 3)).collect();
    let complete = ChannelMoments::measure(&values, n_channels);
    for channel in 0..n_channels {
        let own: Vec<f64> = values.iter().skip(channel).step_by(n_channels).copied().collect();
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        let squares = own.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        assert!((complete.mean[channel] - mean).abs() < 1e-12 && (complete.squares[channel] - squares).abs() < 1e-7);
        assert!((sums(&values, n_channels)[channel] - own.iter().sum::<f64>()).abs() < 1e-8);
    }
    assert_eq!(complete.n, 20_000.0);
}
