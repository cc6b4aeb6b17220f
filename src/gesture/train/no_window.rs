//! Explains why a split has no window to train or validate on, or too little motion, and suggests a remedy.

use anyhow::{Result, bail};
use orator_base::text::{counted, length};
use orator_dataset::info::DatasetInfo;
use orator_dataset::{Dataset, Split};

/// Windows or segments that are cut out of the intervals of a dataset.
#[derive(Clone, Copy, Debug)]
pub struct NeededFrames {
    /// Name in messages, such as "a window".
    pub name: &'static str,
    pub n_frames: usize,
    /// Configuration key of the length in frames, and the number its values must be multiples of.
    pub key: Option<(&'static str, usize)>,
}

/// Shortest duration of motion, seconds, for which the recipes have values.
const LITTLE_SECS: f64 = 120.0;

/// Warning before a training from random weights on `secs` seconds of motion, if that is too little.
pub fn motion_warning(secs: f64) -> Option<String> {
    (secs < LITTLE_SECS).then(|| {
        format!(
            "warning: {} of motion to train on: expect a result close to the mean pose; add videos: at least {} are \
             needed, ten minutes are better",
            length(secs),
            counted((LITTLE_SECS / 60.0) as usize, "minute")
        )
    })
}

/// Fails with cause and remedy if no interval of the training split is long enough.
pub fn ensure_window(dataset: &Dataset, needed: NeededFrames) -> Result<()> {
    match cause(dataset, Split::Train, needed) {
        Some(cause) => bail!("{}: nothing to train on: {cause}", dataset.dir().display()),
        None => Ok(()),
    }
}

/// Message with cause and remedy if no interval of `split` is long enough; `None` if one is.
pub fn cause(dataset: &Dataset, split: Split, needed: NeededFrames) -> Option<String> {
    let samples = dataset.samples(split);
    let Some(longest) = samples.iter().map(|sample| sample.n_frames).max() else {
        return Some(empty(dataset.info(), split));
    };
    if longest >= needed.n_frames {
        return None;
    }
    let fps = dataset.info().fps;
    let long = |n_frames| format!("{n_frames} frames ({:.1} s)", fps.secs(n_frames));
    let NeededFrames { name, n_frames, key } = needed;
    let shorter = key.map(|(key, multiple)| (key, longest / multiple * multiple)).filter(|(_, frames)| *frames > 0);
    let remedy = match shorter {
        Some((key, frames)) => format!("use `--set {key}={frames}` for shorter ones"),
        None => "add footage with longer speech; `orator report` shows why intervals ended".to_owned(),
    };
    let found = match samples.len() {
        1 => format!("the only interval of the {} split has {}", split.name(), long(longest)),
        n => format!("the longest of the {n} intervals of the {} split has {}", split.name(), long(longest)),
    };
    Some(format!("{found}, but {name} needs {}; {remedy}", long(n_frames)))
}

/// Message that a split is empty, with the contents of the other splits and the setting that fills it.
fn empty(info: &DatasetInfo, split: Split) -> String {
    let (mut others, mut is_all_empty) = (Vec::new(), true);
    for other in Split::ALL.into_iter().filter(|other| *other != split) {
        let (n, secs) = info.splits.get(other.name()).map_or((0, 0.0), |split| (split.samples, split.secs));
        is_all_empty &= n == 0;
        others.push(format!("{} has {}, {}", other.name(), counted(n, "interval"), length(secs)));
    }
    let name = split.name();
    // `models` lists the models of `orator run`, which processes videos; it is empty for imports and captures.
    let remedy = if is_all_empty {
        "add footage; `orator report` shows what was rejected".to_owned()
    } else if info.models.is_empty() {
        "import it again with other shares (`--validation`, `--test`) or more data".to_owned()
    } else {
        let longest = info.videos.iter().filter(|video| video.samples > 0).max_by(|a, b| a.secs.total_cmp(&b.secs));
        let named = longest.filter(|_| split == Split::Train);
        let named =
            named.map_or(String::new(), |video| format!(", or set `{name} = [{:?}]` under [[speaker]]", video.file));
        format!("{}{named}; then run `orator run` again", info.empty_split_fix())
    };
    format!("the {name} split is empty ({}); {remedy}", others.join(", "))
}
