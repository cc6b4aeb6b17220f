//! Unit tests of `orator_cluster::slurm`.

use super::plan::example;
use orator_cluster::job::{JobRequest, TaskLimits};
use orator_cluster::plan::ClusterPlan;
use orator_cluster::slurm::{SlurmSettings, scripts};
use std::collections::BTreeMap;
use std::path::Path;

#[test]
fn arrays_respect_the_cluster_limit_and_scripts_parse() {
    let job = JobRequest {
        program: "/opt/or ator".into(),
        plan: "/w/plan's.json".into(),
        n_tasks: 2500,
        n_at_once: 40,
        worker_limits: TaskLimits { cores: 4, memory_gib: 3.5, hours: 1.01 },
    };
    let plan = ClusterPlan {
        version: 1,
        program: String::new(),
        config: "/w/pipeline.toml".into(),
        sets: vec!["extract.fps=15".to_owned()],
        settings: String::new(),
        models: BTreeMap::new(),
        units: ["guest's", "host"].map(|speaker| example(speaker, "talk")).to_vec(),
        seal: String::new(),
    };
    let options = ["--partition=long".to_owned()];
    let settings = SlurmSettings { max_array: 1001, logs: Path::new("/w/logs"), options: &options };
    let training = TaskLimits { cores: 8, ..job.worker_limits };
    let written = scripts(&job, &plan, Path::new("/w/work"), &settings, Some(training));
    let array =
        |script: &String| script.lines().find_map(|line| line.strip_prefix("#SBATCH --array=").map(str::to_owned));
    let arrays: Vec<String> = written.arrays.iter().filter_map(array).collect();
    assert_eq!(arrays, ["0-1000%40", "0-1000%40", "0-497%40"]);
    for text in written.arrays.iter().chain([&written.last]).chain(&written.trainings) {
        assert!(text.contains("#SBATCH --time=1:01:00\n") && text.contains("#SBATCH --mem=3584M\n"), "{text}");
        assert!(text.contains("#SBATCH --partition=long\n"), "{text}");
        let mut shell = std::process::Command::new("sh");
        let mut shell = shell.arg("-n").stdin(std::process::Stdio::piped()).spawn().unwrap();
        std::io::Write::write_all(&mut shell.stdin.take().unwrap(), text.as_bytes()).unwrap();
        assert!(shell.wait().unwrap().success(), "{text}");
    }
    assert!(
        written.last.contains("'/opt/or ator' run -c /w/pipeline.toml --set extract.fps=15 --only dataset"),
        "{}",
        written.last
    );
    assert_eq!(written.trainings.len(), 1);
    let commands = [
        "#SBATCH --array=0-1%2\n",
        "#SBATCH --cpus-per-task=8\n",
        "set -- 'guest'\\''s' host\nshift \"$SLURM_ARRAY_TASK_ID\"\n",
        "'/opt/or ator' train gan -c /w/pipeline.toml --set extract.fps=15 --speaker \"$1\" &\n",
    ];
    commands.iter().for_each(|line| assert!(written.trainings[0].contains(line), "{}", written.trainings[0]));
}
