//! Columns of a table of votes, and what they are called in the file at hand.

use crate::vote::VOTE_COLUMNS;
use anyhow::{Result, bail, ensure};
use std::collections::BTreeMap;

/// Short forms of tables by others: one condition, whether the answer was right, one score, a step of preference.
const SHORT_FORMS: [&str; 4] = ["condition", "correct", "score", "step"];

/// Everything that a column can mean.
pub fn fields() -> impl Iterator<Item = &'static str> {
    VOTE_COLUMNS.into_iter().chain(SHORT_FORMS)
}

/// Names of columns that differ from those of the fields, by field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnNames(BTreeMap<&'static str, String>);

impl ColumnNames {
    /// Parses `participant=worker,clip=stimulus`.
    pub fn parse(text: &str) -> Result<Self> {
        let mut names = BTreeMap::new();
        for pair in text.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
            let Some((field, name)) = pair.split_once('=').map(|(field, name)| (field.trim(), name.trim())) else {
                bail!("--columns: \"{pair}\" is no pair; expected like participant=worker,clip=stimulus")
            };
            let Some(known) = fields().find(|known| *known == field) else {
                bail!(
                    "--columns: there is no field \"{field}\"; fields are {}",
                    fields().collect::<Vec<_>>().join(", ")
                )
            };
            ensure!(!name.is_empty(), "--columns: {field} has no name behind the sign =");
            ensure!(names.insert(known, name.to_owned()).is_none(), "--columns: {field} is named twice");
        }
        Ok(Self(names))
    }

    /// Name in the file of a field.
    pub fn of(&self, field: &'static str) -> &str {
        self.0.get(field).map_or(field, String::as_str)
    }

    /// Places of the fields in a header, by field. Names are compared without regard to case and outer space.
    pub fn places(&self, header: &[String]) -> Result<BTreeMap<&'static str, usize>> {
        let is = |name: &str, cell: &String| cell.trim().to_lowercase() == name.to_lowercase();
        let mut places = BTreeMap::new();
        for field in fields() {
            let name = self.of(field);
            let mut found = (0..header.len()).filter(|place| is(name, &header[*place]));
            match (found.next(), found.next()) {
                (Some(place), None) => drop(places.insert(field, place)),
                (Some(_), Some(_)) => bail!("two columns are called \"{name}\"; rename one of them"),
                (None, _) if self.0.contains_key(field) => {
                    bail!("there is no column \"{name}\"; the columns are {}", shown(header))
                }
                (None, _) => {}
            }
        }
        Self::check(&places.keys().copied().collect::<Vec<_>>(), header)?;
        Ok(places)
    }

    /// What a table must have: who, what, and an answer.
    fn check(fields: &[&str], header: &[String]) -> Result<()> {
        let lacks = |field: &str| !fields.contains(&field);
        for field in ["participant", "clip"] {
            if lacks(field) {
                let near = header.iter().max_by(|a, b| near(field, a).total_cmp(&near(field, b)));
                let example =
                    near.map(|near| format!(", such as --columns {field}={}", near.trim())).unwrap_or_default();
                bail!("there is no column \"{field}\"; the columns are {}. Name it{example}", shown(header));
            }
        }
        let answers = ["response", "correct", "score", "step"];
        if answers.iter().all(|answer| lacks(answer)) {
            bail!(
                "there is no answer: none of the columns {}; the columns are {}. Name it, such as --columns correct=NAME",
                answers.join(", "),
                shown(header)
            );
        }
        Ok(())
    }
}

/// Similarity of two names, 0 to 1.
fn near(field: &str, cell: &str) -> f64 {
    strsim::jaro_winkler(field, &cell.trim().to_lowercase())
}

/// Header in an error, at most 20 names of it.
fn shown(header: &[String]) -> String {
    let names: Vec<String> = header.iter().take(20).map(|name| name.trim().chars().take(40).collect()).collect();
    format!("{}{}", names.join(", "), if header.len() > 20 { ", ..." } else { "" })
}
