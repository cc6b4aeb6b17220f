//! Timeline of a video: its intervals side by side with widths by duration. It is an HTML list, so it can be read by
//! screen readers, navigated by keyboard (`page.js`) and drawn at any width.

use crate::html::node::{Node, node};

/// Interval of a timeline.
#[derive(Clone, Debug)]
pub struct TimelineSpan {
    pub start_secs: f64,
    pub end_secs: f64,
    /// CSS class of its colour.
    pub class: String,
    /// Label, shown if there is room.
    pub word: String,
    /// Tooltip.
    pub description: String,
}

/// Timeline of a video of `duration_secs`; `label` is for screen readers. If there are more than `max_spans` intervals,
/// neighbouring short ones are merged, which leaves at most about twice `max_spans`.
pub fn timeline(label: &str, duration_secs: f64, spans: &[TimelineSpan], max_spans: usize) -> Node {
    let total_secs = duration_secs.max(1e-9);
    let share = |secs: f64| format!("{:.3}%", 100.0 * (secs / total_secs).clamp(0.0, 1.0));
    let list = node("ol").class("timeline").attr("tabindex", "0").attr("aria-label", label);
    list.children(drawn(spans, total_secs, max_spans).into_iter().map(|span| {
        let style = format!("left:{};width:{}", share(span.start_secs), share(span.end_secs - span.start_secs));
        let word = node("span").text(&span.word);
        node("li").class(&span.class).attr("style", style).attr("title", &span.description).child(word)
    }))
}

/// Intervals to draw: all, or if there are more than `max_spans`, with runs of short ones merged. A merged interval has
/// the class and label of the longest, and a description with their number.
fn drawn(spans: &[TimelineSpan], total_secs: f64, max_spans: usize) -> Vec<TimelineSpan> {
    if spans.len() <= max_spans {
        return spans.to_vec();
    }
    let secs = |span: &TimelineSpan| span.end_secs - span.start_secs;
    let is_short = |span: &TimelineSpan| secs(span) * (max_spans as f64) < total_secs;
    // Each interval with the number of short intervals merged in it, and the seconds of the longest of them.
    let mut drawn: Vec<(TimelineSpan, usize, f64)> = Vec::new();
    for span in spans {
        match drawn.last_mut() {
            Some((run, n, longest)) if *n > 0 && is_short(span) && is_short(run) => {
                if secs(span) > *longest {
                    *longest = secs(span);
                    *run = TimelineSpan { start_secs: run.start_secs, ..span.clone() };
                }
                run.end_secs = span.end_secs;
                *n += 1;
            }
            _ => drawn.push((span.clone(), usize::from(is_short(span)), secs(span))),
        }
    }
    let merged = drawn.into_iter().map(|(span, n, _)| match n {
        0 | 1 => span,
        n => TimelineSpan { description: format!("{n} short intervals, the longest: {}", span.description), ..span },
    });
    merged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_interval_is_drawn_and_very_many_are_merged() {
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
