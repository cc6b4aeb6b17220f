//! What a run of the pipeline does: which stages, of which speakers, how many videos side by side.

use orator_base::stage::artifacts::StageName;

/// The part of the pipeline to run; by default every stage for every speaker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// First stage.
    pub from: StageName,
    /// Last stage.
    pub to: StageName,
    /// Names of speakers; empty: all.
    pub speakers: Vec<String>,
    /// Videos worked on side by side, 0: one a processor core; none: `work.jobs` of the configuration.
    pub jobs: Option<usize>,
    /// Whether fresh units are worked on again.
    pub force: bool,
}

impl Default for Selection {
    fn default() -> Self {
        let [from, .., to] = StageName::ALL;
        Self { from, to, speakers: Vec::new(), jobs: None, force: false }
    }
}

impl Selection {
    /// One stage alone, for every speaker.
    pub fn only(stage: StageName) -> Self {
        Self { from: stage, to: stage, ..Self::default() }
    }

    /// Whether the stage is one of those to run.
    pub fn has(&self, stage: StageName) -> bool {
        (self.from..=self.to).contains(&stage)
    }
}
