//! HTML page of the errors on rendered persons: the grids of each model set.

use crate::evaluate::people::grid::{Grid, grids};
use crate::evaluate::people::table::ConditionRow;
use orator_report::html::{Node, Page, Section, node, table};
use serde_json::Value;

/// Text of the page; `last`: a grid of its own section.
pub fn html(rows: &[ConditionRow], last: Option<&Grid>) -> String {
    let sets: Vec<&[ConditionRow]> = rows.chunk_by(|a, b| a.set == b.set).collect();
    let n_clips: usize = sets.iter().map(|rows| rows.last().map_or(0, |all| all.n_clips)).max().unwrap_or(0);
    let names: Vec<&str> = sets.iter().map(|rows| rows[0].set.as_str()).collect();
    let body = sets.iter().flat_map(|rows| {
        let title = node("h3").text(format!("Model set {}", rows[0].set));
        std::iter::once(title).chain(grids(rows).iter().flat_map(shown).collect::<Vec<_>>())
    });
    let mut sections = vec![Section { id: "sets", title: "By condition", body: body.collect() }];
    sections.extend(last.map(|grid| Section {
        id: "keypoints",
        title: "Keypoints without ground truth",
        body: shown(grid).into(),
    }));
    let page = Page {
        title: "Errors on rendered persons".to_owned(),
        lead: format!("{n_clips} clips of rendered persons with ground truth; model sets: {}.", names.join(", ")),
        sections,
        style: "",
        script: "",
        data: Value::Null,
    };
    page.html()
}

fn shown(grid: &Grid) -> [Node; 2] {
    let head = |text: &str| node("th").attr("scope", "col").class("num").text(text);
    let first = node("th").attr("scope", "col").text(grid.title);
    let heads = std::iter::once(first).chain(grid.heads.iter().map(|text| head(text)));
    let rows = grid.rows.iter().map(|(name, cells)| {
        let cells = cells.iter().map(|cell| node("td").class("num").text(cell));
        node("tr").child(node("th").attr("scope", "row").text(name.trim())).children(cells)
    });
    let table = node("div").class("scroll").attr("tabindex", "0").child(table("figures", heads, rows));
    [table, node("p").class("small").text(grid.note)]
}
