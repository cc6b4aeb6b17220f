//! How long work reports itself. The library only speaks to these traits; the bars are drawn in `cli`.

/// Something that can show work going on.
pub trait Progress: Send + Sync {
    /// A piece of work of `total` steps begins (0: length unknown). It ends when the task is dropped.
    fn begin(&self, label: &str, total: u64) -> Box<dyn Task>;
    /// A line the user should see while work goes on (a warning, a milestone).
    fn say(&self, line: &str);
}

/// One piece of work under way.
pub trait Task: Send + Sync {
    /// `steps` more steps are done.
    fn advance(&self, steps: u64);
    /// A short text beside the bar (a loss, the unit at hand).
    fn detail(&self, text: &str);
}

/// Shows nothing.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _label: &str, _total: u64) -> Box<dyn Task> {
        Box::new(Silent)
    }
    fn say(&self, _line: &str) {}
}

impl Task for Silent {
    fn advance(&self, _steps: u64) {}
    fn detail(&self, _text: &str) {}
}
