//! The table of a trained speaker as text, and its plain meaning.

use super::bootstrap::Estimate;
use super::predictors::{MEAN_POSE, MISMATCHED};
use super::speaker::{N_DRAWS, N_FRECHET_DRAWS, Row, Table};

/// Fewer blocks than this carry no conclusion.
const FEW_BLOCKS: usize = 10;

/// The table and what follows from it.
pub fn text(table: &Table) -> String {
    let Table { n_intervals, n_blocks, n_poses, secs, split, .. } = table;
    let mut text = format!(
        "{}: {secs:.1} s of the {split} split, intervals: {n_intervals}, blocks of about 4 s: {n_blocks}\n",
        table.speaker
    );
    text += &format!(
        "{:18}{:>24}{:>24}{:>24}{:>22}{:>28}{:>22}\n",
        "",
        "PCK 0.2",
        "arms",
        "fingers",
        "L1",
        format!("Frechet cm2 (n {n_poses})"),
        "energy / data's"
    );
    table.rows.iter().for_each(|row| text += &line(row));
    text += &format!(
        "in brackets: 95 % intervals of {N_DRAWS} draws of the blocks (Frechet: {N_FRECHET_DRAWS}){}\n{}",
        if *n_blocks < FEW_BLOCKS { "; with so few blocks they say little" } else { "" },
        meaning(table)
    );
    text
}

fn line(row: &Row) -> String {
    let percent = |e: &Estimate| bracketed(e, 100.0, 1, " %");
    format!(
        "{:18}{:>24}{:>24}{:>24}{:>22}{:>28}{:>22}\n",
        row.predictor,
        percent(&row.pck),
        percent(&row.pck_body),
        percent(&row.pck_hands),
        bracketed(&row.l1, 1.0, 3, ""),
        bracketed(&row.frechet, 1.0, 0, ""),
        bracketed(&row.energy, 1.0, 2, ""),
    )
}

/// `41.2 % [38.0, 44.1]`
fn bracketed(estimate: &Estimate, times: f64, digits: usize, unit: &str) -> String {
    // no figure is below 0
    let number =
        |value: f64| if value.is_finite() { format!("{:.digits$}", (value * times).max(0.0)) } else { "-".to_owned() };
    format!("{}{unit} [{}, {}]", number(estimate.value), number(estimate.low), number(estimate.high))
}

/// One sentence on whether it beats doing nothing, one on whether it hears.
pub fn meaning(table: &Table) -> String {
    let points = |e: &Estimate| {
        format!("{:+.1} points of PCK, 95 % interval {:+.1} to {:+.1}", 100.0 * e.value, 100.0 * e.low, 100.0 * e.high)
    };
    let (nothing, other) = (&table.over_mean_pose, &table.over_mismatched);
    let gains = format!("over the {MEAN_POSE} {}, over the {MISMATCHED} {}", points(nothing), points(other));
    if table.n_blocks < FEW_BLOCKS {
        return format!("{} blocks are too few to say whether it beats doing nothing: {gains}.", table.n_blocks);
    }
    let beats = match (nothing.is_apart_from_zero(), nothing.value > 0.0) {
        (true, true) => format!("It beats doing nothing ({MEAN_POSE})"),
        (true, false) => format!("It is worse than doing nothing ({MEAN_POSE})"),
        (false, _) => format!("It is not shown to beat doing nothing ({MEAN_POSE})"),
    };
    let hears = match (other.is_apart_from_zero(), other.value > 0.0) {
        (true, true) => format!("its motion fits its own sound better than another's ({MISMATCHED})"),
        (true, false) => format!("its motion fits another's sound better than its own ({MISMATCHED})"),
        (false, _) => format!("its motion is not shown to fit its own sound better than another's ({MISMATCHED})"),
    };
    format!("{beats}: {}; {hears}: {}.", points(nothing), points(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, half: f64) -> Estimate {
        Estimate { value, low: value - half, high: value + half }
    }

    #[test]
    fn the_meaning_follows_the_intervals() {
        let mut table = Table {
            speaker: "host".to_owned(),
            split: "test",
            n_intervals: 2,
            n_blocks: 10,
            secs: 20.0,
            n_poses: 300,
            rows: vec![Row {
                predictor: MEAN_POSE,
                pck: estimate(0.4, 0.01),
                pck_body: estimate(0.5, 0.01),
                pck_hands: estimate(0.3, 0.01),
                l1: estimate(0.8, 0.05),
                frechet: estimate(123.4, 200.0),
                energy: estimate(0.0, f64::NAN),
            }],
            over_mean_pose: estimate(0.05, 0.02),
            over_mismatched: estimate(0.01, 0.02),
        };
        let shown = text(&table);
        for words in [
            "40.0 % [39.0, 41.0]",
            "123 [0, 323]",
            "0.00 [-, -]",
            "It beats doing nothing",
            "not shown to fit",
            "n 300",
        ] {
            assert!(shown.contains(words), "{words}: {shown}");
        }
        assert!(meaning(&Table { n_blocks: 9, ..table.clone() }).starts_with("9 blocks are too few"));
        table.over_mean_pose = estimate(-0.05, 0.02);
        assert!(meaning(&table).contains("worse than doing nothing"));
    }
}
