//! What the jobs of every scheduler have in common: the commands of a worker and of the end, as a POSIX shell reads them.

use super::plan::ClusterPlan;
use orator_base::stage::artifacts::{StageName, speaker_dir};
use std::path::{Path, PathBuf};

/// What one task may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaskLimits {
    /// Processor cores.
    pub cores: usize,
    /// Memory, GiB.
    pub memory_gib: f64,
    /// Longest time, hours.
    pub hours: f64,
}

impl TaskLimits {
    /// The memory in MiB, rounded up.
    pub fn memory_mib(&self) -> u64 {
        (self.memory_gib * 1024.0).ceil() as u64
    }
}

/// What jobs are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRequest {
    /// The program on the machines of the cluster.
    pub program: PathBuf,
    /// The plan there.
    pub plan: PathBuf,
    /// Number of workers, each a task of its own.
    pub n_tasks: usize,
    /// Most tasks at a time.
    pub n_at_once: usize,
    /// What a worker may use.
    pub worker_limits: TaskLimits,
}

impl JobRequest {
    /// Arguments of a task's worker: it leaves what is in the hands of others.
    pub fn worker(&self) -> Vec<String> {
        let mut words = self.last_worker();
        words.push("--no-wait".to_owned());
        words
    }

    /// Arguments of the last worker, which waits for all others and takes over what the dead have left.
    pub fn last_worker(&self) -> Vec<String> {
        let [program, plan] = [&self.program, &self.plan].map(|path| path.display().to_string());
        [program.as_str(), "work", "--plan", plan.as_str(), "--jobs", &self.worker_limits.cores.to_string()]
            .map(str::to_owned)
            .to_vec()
    }

    /// The command lines that verify the datasets of a work folder.
    pub fn verify(&self, plan: &ClusterPlan, work: &Path) -> Vec<Vec<String>> {
        let dataset = |speaker| speaker_dir(work, StageName::Dataset, speaker);
        let words = |speaker| {
            let dir = dataset(speaker).display().to_string();
            vec![self.program.display().to_string(), "dataset".into(), "verify".into(), dir]
        };
        plan.speakers().into_iter().map(words).collect()
    }
}

/// The words as a shell reads them, quoted where they must be.
pub fn shell(words: &[String]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let quoted = |word: &String| match !word.is_empty() && word.chars().all(is_plain) {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_for_a_shell() {
        let words = ["--set", "gan.steps=5", "my data", "it's", ""].map(str::to_owned);
        assert_eq!(shell(&words), r"--set gan.steps=5 'my data' 'it'\''s' ''");
    }
}
