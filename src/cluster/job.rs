//! Parts of the jobs of all schedulers: command lines of the workers and of the final job, quoted for a POSIX shell.

use super::plan::ClusterPlan;
use orator_base::stage::artifacts::{StageName, speaker_dir};
use std::path::{Path, PathBuf};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaskLimits {
    pub cores: usize,
    pub memory_gib: f64,
    /// Time limit, hours.
    pub hours: f64,
}

impl TaskLimits {
    /// The memory limit, MiB, rounded up.
    pub fn memory_mib(&self) -> u64 {
        (self.memory_gib * 1024.0).ceil() as u64
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct JobRequest {
    /// Path of the program on the machines of the cluster.
    pub program: PathBuf,
    /// Path of the plan on the machines of the cluster.
    pub plan: PathBuf,
    /// Number of workers; each is a separate task.
    pub n_tasks: usize,
    /// Maximum number of tasks that run at the same time.
    pub n_at_once: usize,
    pub worker_limits: TaskLimits,
}

impl JobRequest {
    /// Command line of a task's worker, which skips units claimed by other workers.
    pub fn worker(&self) -> Vec<String> {
        let mut words = self.last_worker();
        words.push("--no-wait".to_owned());
        words
    }

    /// Command line of the last worker, which waits for all others and takes over the units of dead ones.
    pub fn last_worker(&self) -> Vec<String> {
        let [program, plan] = [&self.program, &self.plan].map(|path| path.display().to_string());
        [program.as_str(), "work", "--plan", plan.as_str(), "--jobs", &self.worker_limits.cores.to_string()]
            .map(str::to_owned)
            .to_vec()
    }

    /// Command lines that verify the datasets in a work folder, one per speaker.
    pub fn verify(&self, plan: &ClusterPlan, work: &Path) -> Vec<Vec<String>> {
        let dataset = |speaker| speaker_dir(work, StageName::Dataset, speaker);
        let words = |speaker| {
            let dir = dataset(speaker).display().to_string();
            vec![self.program.display().to_string(), "dataset".into(), "verify".into(), dir]
        };
        plan.speakers().into_iter().map(words).collect()
    }
}

/// Joins the words to a shell command, quoting where necessary.
pub fn shell(words: &[String]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let quoted = |word: &String| match !word.is_empty() && word.chars().all(is_plain) {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}
