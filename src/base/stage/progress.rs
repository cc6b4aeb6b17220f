//! How long work reports itself. The library only speaks to these traits; the bars are drawn in `cli`.

/// Steps of a task that counts shares of a whole: a hundredth of a percent is 100.
pub const PARTS: u64 = 1_000_000;

/// Something that can show work going on.
pub trait Progress: Send + Sync {
    /// A piece of work of `total` steps begins (0: length unknown; `PARTS`: shares of a whole). It ends when the task is
    /// dropped.
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task + '_>;
    /// A line the user should see while work goes on (a warning, a milestone).
    fn say(&self, line: &str);
    /// Whether the user has asked for an end: work that can end early, at a place from which it goes on, ends there.
    fn is_to_stop(&self) -> bool {
        false
    }
    /// Something happened to a unit; says its message unless overridden.
    fn event(&self, event: &Event<'_>) {
        if let Some(message) = event.message() {
            self.say(&message);
        }
    }
}

/// Something that happened to a `unit` at a `stage` of a run. Units are `speaker/video`, or `speaker` of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// A stage worked on the unit; `line` is the stage's report.
    Done { stage: &'a str, unit: &'a str, line: &'a str },
    /// A stage skipped the unit.
    Fresh { stage: &'a str, unit: &'a str },
    /// The unit failed at a stage.
    Failed { stage: &'a str, unit: &'a str, error: &'a str },
    /// An entry of the configuration leads to no video.
    NoVideo { speaker: &'a str, error: &'a str },
    /// The dataset is made without this video, which is not fresh at every stage before.
    LeftOut { unit: &'a str },
    /// How long the whole may take; said of the first unit alone.
    Estimate { line: &'a str },
    /// What a run does without, and what would change that; said once.
    Advice { line: &'a str },
}

impl Event<'_> {
    /// A line for people; none where there is nothing to say.
    pub fn message(&self) -> Option<String> {
        match self {
            Self::Fresh { .. } | Self::Done { line: "", .. } => None,
            Self::Done { stage, unit, line } => Some(format!("done    {stage} {unit}: {line}")),
            Self::Failed { stage, unit, error } => Some(format!("failed  {stage} {unit}: {error}")),
            Self::NoVideo { speaker, error } => Some(format!("failed  {speaker}: {error}")),
            Self::Estimate { line } => Some((*line).to_owned()),
            Self::Advice { line } => Some(format!("note    {line}")),
            Self::LeftOut { unit } => Some(format!("left out of the dataset: {unit} (`orator status --why` says why)")),
        }
    }
}

/// One piece of work under way.
pub trait Task: Send + Sync {
    /// `steps` more steps are done.
    fn advance(&self, steps: u64);
    /// `steps` more steps needed no work: they say nothing of the time that is left.
    fn skip(&self, steps: u64) {
        self.advance(steps);
    }
    /// A short text beside the bar (a loss, the unit at hand).
    fn detail(&self, text: &str);
    /// How far the task is, for those who see no bar.
    fn milestone(&self, _line: &str) {}
}

/// Shows nothing.
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
