//! Histograms of every measure with its threshold.

use super::spread::{Measure, MeasureCounts};
use crate::html::chart::histogram::{Counts, ThresholdLine, histogram};
use crate::html::numbers::percent;
use crate::html::{Node, node};
use orator_base::stage::counted;
use orator_dataset::config::Settings;

/// Card for each measure.
pub fn distributions(spread: &MeasureCounts, settings: &Settings, per_sec: f64) -> Vec<Node> {
    let about = "Of all frames of all videos, also the refused ones. The side that does not pass is in the other colour; \
                 heights go with the square root of the share, so that rare values can be seen; what lies beyond an end is in \
                 the last bar.";
    let cards = spread.all().map(|(measure, counts)| card(measure, counts, measure.threshold(settings, per_sec)));
    vec![node("p").text(about), node("div").class("grid").children(cards)]
}

fn card(shown: &Measure, counts: &Counts, threshold: ThresholdLine) -> Node {
    let title = node("h3").text(shown.title);
    let key = node("code").text(shown.key);
    let card = node("div").class("card distribution").child(title).child(node("small").child(key));
    if counts.total() == 0 {
        let unknown = if counts.unknown > 0 { "It was known of no frame." } else { "Nothing was measured." };
        return card.child(node("p").class("empty").text(unknown));
    }
    let (total, unknown) = (counts.total() as f64, counts.unknown as f64);
    let beyond = (0..counts.bins.len()).filter(|bin| {
        let middle = (counts.edge(*bin) + counts.edge(bin + 1)) / 2.0;
        if threshold.is_least { middle < threshold.value } else { middle > threshold.value }
    });
    let beyond: u64 = beyond.map(|bin| counts.bins[bin]).sum();
    let mut description = format!("about {} beyond the threshold", percent(beyond as f64, total));
    if unknown > 0.0 {
        description += &format!("; not known of {}", percent(unknown, total + unknown));
    }
    let what = counted(counts.total() as usize, shown.of());
    let label = format!("{}, {what}: {description}", shown.title);
    card.child(histogram(&label, counts, shown.unit, Some(threshold)))
        .child(node("small").text(format!("{what}, {description}")))
}
