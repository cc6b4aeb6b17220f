//! Formats the table as text for a terminal.

use super::conclusion::{better_than_constant_pose, depends_on_audio};
use super::labels;
use crate::evaluate::baseline::baselines::PredictorKind;
use crate::evaluate::table::table::{FEW_BLOCKS, N_COSTLY_DRAWS, N_DRAWS, PredictorRow, Table};
use crate::metrics::catalogue::Better;
use orator_base::text::{counted, length};
use std::fmt::Write as _;

/// Text with the table, descriptions of its columns, and conclusions.
///
/// `all` shows every metric; otherwise arms, fingers and wrists are only shown for correct keypoints and joint errors.
pub fn text(table: &Table, all: bool) -> String {
    let Table { n_clips, n_blocks, n_frames, secs, .. } = table;
    let mut text = format!(
        "{}, {}, {n_frames} frames, {} of about {:.1} s\n\n",
        counted(*n_clips, "clip"),
        length(*secs),
        counted(*n_blocks, "block"),
        table.block_length.secs
    );
    let is_shown = |i: &usize| (all || is_main(table, *i)) && table.is_shown(*i);
    let shown: Vec<usize> = (0..table.definitions.len()).filter(is_shown).collect();
    let first: Vec<String> = shown.iter().map(|i| row_label(table, *i)).collect();
    let width = first.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let columns: Vec<Vec<String>> = table.rows.iter().map(|row| column(table, row, &shown)).collect();
    let widths: Vec<usize> =
        columns.iter().map(|cells| cells.iter().map(|cell| cell.chars().count()).max().unwrap_or(0) + 2).collect();
    let line = |head: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cells: String = cells.zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        format!("{head:width$}{cells}").trim_end().to_owned() + "\n"
    };
    for k in 0..2 {
        text += &line("", &mut columns.iter().map(|cells| cells[k].as_str()));
    }
    for (i, name) in first.iter().enumerate() {
        text += &line(name, &mut columns.iter().map(|cells| cells[i + 2].as_str()));
    }
    let few = if *n_blocks < FEW_BLOCKS { "; unreliable with so few blocks" } else { "" };
    let _ = writeln!(
        text,
        "\nin brackets: 95 % bootstrap intervals, {N_DRAWS} draws of the blocks ({N_COSTLY_DRAWS} for Frechet distances and correlations){few}"
    );
    text += "before each name: whether higher values, lower values, or values close to those of the truth are better\n";
    if !all {
        text += "--all also shows the other metrics of arms, fingers and wrists\n";
    }
    for row in &table.rows {
        let _ = writeln!(text, "{}: {}", row.name(), row.description);
    }
    for note in &table.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for note in undefined(table) {
        let _ = writeln!(text, "no value: {note}");
    }
    for own in table.predictions() {
        let _ = writeln!(text);
        for conclusion in [better_than_constant_pose(table, own), depends_on_audio(table, own)] {
            let of = own.checkpoint.as_ref().map(|of| format!("{}: ", of.name)).unwrap_or_default();
            let _ = writeln!(text, "{of}{}", conclusion.text());
        }
    }
    text
}

/// Sentences on metrics without any value, grouped by reason.
pub fn undefined(table: &Table) -> Vec<String> {
    let mut by_reason: Vec<(String, Vec<String>)> = Vec::new();
    let Some(own) = table.row(PredictorKind::Prediction) else { return Vec::new() };
    let hidden = (0..table.definitions.len()).filter(|i| table.definitions[*i].better != Better::Neither);
    for index in hidden.filter(|i| !own.values[*i].value.is_finite()) {
        let (reason, name) = (own.reasons[index].clone(), labels::name(&table.definitions[index]));
        match by_reason.iter_mut().find(|(other, _)| *other == reason) {
            Some((_, names)) => names.push(name),
            None => by_reason.push((reason, vec![name])),
        }
    }
    by_reason.into_iter().map(|(reason, names)| format!("{}: {reason}", names.join(", "))).collect()
}

/// Whether a metric is shown without `all`: one for the whole body, or else for the first part that has a value; a
/// posture channel; or a part of the main position metrics.
fn is_main(table: &Table, index: usize) -> bool {
    let definition = &table.definitions[index];
    let name = labels::name_without_part(definition);
    let has_name = |i: &usize| labels::name_without_part(&table.definitions[*i]) == name && table.is_shown(*i);
    let first = (0..table.definitions.len()).find(has_name);
    let is_position = ["pck_3d", "mpjpe"].iter().any(|start| definition.name.starts_with(start));
    let is_angle = table.settings.channels.iter().any(|channel| channel.name() == definition.part);
    first == Some(index) || is_angle || (is_position && ["body", "hands"].contains(&definition.part))
}

fn row_label(table: &Table, index: usize) -> String {
    let definition = &table.definitions[index];
    let sign = match definition.better {
        Better::Higher => "higher",
        Better::Lower => "lower ",
        Better::NearerTruth => "truth ",
        Better::Neither => "      ",
    };
    let unit = labels::unit(definition);
    let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    format!("{sign}  {}{unit}", labels::name(definition))
}

/// Column head in two lines, followed by one cell per metric; the cells of predictions have intervals.
fn column(table: &Table, row: &PredictorRow, shown: &[usize]) -> Vec<String> {
    let cell = |index: &usize| {
        let (definition, estimate) = (&table.definitions[*index], &row.values[*index]);
        match row.kind {
            PredictorKind::Prediction => labels::bracketed(definition, estimate),
            _ => labels::number(definition, estimate.value),
        }
    };
    let name = row.name();
    let (first, second) = name.split_once(' ').unwrap_or(("", &name));
    [first, second].map(str::to_owned).into_iter().chain(shown.iter().map(cell)).collect()
}
