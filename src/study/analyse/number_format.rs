//! Formatting of the numbers of an analysis.

use crate::stats::estimate::ConfidenceInterval;

/// Count with thousands separators.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (idx, digit) in digits.chars().enumerate() {
        if idx > 0 && (digits.len() - idx).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Count with thousands separators and its noun: `1 vote`, `2,000 votes`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(n), if n == 1 { "" } else { "s" })
}

/// `p = 0.027`, `p = 6.5e-12`.
pub fn p_value(p: f64) -> String {
    format!("p = {}", bare_p(p))
}

/// p value without `p =`.
pub fn bare_p(p: f64) -> String {
    match p {
        p if p >= 0.9995 => "1".to_owned(),
        p if p >= 0.001 => format!("{p:.3}"),
        p if p >= 1e-99 => format!("{p:.1e}"),
        _ => "< 1e-99".to_owned(),
    }
}

/// Proportion in percent with one decimal.
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Interval of a proportion: `50.3 to 54.7 %`.
pub fn percents(interval: ConfidenceInterval) -> String {
    format!("{:.1} to {:.1} %", 100.0 * interval.low, 100.0 * interval.high)
}

/// Equivalence bound of a proportion in percentage points: `10`.
pub fn points(bound: f64) -> String {
    let points = (1000.0 * bound).round() / 10.0;
    format!("{points}")
}

/// Names joined by commas and a final `and`.
pub fn list(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_grouped() {
        assert_eq!([0, 999, 1083, 2_000_000].map(count), ["0", "999", "1,083", "2,000,000"]);
        assert_eq!([1, 2000].map(|n| counted(n, "vote")), ["1 vote", "2,000 votes"]);
        assert_eq!([1.0, 0.0268, 6.51e-12, 0.0].map(bare_p), ["1", "0.027", "6.5e-12", "< 1e-99"]);
        assert_eq!(
            ([0.1, 0.05, 0.025].map(points), percent(0.525)),
            (["10", "5", "2.5"].map(str::to_owned), "52.5 %".to_owned())
        );
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!((list(&names), list(&names[..1])), ("a, b and c".to_owned(), "a".to_owned()));
    }
}
