//! Progress reports of long work. The library uses only these traits; `cli` draws the bars.

/// Number of steps of a task that reports fractions of its total: 100 steps are 0.01 %.
pub const PARTS: u64 = 1_000_000;

pub trait Progress: Send + Sync {
    /// Begins a task of `total` steps (0: unknown; `PARTS`: the task reports fractions). Dropping the task ends it.
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task + '_>;
    /// Shows a line during the work (a warning, a milestone).
    fn say(&self, line: &str);
    /// Returns whether the user has requested a stop; work that can resume later then ends at the next resumable point.
    fn is_to_stop(&self) -> bool {
        false
    }
    /// Reports an event of a unit; the default implementation prints its message.
    fn event(&self, event: &Event<'_>) {
        if let Some(message) = event.message() {
            self.say(&message);
        }
    }
}

/// Events of a `unit` at a `stage` of a run. A unit is `speaker/video`, or `speaker` for a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// A stage finished the unit; `line` is the stage's report.
    Done { stage: &'a str, unit: &'a str, line: &'a str },
    /// A stage skipped the unit, whose results are up to date.
    UpToDate { stage: &'a str, unit: &'a str },
    /// The unit failed at a stage.
    Failed { stage: &'a str, unit: &'a str, error: &'a str },
    /// An entry of the configuration matches no video.
    NoVideo { speaker: &'a str, error: &'a str },
    /// The dataset is built without this video, which is not up to date at every earlier stage.
    LeftOut { unit: &'a str },
    /// Estimated duration of the run; reported once, for the first unit.
    Estimate { line: &'a str },
    /// Something that the run lacks and how to provide it; reported once.
    Advice { line: &'a str },
}

impl Event<'_> {
    /// Formats a line for the user; `None` for events that are not printed.
    pub fn message(&self) -> Option<String> {
        match self {
            Self::UpToDate { .. } | Self::Done { line: "", .. } => None,
            Self::Done { stage, unit, line } => Some(format!("done    {stage} {unit}: {line}")),
            Self::Failed { stage, unit, error } => Some(format!("failed  {stage} {unit}: {error}")),
            Self::NoVideo { speaker, error } => Some(format!("failed  {speaker}: {error}")),
            Self::Estimate { line } => Some((*line).to_owned()),
            Self::Advice { line } => Some(format!("note    {line}")),
            Self::LeftOut { unit } => Some(format!("excluded from the dataset: {unit} (see `orator status --why`)")),
        }
    }
}

pub trait Task: Send + Sync {
    /// Counts `steps` more steps as done.
    fn advance(&self, steps: u64);
    /// Counts `steps` more steps that needed no work; they are ignored in the estimate of the remaining time.
    fn skip(&self, steps: u64) {
        self.advance(steps);
    }
    /// Sets a short text beside the bar (a loss, the current unit).
    fn detail(&self, text: &str);
    /// Reports progress as a line, for output without a bar.
    fn milestone(&self, _line: &str) {}
}

/// Progress receiver that shows nothing.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _label: &str, _total: u64) -> Box<dyn Task + '_> {
        Box::new(Silent)
    }
    fn say(&self, _line: &str) {}
}

impl Task for Silent {
    fn advance(&self, _steps: u64) {}
    fn detail(&self, _text: &str) {}
}
