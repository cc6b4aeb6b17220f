//! Several hypotheses at once: Holm's step-down p values (Holm 1979), which bound the probability of any false
//! rejection whatever the tests' dependence.

use super::error::{StatisticsError, within};

/// Adjusted p values in the order given: a hypothesis is rejected at a level where its adjusted value is at most that.
pub fn holm(p_values: &[f64]) -> Result<Vec<f64>, StatisticsError> {
    p_values.iter().try_for_each(|p| within("p value", *p, 0.0..=1.0))?;
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest = 0.0f64;
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((p_values.len() - rank) as f64 * p_values[index]).min(1.0);
        adjusted[index] = largest;
    }
    Ok(adjusted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_statsmodels() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
        for case in golden["holm"].as_array().unwrap() {
            let [p, expected] = ["p", "adjusted"].map(|k| serde_json::from_value::<Vec<f64>>(case[k].clone()).unwrap());
            for (found, expected) in holm(&p).unwrap().into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15, "{found} {expected}");
            }
        }
        assert_eq!(holm(&[]), Ok(vec![]));
        assert!(holm(&[0.2, f64::NAN]).is_err() && holm(&[1.1]).is_err());
    }
}
