//! Parsing of `pipeline.toml`: the parsed table is merged over the defaults, and every key that is unknown or has the
//! wrong type becomes a `Problem` with its line. All problems are collected before any is reported.

use super::auto::AUTO;
use super::former;
use super::sections::PATHS;
use super::{Settings, SpeakerConfig};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Error in one key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Dotted key, as in `extract.fps` or `speaker[0].name`; empty if the error is not about a key.
    pub key: String,
    pub location: SourceLocation,
    pub message: String,
}

/// Location at which a key was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SourceLocation {
    /// Line of the file, counted from 1.
    Line(usize),
    CommandLine,
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}: "),
            Self::CommandLine => write!(f, "--set: "),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.location)?;
        if self.key.is_empty() { write!(f, "{}", self.message) } else { write!(f, "{}: {}", self.key, self.message) }
    }
}

/// Result of parsing: settings, the location of every given key, and all errors.
pub struct Given {
    pub settings: Settings,
    pub locations: BTreeMap<String, SourceLocation>,
    pub problems: Vec<Problem>,
    /// Notes on keys given under a former name, a line each.
    pub notes: Vec<String>,
}

/// Subtable of each section (`[gan.advanced]`) for rarely changed keys, which the default `pipeline.toml` does not
/// list. Every key is accepted both there and in the section itself.
pub(super) const ADVANCED: &str = "advanced";

/// Largest number up to which f64 represents every integer: 2^53.
const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// Base folders of relative paths.
pub struct Folders<'a> {
    /// Folder of the configuration file, for paths in the file.
    pub file: &'a str,
    /// Working directory, for paths given by `--set`.
    pub current: &'a str,
}

/// Parses the text of a `pipeline.toml` and `--set key=value` changes, and merges both over the defaults.
pub fn read(text: &str, sets: &[String], folders: &Folders) -> Given {
    let mut reader = Reader {
        defaults: defaults::<Settings>(),
        locations: BTreeMap::new(),
        problems: Vec::new(),
        notes: Vec::new(),
    };
    let mut table = reader.defaults.clone();
    match DeTable::parse(text) {
        Ok(mut document) => {
            let location_at = |span| SourceLocation::Line(line_of(text, span));
            reader.notes.extend(former::rename_recipe(document.get_mut(), &location_at));
            reader.merge(document.get_ref(), &mut table, "", &location_at);
        }
        Err(error) => {
            let line = line_of(text, error.span().map_or(0, |span| span.start));
            reader.problem(
                "",
                SourceLocation::Line(line),
                format!("not valid TOML: {}", error.message().replace('\n', ", ")),
            );
        }
    }
    for set in sets {
        reader.set(set, &mut table);
    }
    reader.drop_rejected(&mut table);
    reader.resolve_paths(&mut table, folders);
    let settings = table.try_into::<Settings>().unwrap_or_else(|error| {
        reader.problem("", SourceLocation::Line(1), error.message().to_owned());
        Settings::default()
    });
    Given { settings, locations: reader.locations, problems: reader.problems, notes: reader.notes }
}

/// Table of all keys with their defaults.
fn defaults<T: Default + Serialize>() -> Table {
    // This cannot fail: defaults are numbers, strings and paths, which TOML can represent.
    Table::try_from(T::default()).unwrap_or_default()
}

struct Reader {
    /// All keys with their defaults.
    defaults: Table,
    locations: BTreeMap<String, SourceLocation>,
    problems: Vec<Problem>,
    notes: Vec<String>,
}

impl Reader {
    /// Default of the key `section.name`; `None` for keys of speakers and unknown keys.
    fn default_of(&self, key: &str) -> Option<&Value> {
        let (section, name) = key.split_once('.')?;
        self.defaults.get(section)?.get(name)
    }

    fn problem(&mut self, key: &str, location: SourceLocation, message: String) {
        self.problems.push(Problem { key: key.to_owned(), location, message });
    }

    /// Merges the parsed table `written` over `table`, key by key.
    fn merge(
        &mut self,
        written: &DeTable<'_>,
        table: &mut Table,
        prefix: &str,
        location_at: &dyn Fn(usize) -> SourceLocation,
    ) {
        for (name, value) in written {
            let key = format!("{prefix}{}", name.get_ref());
            let location = location_at(name.span().start);
            if key == "speaker" {
                self.merge_speakers(value.get_ref(), table, location, location_at);
                continue;
            }
            let is_section = prefix.matches('.').count() == 1 && !prefix.starts_with("speaker[");
            if name.get_ref() == ADVANCED && is_section {
                match value.get_ref() {
                    DeValue::Table(written) => self.merge(written, table, &format!("{key}."), location_at),
                    other => self.problem(&key, location, format!("expected a table, found {}", other.type_str())),
                }
                continue;
            }
            let plain = key.replacen(&format!(".{ADVANCED}."), ".", 1);
            let Some(default) = table.get_mut(name.get_ref().as_ref()) else {
                let advanced = is_section.then(|| ADVANCED.to_owned());
                let near = match former::renamed(&plain) {
                    Some(by) => format!(": {by}"),
                    None => did_you_mean(name.get_ref(), table.keys().chain(&advanced)),
                };
                self.problem(&key, location, format!("unknown key{near}"));
                continue;
            };
            if let (Value::Table(inner), DeValue::Table(written)) = (&mut *default, value.get_ref()) {
                self.merge(written, inner, &format!("{key}."), location_at);
                continue;
            }
            let model = self.default_of(&plain).unwrap_or(default).clone();
            let is_number = accepts_number(&plain, &model) && !matches!(value.get_ref(), DeValue::String(_));
            match to_type_of(value.get_ref(), if is_number { &Value::Float(0.0) } else { &model }) {
                Ok(value) => {
                    *default = if is_number { to_integer(value) } else { value };
                    // TOML forbids duplicate keys, so the other occurrence is in the section or its advanced table.
                    if let Some(SourceLocation::Line(line)) = self.locations.insert(plain.clone(), location)
                        && location != SourceLocation::CommandLine
                    {
                        let (section, name) = plain.split_once('.').unwrap_or_default();
                        let other = if key == plain { format!("{section}.{ADVANCED}.{name}") } else { plain };
                        self.problem(&key, location, format!("given in line {line} too, as {other}; keep one"));
                    }
                }
                Err(message) => self.problem(&key, location, message),
            }
        }
    }

    fn merge_speakers(
        &mut self,
        value: &DeValue<'_>,
        table: &mut Table,
        location: SourceLocation,
        location_at: &dyn Fn(usize) -> SourceLocation,
    ) {
        let DeValue::Array(entries) = value else {
            return self.problem("speaker", location, "expected [[speaker]] tables".to_owned());
        };
        let mut speakers = Vec::new();
        for (at, entry) in entries.iter().enumerate() {
            let key = format!("speaker[{at}]");
            let location = location_at(entry.span().start);
            let DeValue::Table(written) = entry.get_ref() else {
                self.problem(&key, location, "expected a [[speaker]] table".to_owned());
                continue;
            };
            let mut speaker = defaults::<SpeakerConfig>();
            self.locations.insert(key.clone(), location);
            self.merge(written, &mut speaker, &format!("{key}."), location_at);
            let is_written = |name: &str| written.keys().any(|key| key.get_ref() == name);
            let is_needed = |name: &str| !is_written(name) && (name == "name" || !is_written("keypoints"));
            for name in ["name", "videos"].into_iter().filter(|name| is_needed(name)) {
                self.problem(&key, location, format!("the key {name} is missing"));
            }
            speaker.retain(|name, _| is_written(name) || (["name", "videos"].contains(&name) && is_needed(name)));
            speakers.push(Value::Table(speaker));
        }
        table.insert("speaker".to_owned(), Value::Array(speakers));
    }

    /// Removes each value that the type of its setting rejects, so that the problem names its key and the other values
    /// are still checked.
    fn drop_rejected(&mut self, table: &mut Table) {
        for (key, location) in self.locations.clone() {
            let Some((section, name)) = key.split_once('.') else { continue };
            let Some(inner) = table.get_mut(section).and_then(Value::as_table_mut) else { continue };
            let Some(value) = inner.get(name).cloned() else { continue };
            let single_key = Table::from_iter([(name.to_owned(), value.clone())]);
            let single_key = Table::from_iter([(section.to_owned(), Value::Table(single_key))]);
            if let Err(error) = single_key.try_into::<Settings>() {
                inner.remove(name);
                self.problem(&key, location, rejection_message(&value, error.message()));
            }
        }
    }

    /// Makes all paths absolute: those in the file are relative to its folder, those given by `--set` to the working
    /// directory.
    fn resolve_paths(&self, table: &mut Table, folders: &Folders) {
        for (section, name) in PATHS.iter().filter_map(|key| key.split_once('.')) {
            let entries = match table.get_mut(section) {
                Some(Value::Array(entries)) => entries.iter_mut().filter_map(Value::as_table_mut).collect(),
                Some(Value::Table(entry)) => vec![entry],
                _ => continue,
            };
            let is_set = self.locations.get(&format!("{section}.{name}")) == Some(&SourceLocation::CommandLine);
            let folder = Path::new(if is_set { folders.current } else { folders.file });
            for path in entries.into_iter().filter_map(|entry| entry.get_mut(name)) {
                if let Some(text) = path.as_str().filter(|text| !text.is_empty()) {
                    *path = Value::String(folder.join(text).to_string_lossy().into_owned());
                }
            }
        }
    }

    /// Applies one `--set key=value`; a value that is not valid TOML is taken as a string.
    fn set(&mut self, set: &str, table: &mut Table) {
        let Some((key, value)) = set.split_once('=') else {
            return self.problem(
                "",
                SourceLocation::CommandLine,
                format!("{set}: expected KEY=VALUE, like extract.fps=15"),
            );
        };
        if key.starts_with("speaker") {
            return self.problem(
                key,
                SourceLocation::CommandLine,
                "speakers can only be set in the configuration file".to_owned(),
            );
        }
        let is_key = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '.');
        let quoted = toml::Value::String(value.to_owned()).to_string();
        let as_string = format!("{key} = {quoted}");
        let as_toml = format!("{key} = {value}");
        let parsed = DeTable::parse(&as_toml).or_else(|_| DeTable::parse(&as_string));
        match parsed {
            Ok(mut document) if is_key => {
                self.notes.extend(former::rename_recipe(document.get_mut(), &|_| SourceLocation::CommandLine));
                self.merge(document.get_ref(), table, "", &|_| SourceLocation::CommandLine);
            }
            _ => self.problem(
                key,
                SourceLocation::CommandLine,
                "unknown key: expected SECTION.KEY, like extract.fps".to_owned(),
            ),
        }
    }
}

/// Whether a key whose default is "auto" also accepts a number.
fn accepts_number(key: &str, default: &Value) -> bool {
    let Some((section, name)) = key.split_once('.').filter(|_| default.as_str() == Some(AUTO)) else { return false };
    let single_key = Table::from_iter([(name.to_owned(), Value::Integer(1))]);
    Table::from_iter([(section.to_owned(), Value::Table(single_key))]).try_into::<Settings>().is_ok()
}

/// Converts a float without fraction to an integer, so that it is also accepted for a count.
fn to_integer(value: Value) -> Value {
    match value {
        Value::Float(number) if number.fract() == 0.0 && (0.0..=MAX_EXACT_INTEGER).contains(&number) => {
            Value::Integer(number as i64)
        }
        other => other,
    }
}

/// Converts `value` to the type of `default`; the error is a message that states the expected type.
fn to_type_of(value: &DeValue<'_>, default: &Value) -> Result<Value, String> {
    let type_error = |expected: &str| Err(format!("expected {expected}, found {}", value.type_str()));
    match (default, value) {
        (Value::Boolean(_), DeValue::Boolean(b)) => Ok(Value::Boolean(*b)),
        (Value::Boolean(_), _) => type_error("true or false"),
        (Value::String(_), DeValue::String(s)) => Ok(Value::String(s.to_string())),
        (Value::String(_), _) => type_error("a string"),
        (Value::Integer(_), DeValue::Integer(i)) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) if i >= 0 => Ok(Value::Integer(i)),
            _ => Err(format!("{i} is out of range: expected an integer of at least 0")),
        },
        (Value::Integer(_), _) => type_error("an integer"),
        (Value::Float(_), DeValue::Float(f)) => to_finite(f.as_str()),
        (Value::Float(_), DeValue::Integer(i)) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Ok(Value::Float(i as f64)),
            Err(_) => to_finite(i.as_str()),
        },
        (Value::Float(_), _) => type_error("a number"),
        (Value::Array(_), DeValue::Array(items)) => {
            let model = Value::String(String::new());
            items.iter().map(|item| to_type_of(item.get_ref(), &model)).collect::<Result<_, _>>().map(Value::Array)
        }
        (Value::Array(_), DeValue::String(s)) => Ok(Value::Array(vec![Value::String(s.to_string())])),
        (Value::Array(_), _) => type_error("a string or a list of strings"),
        (Value::Table(_), _) => type_error("a table"),
        (Value::Datetime(_), _) => type_error("another value"),
    }
}

fn to_finite(text: &str) -> Result<Value, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.map(Value::Float).ok_or_else(|| format!("{text} is not a finite number"))
}

/// Message for a value of the right TOML type that its setting rejects; `message` is that of serde.
pub fn rejection_message(value: &Value, message: &str) -> String {
    if let Some(at) = message.find("expected \"auto\"") {
        return format!("invalid value {value}: {}", message[at..].lines().next().unwrap_or_default());
    }
    let Value::String(text) = value else { return format!("{value} is too large") };
    let expected = message.strip_prefix(&format!("unknown variant `{text}`, ")).unwrap_or(message);
    let known: Vec<String> = expected.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    format!("unknown value {text:?}: {}{}", expected.replace('`', "\""), did_you_mean(text, known.iter()))
}

/// ` (did you mean X?)` if a known key is similar to `name`, otherwise an empty string.
pub fn did_you_mean<'k>(name: &str, known: impl Iterator<Item = &'k String>) -> String {
    let best = known.map(|key| (strsim::levenshtein(name, key), key)).min();
    match best {
        Some((steps, key)) if steps <= 1 + key.len() / 3 => format!(" (did you mean {key}?)"),
        _ => String::new(),
    }
}

/// Line number of the byte at `offset` in `text`, counted from 1.
pub fn line_of(text: &str, offset: usize) -> usize {
    1 + text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count()
}
