//! Jobs for Slurm: an array of workers, and a last job after all of them.

use super::job::JobRequest;
use super::plan::ClusterPlan;
use super::shell::shell;
use std::path::Path;

/// Seconds before the end of its time in which a task is told to stop.
const NOTICE_SECS: u64 = 120;

/// The scripts of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct SlurmScripts {
    /// One script an array, none longer than the cluster allows.
    pub arrays: Vec<String>,
    /// The job after all arrays, however they ended: it works on what they left, makes the datasets and verifies them.
    pub last: String,
}

/// Writes the scripts. `max_array` is the cluster's MaxArraySize; `logs` the folder of the outputs; `options` are more
/// lines for `#SBATCH` (a partition, an account).
pub fn scripts(
    job: &JobRequest,
    plan: &ClusterPlan,
    work: &Path,
    logs: &Path,
    max_array: usize,
    options: &[String],
) -> SlurmScripts {
    let head = |name: &str, array: Option<usize>| {
        let output = if array.is_some() { "%A_%a.out" } else { "%j.out" };
        let mut lines = vec![
            "#!/bin/sh".to_owned(),
            format!("#SBATCH --job-name={name}"),
            format!("#SBATCH --output={}", logs.join(output).display()),
            "#SBATCH --open-mode=append".to_owned(),
            "#SBATCH --requeue".to_owned(),
            "#SBATCH --ntasks=1".to_owned(),
            format!("#SBATCH --cpus-per-task={}", job.cores),
            format!("#SBATCH --mem={}M", (job.memory_gib * 1024.0).ceil()),
            format!("#SBATCH --time={}", clock(job.hours)),
            format!("#SBATCH --signal=B:TERM@{NOTICE_SECS}"),
        ];
        lines.extend(array.map(|n| format!("#SBATCH --array=0-{}%{}", n - 1, job.n_at_once.clamp(1, n))));
        lines.extend(options.iter().map(|option| format!("#SBATCH {option}")));
        lines.join("\n")
    };
    let most = max_array.max(1);
    let arrays = (0..job.n_tasks.max(1)).step_by(most).map(|first| {
        let n = most.min(job.n_tasks.max(1) - first);
        format!("{}\n\n{}", head("orator", Some(n)), until_done(&shell(&job.worker())))
    });
    let mut last = format!("{}\n\n{}", head("orator-last", None), until_done(&shell(&job.last_worker())));
    last += &format!("{} || code=$?\n", plan.datasets_command(&job.program.display().to_string()));
    for words in job.verify(plan, work) {
        last += &format!("{} || code=$?\n", shell(&words));
    }
    let mut retry = job.last_worker();
    retry.push("--retry".to_owned());
    last += &format!(
        "[ \"$code\" -ne 2 ] || echo {} {}\nexit \"$code\"\n",
        shell(&["some units failed; when what ails them is mended:".to_owned()]),
        shell(&[shell(&retry)])
    );
    SlurmScripts { arrays: arrays.map(|script| script + "exit \"$code\"\n").collect(), last }
}

/// Runs the worker beside the shell, which hears the signal before the end of the time and passes it on: the worker ends
/// after its unit, or at once when the time is nearly over. A worker that was stopped (code 143) is queued again; failed
/// units (code 2) are the last job's matter.
fn until_done(worker: &str) -> String {
    let patience = NOTICE_SECS.saturating_sub(20);
    format!(
        "{worker} &\n\
         worker=$!\n\
         stop() {{ kill -TERM \"$worker\"; (sleep {patience}; kill -TERM \"$worker\") 2>/dev/null & }}\n\
         trap stop TERM\n\
         code=0\n\
         wait \"$worker\" || code=$?\n\
         # A signal ends the first wait before the worker has ended.\n\
         while kill -0 \"$worker\" 2>/dev/null; do code=0; wait \"$worker\" || code=$?; done\n\
         if [ \"$code\" -eq 143 ]; then\n    \
             scontrol requeue \"${{SLURM_ARRAY_JOB_ID:-$SLURM_JOB_ID}}${{SLURM_ARRAY_TASK_ID:+_$SLURM_ARRAY_TASK_ID}}\"\n    \
             exit 0\n\
         fi\n\
         [ \"$code\" -ne 2 ] || [ -z \"${{SLURM_ARRAY_TASK_ID:-}}\" ] || code=0\n"
    )
}

/// Hours as Slurm reads them, rounded up to minutes.
fn clock(hours: f64) -> String {
    let minutes = (hours * 60.0).ceil().max(1.0) as u64;
    format!("{}:{:02}:00", minutes / 60, minutes % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_array_is_longer_than_the_cluster_allows_and_a_shell_reads_what_is_written() {
        let job = JobRequest {
            program: "/opt/or ator".into(),
            plan: "/w/plan's.json".into(),
            n_tasks: 2500,
            n_at_once: 40,
            cores: 4,
            memory_gib: 3.5,
            hours: 1.01,
        };
        let plan = ClusterPlan {
            version: 1,
            program: String::new(),
            config: "/w/pipeline.toml".into(),
            sets: vec!["extract.fps=15".to_owned()],
            settings: String::new(),
            models: Default::default(),
            units: Vec::new(),
            seal: String::new(),
        };
        let options = ["--partition=long".to_owned()];
        let made = scripts(&job, &plan, Path::new("/w/work"), Path::new("/w/logs"), 1001, &options);
        let array =
            |script: &String| script.lines().find_map(|line| line.strip_prefix("#SBATCH --array=").map(str::to_owned));
        let arrays: Vec<String> = made.arrays.iter().filter_map(array).collect();
        assert_eq!(arrays, ["0-1000%40", "0-1000%40", "0-497%40"]);
        for text in made.arrays.iter().chain([&made.last]) {
            assert!(text.contains("#SBATCH --time=1:01:00\n") && text.contains("#SBATCH --mem=3584M\n"), "{text}");
            assert!(text.contains("#SBATCH --partition=long\n"), "{text}");
            let mut shell = std::process::Command::new("sh");
            let mut shell = shell.arg("-n").stdin(std::process::Stdio::piped()).spawn().unwrap();
            std::io::Write::write_all(&mut shell.stdin.take().unwrap(), text.as_bytes()).unwrap();
            assert!(shell.wait().unwrap().success(), "{text}");
        }
        assert!(
            made.last.contains("'/opt/or ator' run -c /w/pipeline.toml --set extract.fps=15 --only dataset"),
            "{}",
            made.last
        );
    }
}
