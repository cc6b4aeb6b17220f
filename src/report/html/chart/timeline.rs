//! Parts of a video side by side with widths by duration: an HTML list, so that it can be read out, navigated by keys
//! (`page.js`) and drawn at any width.

use crate::html::node::{Node, node};

/// Part of a timeline.
#[derive(Clone, Debug)]
pub struct TimelineSpan {
    pub start_secs: f64,
    pub end_secs: f64,
    /// CSS class of its colour.
    pub class: String,
    /// Label, shown where there is room.
    pub word: String,
    /// Tooltip.
    pub description: String,
}

/// Timeline of a video of `duration_secs` with the name `label`. Above `most` parts, the shortest are merged, which
/// leaves at most twice as many.
pub fn timeline(label: &str, duration_secs: f64, stretches: &[TimelineSpan], most: usize) -> Node {
    let whole = duration_secs.max(1e-9);
    let share = |secs: f64| format!("{:.3}%", 100.0 * (secs / whole).clamp(0.0, 1.0));
    let list = node("ol").class("timeline").attr("tabindex", "0").attr("aria-label", label);
    list.children(drawn(stretches, whole, most).into_iter().map(|stretch| {
        let place =
            format!("left:{};width:{}", share(stretch.start_secs), share(stretch.end_secs - stretch.start_secs));
        let word = node("span").text(&stretch.word);
        node("li").class(&stretch.class).attr("style", place).attr("title", &stretch.description).child(word)
    }))
}

/// Parts that are drawn: all, or above `most` parts with neighbouring slivers merged into one with the look of the
/// longest and their number.
fn drawn(stretches: &[TimelineSpan], whole: f64, most: usize) -> Vec<TimelineSpan> {
    if stretches.len() <= most {
        return stretches.to_vec();
    }
    let secs = |stretch: &TimelineSpan| stretch.end_secs - stretch.start_secs;
    let narrow = |stretch: &TimelineSpan| secs(stretch) * (most as f64) < whole;
    // Part with the number of slivers in it, and the seconds of the longest.
    let mut drawn: Vec<(TimelineSpan, usize, f64)> = Vec::new();
    for stretch in stretches {
        match drawn.last_mut() {
            Some((run, n, longest)) if *n > 0 && narrow(stretch) && narrow(run) => {
                if secs(stretch) > *longest {
                    *longest = secs(stretch);
                    *run = TimelineSpan { start_secs: run.start_secs, ..stretch.clone() };
                }
                run.end_secs = stretch.end_secs;
                *n += 1;
            }
            _ => drawn.push((stretch.clone(), usize::from(narrow(stretch)), secs(stretch))),
        }
    }
    let merged = drawn.into_iter().map(|(stretch, n, _)| match n {
        0 | 1 => stretch,
        n => TimelineSpan {
            description: format!("{n} short intervals, the longest: {}", stretch.description),
            ..stretch
        },
    });
    merged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_every_stretch_and_very_many_are_drawn_together() {
        let of = |n: usize| {
            let one = |i: usize| TimelineSpan {
                start_secs: i as f64,
                end_secs: (i + 1) as f64,
                class: format!("c{}", i % 2),
                word: String::new(),
                description: "<one>".to_owned(),
            };
            timeline("a \"b\"", n as f64, &(0..n).map(one).collect::<Vec<_>>(), 500).to_string()
        };
        assert_eq!(of(10).matches("<li").count(), 10);
        assert!(of(10).contains("left:90.000%;width:10.000%") && of(10).contains("title=\"&lt;one&gt;\""));
        let many = of(100_000);
        assert!(many.matches("<li").count() <= 1001 && many.contains("short intervals, the longest"));
        assert_eq!(timeline("", 0.0, &[], 9).to_string().matches("<li").count(), 0);
    }
}
