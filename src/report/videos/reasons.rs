//! Order, heading and CSS class of the refusal reasons on the page. Each colour stands for a kind of reason; the second
//! reason of a kind is striped (`page.css`).

use orator_base::stage::refusal::Refusal;

/// Label of a video that no stage has finished.
pub const WAITING: &str = "not done";

fn find(reason: &str) -> Option<usize> {
    Refusal::JUDGED.iter().position(|known| known.reason() == reason)
}

/// Rank of a reason in the order of the page; unknown reasons come last.
pub fn order(reason: &str) -> usize {
    find(reason).unwrap_or(Refusal::JUDGED.len())
}

/// Heading of a reason; empty for unknown reasons.
pub fn heading(reason: &str) -> &'static str {
    find(reason).map_or("", |at| Refusal::JUDGED[at].heading())
}

/// CSS class of a reason.
pub fn class(reason: &str) -> String {
    if find(reason).is_some() { format!("r-{}", reason.replace(' ', "-")) } else { "r-unknown".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_a_heading_and_a_colour() {
        let style = include_str!("page.css");
        for reason in Refusal::JUDGED.map(Refusal::reason) {
            assert!(!heading(reason).is_empty(), "{reason}");
            assert!(style.contains(&format!(".{} ", class(reason))), "{reason} has no colour");
        }
        assert_eq!((class("<b>").as_str(), order("new")), ("r-unknown", Refusal::JUDGED.len()));
    }
}
