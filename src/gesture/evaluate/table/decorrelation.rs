//! Over how many frames a series forgets itself: the integrated autocorrelation time with an automatic window (Sokal
//! 1997, Monte Carlo Methods in Statistical Mechanics, section 3).

/// The window ends at this many times half the time found so far (Sokal's c, whose times are half of these).
const WINDOW: f64 = 5.0;
/// Least share of the time that the removed mean may seem to have left.
const LEAST_LEFT: f64 = 0.1;

/// `1 + 2 * (sum of the autocorrelations)` of a series in pieces, in frames, at least 1 and at most all frames: the mean
/// of N frames varies as that of N / time independent ones. Lags stay within a piece; the mean is that of all pieces, so
/// that pieces of different level count as slow. Frames that are not finite are left out. Corrected for the mean, which
/// is the series' own. 1 of a constant series.
pub fn integrated_time(pieces: &[Vec<f64>]) -> f64 {
    let (time, window, n) = windowed(pieces);
    if window == 0 {
        return 1.0;
    }
    let left = 1.0 - (2.0 * window as f64 + 1.0) / n.max(1) as f64;
    (time.max(1.0) / left.max(LEAST_LEFT)).min(n.max(1) as f64)
}

/// Time before the correction, its window (last lag), and the number of frames.
fn windowed(pieces: &[Vec<f64>]) -> (f64, usize, usize) {
    let all = || pieces.iter().flatten().filter(|value| value.is_finite());
    let n = all().count();
    let mean = all().sum::<f64>() / n.max(1) as f64;
    // What is missing adds nothing to any product.
    let centred = |piece: &Vec<f64>| -> Vec<f64> {
        piece.iter().map(|value| if value.is_finite() { value - mean } else { 0.0 }).collect()
    };
    let pieces: Vec<Vec<f64>> = pieces.iter().map(centred).collect();
    let product = |lag: usize| -> f64 {
        pieces.iter().flat_map(|piece| piece.iter().zip(piece.iter().skip(lag))).map(|(a, b)| a * b).sum()
    };
    let variance = product(0);
    let longest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    let mut time = 1.0;
    if variance.is_nan() || variance <= 1e-24 * n as f64 * mean * mean {
        return (time, 0, n);
    }
    for lag in 1..longest {
        time += 2.0 * product(lag) / variance;
        if lag as f64 >= WINDOW / 2.0 * time {
            return (time, lag, n);
        }
    }
    (time, longest.saturating_sub(1), n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_emcee() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../../fixtures/reference/verdict_golden.json")).unwrap();
        for case in golden["integrated_time"].as_array().unwrap() {
            let series: Vec<f64> = serde_json::from_value(case["series"].clone()).unwrap();
            let expected = case["time"].as_f64().unwrap();
            let (time, _, n) = windowed(std::slice::from_ref(&series));
            assert!((time / expected - 1.0).abs() < 1e-9 && n == series.len(), "{time} {expected}");
            assert!(integrated_time(&[series]) > time.max(1.0));
        }
    }

    #[test]
    fn pieces_of_different_level_are_slow_and_constants_are_not() {
        let wave = |level: f64| (0..75).map(|t| level + f64::from(t * 7919 % 101) / 101.0).collect::<Vec<f64>>();
        let alike = integrated_time(&[wave(0.0), wave(0.0), wave(0.0)]);
        let apart = integrated_time(&[wave(0.0), wave(5.0), wave(-3.0)]);
        assert!(alike < 4.0 && apart > 40.0, "{alike} {apart}");
        for pieces in [vec![], vec![vec![]], vec![vec![f64::NAN; 9]], vec![vec![2.0; 50]], vec![vec![1.0]]] {
            assert_eq!(integrated_time(&pieces), 1.0);
        }
    }
}
