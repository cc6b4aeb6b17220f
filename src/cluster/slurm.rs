//! Slurm jobs: an array of workers, a final job after all of them, and training jobs after that.

use super::job::{JobRequest, TaskLimits, shell};
use super::plan::ClusterPlan;
use std::fmt::Write as _;
use std::path::Path;

/// Seconds before its time limit at which a task receives SIGTERM.
const NOTICE_SECS: u64 = 120;

#[derive(Clone, Debug, PartialEq)]
pub struct SlurmScripts {
    /// Arrays of workers, each within the cluster's size limit.
    pub arrays: Vec<String>,
    /// The job after all arrays, whatever their result: it processes remaining units, builds and verifies the datasets.
    pub last: String,
    /// Arrays after the last job, one training per speaker; empty if no training is requested.
    pub trainings: Vec<String>,
}

pub struct SlurmSettings<'a> {
    /// The cluster's MaxArraySize.
    pub max_array: usize,
    pub logs: &'a Path,
    /// Additional `#SBATCH` options (such as a partition or an account).
    pub options: &'a [String],
}

impl SlurmSettings<'_> {
    /// The header of a script; for an array, `array` is the number of tasks and how many run at the same time.
    fn head(&self, name: &str, limits: TaskLimits, array: Option<[usize; 2]>) -> String {
        let output = if array.is_some() { "%A_%a.out" } else { "%j.out" };
        let mut lines = vec![
            "#!/bin/sh".to_owned(),
            format!("#SBATCH --job-name={name}"),
            format!("#SBATCH --output={}", self.logs.join(output).display()),
            "#SBATCH --open-mode=append".to_owned(),
            "#SBATCH --requeue".to_owned(),
            "#SBATCH --ntasks=1".to_owned(),
            format!("#SBATCH --cpus-per-task={}", limits.cores),
            format!("#SBATCH --mem={}M", limits.memory_mib()),
            format!("#SBATCH --time={}", clock(limits.hours)),
            format!("#SBATCH --signal=B:TERM@{NOTICE_SECS}"),
        ];
        lines.extend(array.map(|[n, at_once]| format!("#SBATCH --array=0-{}%{}", n - 1, at_once.clamp(1, n))));
        lines.extend(self.options.iter().map(|option| format!("#SBATCH {option}")));
        lines.join("\n") + "\n\n"
    }
}

/// Writes the scripts; `training` holds the resource limits of a training, `None` if no training is requested.
pub fn scripts(
    job: &JobRequest,
    plan: &ClusterPlan,
    work: &Path,
    settings: &SlurmSettings,
    training: Option<TaskLimits>,
) -> SlurmScripts {
    let (max_array, program) = (settings.max_array.max(1), job.program.display().to_string());
    // Exit code 2 (failed units) is ignored here: the last job reports it.
    let worker = run_and_requeue(&shell(&job.worker())) + "[ \"$code\" -ne 2 ] || code=0\nexit \"$code\"\n";
    let arrays = (0..job.n_tasks.max(1)).step_by(max_array).map(|first| {
        let n = max_array.min(job.n_tasks.max(1) - first);
        settings.head("orator", job.worker_limits, Some([n, job.n_at_once])) + &worker
    });
    let mut last = settings.head("orator-last", job.worker_limits, None) + &run_and_requeue(&shell(&job.last_worker()));
    let _ = writeln!(last, "{} || code=$?", plan.datasets_command(&program));
    for words in job.verify(plan, work) {
        let _ = writeln!(last, "{} || code=$?", shell(&words));
    }
    let mut retry = job.last_worker();
    retry.push("--retry".to_owned());
    let _ = writeln!(
        last,
        "[ \"$code\" -ne 2 ] || echo {} {}\nexit \"$code\"",
        shell(&["some units failed; after fixing the cause, run:".to_owned()]),
        shell(&[shell(&retry)])
    );
    let training_array = |speakers: &[&str], limits: TaskLimits| {
        let names: Vec<String> = speakers.iter().map(|&name| name.to_owned()).collect();
        let training = run_and_requeue(&format!("{} \"$1\"", plan.training_command(&program)));
        settings.head("orator-train", limits, Some([names.len(), names.len()]))
            + &format!("set -- {}\nshift \"$SLURM_ARRAY_TASK_ID\"\n{training}exit \"$code\"\n", shell(&names))
    };
    let speakers = plan.speakers();
    let trainings = training.into_iter().flat_map(|limits| speakers.chunks(max_array).map(move |some| (some, limits)));
    SlurmScripts {
        arrays: arrays.collect(),
        last,
        trainings: trainings.map(|(some, limits)| training_array(some, limits)).collect(),
    }
}

/// Runs a worker or a training in the background of the shell, which receives SIGTERM before the time limit and
/// forwards it: the program stops after its unit or with a checkpoint. Shortly before the limit a second SIGTERM makes
/// it stop at once. A program that was stopped (exit code 143) is queued again.
fn run_and_requeue(worker: &str) -> String {
    let grace_secs = NOTICE_SECS.saturating_sub(20);
    format!(
        "{worker} &\n\
         worker=$!\n\
         stop() {{ kill -TERM \"$worker\"; (sleep {grace_secs}; kill -TERM \"$worker\") 2>/dev/null & }}\n\
         trap stop TERM\n\
         code=0\n\
         wait \"$worker\" || code=$?\n\
         # A signal ends the first wait before the worker has ended.\n\
         while kill -0 \"$worker\" 2>/dev/null; do code=0; wait \"$worker\" || code=$?; done\n\
         if [ \"$code\" -eq 143 ]; then\n    \
             scontrol requeue \"${{SLURM_ARRAY_JOB_ID:-$SLURM_JOB_ID}}${{SLURM_ARRAY_TASK_ID:+_$SLURM_ARRAY_TASK_ID}}\"\n    \
             exit 0\n\
         fi\n"
    )
}

/// Hours in Slurm's time format, rounded up to minutes.
fn clock(hours: f64) -> String {
    let minutes = (hours * 60.0).ceil().max(1.0) as u64;
    format!("{}:{:02}:00", minutes / 60, minutes % 60)
}
