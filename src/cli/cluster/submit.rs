//! `orator submit`.

use super::plan::open;
use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator_base::foreign_program::{command_in, empty_folder};
use orator_base::stage::workdir;
use orator_base::text::counted;
use orator_cluster::job::{JobRequest, TaskLimits, shell};
use orator_cluster::kubernetes::{KubernetesTarget, manifests};
use orator_cluster::plan::ClusterPlan;
use orator_cluster::slurm::{self, SlurmSettings};
use serde_json::json;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf, absolute};
use std::process::{Command, Stdio};

/// Submit workers to Slurm, Kubernetes or SSH hosts.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    target: SubmitTarget,
}

#[derive(clap::Subcommand)]
enum SubmitTarget {
    Slurm(SlurmArgs),
    Kubernetes(KubernetesArgs),
    Ssh(SshArgs),
}

/// Default time limit of a worker, hours.
const DEFAULT_HOURS: f64 = 12.0;

/// Options of every kind of worker.
#[derive(clap::Args)]
struct WorkerArgs {
    /// Plan written by `orator plan`.
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
    /// CPU cores per worker; each core processes one video.
    #[arg(long, value_name = "N", default_value_t = 1)]
    cores: usize,
    /// Path of the program on the machines of the cluster; defaults to the path of this program.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Write and print the jobs, but do not submit them.
    #[arg(long)]
    dry_run: bool,
}

/// Options of the jobs of a scheduler.
#[derive(clap::Args)]
struct JobArgs {
    #[command(flatten)]
    worker: WorkerArgs,
    /// Number of workers.
    #[arg(long, value_name = "N", default_value_t = 16)]
    tasks: usize,
    /// Maximum number of workers that run at the same time; defaults to all.
    #[arg(long, value_name = "N")]
    at_once: Option<usize>,
    /// Memory per worker, GiB; defaults to 1.5 per core.
    #[arg(long, value_name = "GIB")]
    memory: Option<f64>,
    /// Time limit of a worker, hours; defaults to 12.
    #[arg(long, value_name = "HOURS")]
    hours: Option<f64>,
}

/// Submit a Slurm job array of workers.
///
/// A second job builds and verifies the datasets after the workers. With --train, further jobs then train a model of
/// each speaker.
#[derive(clap::Args)]
struct SlurmArgs {
    #[command(flatten)]
    job: JobArgs,
    /// Train a model of each speaker after the datasets are built: `orator train gan`, requeued until it is complete.
    #[arg(long)]
    train: bool,
    /// CPU cores of a training job.
    #[arg(long, value_name = "N", default_value_t = 4, requires = "train")]
    train_cores: usize,
    /// Memory of a training job, GiB.
    #[arg(long, value_name = "GIB", default_value_t = 4.0, requires = "train")]
    train_memory: f64,
    /// Time after which a training job writes a checkpoint and is requeued, hours.
    #[arg(long, value_name = "HOURS", default_value_t = 12.0, requires = "train")]
    train_hours: f64,
    /// Maximum size of a job array; defaults to what `scontrol show config` reports.
    #[arg(long, value_name = "N")]
    max_array: Option<usize>,
    /// Additional `#SBATCH` option, such as --partition=long; may be repeated.
    #[arg(long = "sbatch", value_name = "OPTION", allow_hyphen_values = true)]
    options: Vec<String>,
}

/// Submit a Kubernetes Indexed Job of workers.
///
/// A second Job builds and verifies the datasets.
#[derive(clap::Args)]
struct KubernetesArgs {
    #[command(flatten)]
    job: JobArgs,
    /// Container image that contains the program.
    #[arg(long, value_name = "IMAGE")]
    image: String,
    /// Namespace of the jobs.
    #[arg(long, value_name = "NAME", default_value = "default")]
    namespace: String,
    /// PersistentVolumeClaim of the volume that contains the project; all nodes must be able to write to it.
    #[arg(long, value_name = "NAME")]
    claim: String,
    /// Also create the claim, with this size, GiB.
    #[arg(long, value_name = "GIB")]
    claim_size: Option<u64>,
    /// Mount point of the volume: a folder that contains the plan, the videos and the work folder.
    #[arg(long, value_name = "DIR")]
    mount: String,
}

/// Start a worker on each host over SSH.
///
/// The command waits until all workers have ended. One worker without a time limit is started on each host.
#[derive(clap::Args)]
struct SshArgs {
    #[command(flatten)]
    worker: WorkerArgs,
    /// Host names, as passed to ssh.
    #[arg(required = true, value_name = "HOST")]
    hosts: Vec<String>,
}

pub(crate) fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.target {
        SubmitTarget::Slurm(args) => to_slurm(&args, ui),
        SubmitTarget::Kubernetes(args) => to_kubernetes(&args, ui),
        SubmitTarget::Ssh(args) => to_ssh(&args, ui),
    }
}

impl WorkerArgs {
    /// Reads the plan; returns it with its work folder and the request for its jobs. `job` has the options of a
    /// scheduler.
    fn request(&self, job: Option<&JobArgs>) -> Result<(ClusterPlan, PathBuf, JobRequest)> {
        let (plan, pipeline) = open(&self.plan)?;
        let work = pipeline.config().settings.work.dir.clone();
        let tasks = job.map_or(1, |job| job.tasks);
        ensure!(tasks > 0 && self.cores > 0, "--tasks and --cores: expected at least 1");
        let n_at_once = job.and_then(|job| job.at_once).unwrap_or(tasks);
        let hours = job.and_then(|job| job.hours).unwrap_or(DEFAULT_HOURS);
        ensure!(hours > 0.0, "--hours: expected more than 0");
        let program = match &self.program {
            Some(program) => program.clone(),
            None => std::env::current_exe().context("cannot determine the path of this program; give --program")?,
        };
        let request = JobRequest {
            program,
            plan: absolute(&self.plan)?,
            n_tasks: tasks.min(plan.units.len().max(1)),
            n_at_once,
            worker_limits: TaskLimits {
                cores: self.cores,
                memory_gib: job.and_then(|job| job.memory).unwrap_or(1.5 * self.cores as f64),
                hours,
            },
        };
        Ok((plan, work, request))
    }

    fn jobs_folder(&self, plan: &ClusterPlan) -> Result<PathBuf> {
        Ok(absolute(plan.folder(&self.plan))?.join("jobs"))
    }

    fn next(&self) -> String {
        format!("orator status --plan {}", self.plan.display())
    }
}

impl SlurmArgs {
    /// Resource limits of a training; `None` if no training is requested.
    fn training(&self) -> Result<Option<TaskLimits>> {
        let limits = TaskLimits { cores: self.train_cores, memory_gib: self.train_memory, hours: self.train_hours };
        ensure!(limits.cores > 0 && limits.hours > 0.0, "--train-cores and --train-hours: expected more than 0");
        Ok(self.train.then_some(limits))
    }
}

fn to_slurm(args: &SlurmArgs, ui: &Ui) -> Result<Outcome> {
    let (plan, work, request) = args.job.worker.request(Some(&args.job))?;
    let folder = args.job.worker.jobs_folder(&plan)?;
    let max_array = match args.max_array {
        Some(max) => max,
        None => max_array_size().unwrap_or(1001),
    };
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let settings = SlurmSettings { max_array, logs: &folder, options: &args.options };
    let scripts = slurm::scripts(&request, &plan, &work, &settings, args.training()?);
    let write = |name: String, script: &String| -> Result<PathBuf> {
        let file = folder.join(name);
        workdir::write_file(&file, script.as_bytes())?;
        Ok(file)
    };
    let numbered = |name: &str, scripts: &[String]| -> Result<Vec<PathBuf>> {
        scripts.iter().enumerate().map(|(n, script)| write(format!("{name}-{n}.sh"), script)).collect()
    };
    let arrays = numbered("array", &scripts.arrays)?;
    let last = write("last.sh".to_owned(), &scripts.last)?;
    let trainings = numbered("train", &scripts.trainings)?;
    let mut ids = Vec::new();
    if !args.job.worker.dry_run {
        for file in &arrays {
            ids.push(sbatch(&[], file)?);
        }
        // This includes tasks that were cancelled or killed: the last job processes their units.
        let after = |ids: &[String]| format!("--dependency=afterany:{}", ids.join(":"));
        ids.push(sbatch(&[&after(&ids)], &last)?);
        // Some videos may have failed; a missing or invalid dataset stops its training.
        let datasets = after(&ids[arrays.len()..]);
        for file in &trainings {
            ids.push(sbatch(&[&datasets], file)?);
        }
    }
    let files: Vec<PathBuf> = arrays.into_iter().chain([last]).chain(trainings).collect();
    let text = match args.job.worker.dry_run {
        true => scripts
            .arrays
            .iter()
            .chain([&scripts.last])
            .chain(&scripts.trainings)
            .cloned()
            .collect::<Vec<_>>()
            .join("\n"),
        false => {
            let trainings = if args.train { ", a training job per speaker" } else { "" };
            let workers = counted(request.n_tasks, "worker");
            format!("submitted {workers}, a final job{trainings}: {}", ids.join(", "))
        }
    };
    let next = args.job.worker.next();
    ui.summary(&text, Some(&next), json!({ "scripts": files, "jobs": ids, "next": next }));
    Ok(Outcome::Done)
}

/// The cluster's MaxArraySize; array indices are below it.
fn max_array_size() -> Option<usize> {
    let folder = empty_folder().ok()?;
    let out = command_in(folder.path(), Path::new("scontrol")).ok()?.args(["show", "config"]).output().ok()?;
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    let line = text.lines().find(|line| line.trim_start().starts_with("MaxArraySize"))?;
    line.split('=').nth(1)?.trim().parse().ok()
}

/// The program of that name in the absolute folders of PATH, so that a file of the working directory is never run.
fn installed(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let files = std::env::split_paths(&folders).filter(|folder| folder.is_absolute()).map(|folder| folder.join(name));
    let is_program = |meta: std::fs::Metadata| meta.is_file() && meta.permissions().mode() & 0o111 != 0;
    files.into_iter().find(|file| file.metadata().is_ok_and(is_program))
}

/// Submits a script and returns the id of its job. The working directory is that of the job too, so sbatch inherits it.
fn sbatch(options: &[&str], script: &Path) -> Result<String> {
    let program = installed("sbatch").context("sbatch is not installed; --dry-run writes the scripts only")?;
    let out = Command::new(program).arg("--parsable").args(options).arg(script).output();
    let out = out.context("cannot start sbatch; --dry-run writes the scripts only")?;
    if !out.status.success() {
        bail!("sbatch rejected {}: {}", script.display(), String::from_utf8_lossy(&out.stderr).trim());
    }
    // The output is JOB or JOB;CLUSTER.
    let id = String::from_utf8_lossy(&out.stdout).trim().split(';').next().unwrap_or_default().to_owned();
    Ok(id)
}

fn to_kubernetes(args: &KubernetesArgs, ui: &Ui) -> Result<Outcome> {
    let (plan, work, request) = args.job.worker.request(Some(&args.job))?;
    let target = KubernetesTarget {
        image: args.image.clone(),
        namespace: args.namespace.clone(),
        claim: args.claim.clone(),
        claim_gib: args.claim_size,
        mount: args.mount.clone(),
    };
    let file = args.job.worker.jobs_folder(&plan)?.join("kubernetes.json");
    let manifests = manifests(&request, &plan, &work, &target);
    let text = serde_json::to_string_pretty(&manifests)?;
    workdir::write_file(&file, text.as_bytes())?;
    let next = args.job.worker.next();
    if args.job.worker.dry_run {
        ui.summary(&text, Some(&next), json!({ "manifests": file, "next": next }));
        return Ok(Outcome::Done);
    }
    let folder = empty_folder()?;
    let mut kubectl = command_in(folder.path(), Path::new("kubectl"))?;
    if let Some(files) = std::env::var_os("KUBECONFIG") {
        let files = std::env::split_paths(&files).map(|file| absolute(&file).unwrap_or(file));
        kubectl.env("KUBECONFIG", std::env::join_paths(files)?);
    }
    let status = kubectl.args(["apply", "-f"]).arg(&file).stdout(Stdio::null()).status();
    let status = status.context("cannot start kubectl; --dry-run writes the manifests only")?;
    ensure!(status.success(), "kubectl apply failed for {}", file.display());
    let text = format!("submitted {}: {}", counted(request.n_tasks, "worker"), file.display());
    ui.summary(&text, Some(&next), json!({ "manifests": file, "next": next }));
    Ok(Outcome::Done)
}

fn to_ssh(args: &SshArgs, ui: &Ui) -> Result<Outcome> {
    let (_, _, request) = args.worker.request(None)?;
    let line = shell(&request.last_worker());
    let next = args.worker.next();
    if args.worker.dry_run {
        let lines: Vec<String> =
            args.hosts.iter().map(|host| format!("ssh {host} {}", shell(std::slice::from_ref(&line)))).collect();
        ui.summary(&lines.join("\n"), Some(&next), json!({ "commands": lines, "next": next }));
        return Ok(Outcome::Done);
    }
    let folder = empty_folder()?;
    let start = |host: &String| {
        // Without a terminal, a worker continues if its connection is lost; its result is visible in the folder of the
        // plan.
        let child = command_in(folder.path(), Path::new("ssh"))?
            .args(["-o", "BatchMode=yes", host, &line])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        child.with_context(|| format!("cannot start ssh to {host}"))
    };
    let workers = args.hosts.iter().map(|host| Ok((host, start(host)?))).collect::<Result<Vec<_>>>()?;
    let (n_hosts, mut failed) = (workers.len(), Vec::new());
    for (host, mut worker) in workers {
        let status = worker.wait().with_context(|| format!("cannot wait for ssh to {host}"))?;
        // Exit code 2 means that some units failed, which `status` reports.
        if !matches!(status.code(), Some(0 | 2)) {
            failed.push(format!("{host}: {status}"));
        }
    }
    let mut lines = vec![format!("{} ended, {} failed", counted(n_hosts, "worker"), failed.len())];
    lines.extend(failed.iter().cloned());
    ui.summary(&lines.join("\n"), Some(&next), json!({ "failed": failed, "next": next }));
    Ok(if failed.is_empty() { Outcome::Done } else { Outcome::SomeFailed })
}
