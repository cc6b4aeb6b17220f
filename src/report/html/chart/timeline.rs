//! Time axes. Timeline of a video: its intervals side by side, an HTML list, which can be read by screen readers,
//! navigated by keyboard (`page.js`) and drawn at any width. Tracks below one another: lines, and events as short
//! strokes; a script may move the line `at` over them between `data-left` and `data-right`, the positions of the first
//! and last second.

use super::scale::{Scale, drawing, line, path_data, px, text_at};
use crate::html::node::{Node, node};
use orator_base::text::number;

#[derive(Clone, Debug)]
pub struct TimelineSpan {
    pub start_secs: f64,
    pub end_secs: f64,
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

const WIDTH: f64 = 720.0;
const TRACK: f64 = 66.0;
const GAP: f64 = 22.0;
const FOOT: f64 = 20.0;
const LEFT: f64 = 4.0;
const RIGHT: f64 = 716.0;

#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Name with unit.
    pub name: String,
    /// CSS class and points (second, value) of each line; larger values are higher, non-finite values are gaps.
    pub lines: Vec<(&'static str, Vec<[f64; 2]>)>,
    /// CSS class and times of events, seconds. The first set is drawn at the bottom of the track, the others above it.
    pub marks: Vec<(&'static str, Vec<f64>)>,
}

/// Chart with a time axis of `secs` seconds.
pub fn tracks(label: &str, secs: f64, tracks: &[Track]) -> Node {
    let height = tracks.len() as f64 * (TRACK + GAP) + FOOT;
    let x = Scale { low: 0.0, high: secs.max(1e-9), from: LEFT, to: RIGHT };
    let mut svg =
        drawing(WIDTH, height, label).class("tracks").attr("data-left", px(LEFT)).attr("data-right", px(RIGHT));
    for (i, track) in tracks.iter().enumerate() {
        let top = i as f64 * (TRACK + GAP) + GAP;
        let floor = top + TRACK;
        svg = svg.child(text_at("name", [LEFT + 6.0, top - 6.0], "start", &track.name));
        svg = svg.child(line("grid", [LEFT, floor], [RIGHT, floor]));
        let values = track.lines.iter().flat_map(|(_, points)| points.iter().map(|point| point[1]));
        let [low, high] = values
            .filter(|value| value.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let y = Scale { low, high, from: floor - 2.0, to: top };
        for (class, points) in &track.lines {
            let runs = points.split(|point| point.iter().any(|v| !v.is_finite())).filter(|run| run.len() > 1);
            let drawn: Vec<String> =
                runs.map(|run| path_data(run.iter().map(|[secs, value]| [x.at(*secs), y.at(*value)]))).collect();
            if !drawn.is_empty() {
                svg = svg.child(node("path").class(format!("stroke {class}")).attr("d", drawn.join(" ")));
            }
        }
        let n = track.marks.len().max(1) as f64;
        for (k, (class, moments)) in track.marks.iter().enumerate() {
            // The marks share the full height of a track without lines.
            let part = if track.lines.is_empty() { TRACK / n } else { 12.0 };
            let base = floor - k as f64 * part;
            let drawn: Vec<String> = moments
                .iter()
                .map(|moment| format!("M{} {}V{}", px(x.at(*moment)), px(base), px(base - part + 2.0)))
                .collect();
            if !drawn.is_empty() {
                svg = svg.child(node("path").class(format!("moment {class}")).attr("d", drawn.join("")));
            }
        }
    }
    let foot = height - FOOT;
    for tick in x.ticks(10) {
        let anchor = if tick <= 0.0 { "start" } else { "middle" };
        svg = svg.child(text_at("tick", [x.at(tick), foot + 15.0], anchor, &format!("{} s", number(tick))));
    }
    svg.child(line("at", [LEFT, GAP], [LEFT, foot]))
}
