//! Page of a training as one picture: the curves in rows, the poses below.

use super::strip::WIDTH;
use crate::html::chart::lines::LineChart;
use crate::html::numbers::number;
use anyhow::Result;
use orator_avatar::animate::draw::figure::{INK, LEFT, PAPER, RIGHT, mix};
use orator_base::types::image::Image;
use orator_media::opencv::draw;

const N_COLUMNS: usize = 4;
const CELL: [usize; 2] = [WIDTH / N_COLUMNS, 180];
const TITLE_PX: usize = 40;
const GAP_PX: usize = 20;
/// Line colours, equal to those of the page.
const COLOURS: [[u8; 3]; 3] = [LEFT, RIGHT, [122, 128, 134]];

/// Draws title, curves and poses.
pub fn picture(title: &str, charts: &[LineChart], strip: &Image) -> Result<Image> {
    let charts_px = charts.len().div_ceil(N_COLUMNS) * CELL[1];
    let mut image = Image::filled(WIDTH, TITLE_PX + charts_px + GAP_PX + strip.height, PAPER);
    draw::text(&mut image, title, [10.0, 27.0], 13.0, INK)?;
    let about = "upright: the best epoch; level: mean pose, or the data's own";
    draw::text(&mut image, about, [WIDTH as f32 - 10.0 - draw::text_width(about, 8.0)?, 27.0], 8.0, INK)?;
    for (i, chart) in charts.iter().enumerate() {
        let corner = [i % N_COLUMNS * CELL[0], TITLE_PX + i / N_COLUMNS * CELL[1]];
        draw_chart(&mut image, corner.map(|px| px as f32), chart)?;
    }
    draw::paste(&mut image, strip, [0, TITLE_PX + charts_px + GAP_PX]);
    Ok(image)
}

fn draw_chart(image: &mut Image, [left, top]: [f32; 2], chart: &LineChart) -> Result<()> {
    let [[first, last], [low, high]] = chart.ranges();
    let (start, end) = (left + 46.0, left + CELL[0] as f32 - 12.0);
    let (ceiling, floor) = (top + 40.0, top + CELL[1] as f32 - 24.0);
    let x = |step: f64| start + (end - start) * ((step - first) / (last - first)) as f32;
    let y = |value: f64| floor + (ceiling - floor) * ((value - low) / (high - low)).clamp(0.0, 1.0) as f32;
    // The font has ASCII only.
    draw::text(image, &chart.title.replace('\u{b2}', "2"), [left + 10.0, top + 14.0], 9.0, INK)?;
    let mut at = left + 10.0;
    for (name, colour) in chart.lines.iter().map(|line| (&line.name, line.colour)) {
        draw::text(image, name, [at, top + 29.0], 7.0, COLOURS[colour % COLOURS.len()])?;
        at += draw::text_width(name, 7.0)? + 10.0;
    }
    for tick in chart.ticks() {
        draw::line(image, [start, y(tick)], [end, y(tick)], 1.0, mix(INK, PAPER, 0.85))?;
        let words = number(tick);
        draw::text(image, &words, [start - 6.0 - draw::text_width(&words, 7.0)?, y(tick) + 3.0], 7.0, INK)?;
    }
    draw::line(image, [start, floor], [end, floor], 1.0, INK)?;
    for (step, place) in [(first, start), (last, end - draw::text_width(&number(last), 7.0)?)] {
        draw::text(image, &number(step), [place, floor + 14.0], 7.0, INK)?;
    }
    if let Some(step) = chart.marked {
        draw::line(image, [x(step), ceiling], [x(step), floor], 1.0, mix(INK, PAPER, 0.3))?;
    }
    for level in chart.levels.iter().filter(|level| level.value.is_finite()) {
        let pale = mix(COLOURS[level.colour % COLOURS.len()], PAPER, 0.5);
        draw::line(image, [start, y(level.value)], [end, y(level.value)], 1.0, pale)?;
    }
    for line in &chart.lines {
        let places: Vec<[f32; 2]> = line.places.iter().map(|[step, value]| [x(*step), y(*value)]).collect();
        for ends in places.windows(2) {
            draw::line(image, ends[0], ends[1], 2.0, COLOURS[line.colour % COLOURS.len()])?;
        }
    }
    Ok(())
}
