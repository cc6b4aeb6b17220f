//! Jobs for schedulers, written but not submitted.

use k8s_openapi::api::batch::v1::Job;
use k8s_openapi::api::core::v1::PersistentVolumeClaim;
use orator_test_support::project::Project;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Round trip of a manifest through its Kubernetes type.
fn round_trip<T: DeserializeOwned + Serialize>(manifest: &serde_json::Value) -> serde_json::Value {
    serde_json::to_value(serde_json::from_value::<T>(manifest.clone()).unwrap()).unwrap()
}

#[test]
fn jobs_are_written_for_slurm_kubernetes_and_ssh() {
    let project = Project::with_clips("jobs", 2, 1.0);
    assert_eq!(project.answer(&["plan"]).code, 0);
    let job = ["--plan", "work/plan.json", "--tasks", "2", "--hours", "1.5", "--dry-run"];
    let slurm = project.answer(&[&["submit", "slurm", "--train", "--train-hours", "2"], &job[..]].concat());
    assert_eq!(slurm.code, 0, "{}", slurm.errors);
    let scripts: Vec<&str> =
        slurm.json["scripts"].as_array().unwrap().iter().filter_map(|file| file.as_str()).collect();
    let array = std::fs::read_to_string(scripts[0]).unwrap();
    assert!(array.contains("#SBATCH --array=0-1%2\n") && array.contains("#SBATCH --time=1:30:00\n"), "{array}");
    let last = std::fs::read_to_string(scripts[1]).unwrap();
    assert!(last.contains("dataset verify") && !last.contains("--array"), "{last}");
    let training = std::fs::read_to_string(scripts[2]).unwrap();
    assert!(training.contains(" train gan -c ") && training.contains("#SBATCH --time=2:00:00\n"), "{training}");

    let volume = ["--image", "registry/orator:1", "--claim", "project", "--claim-size", "100", "--mount", "/project"];
    let kubernetes = project.answer(&[&["submit", "kubernetes"], &job[..], &volume].concat());
    assert_eq!(kubernetes.code, 0, "{}", kubernetes.errors);
    let file = kubernetes.json["manifests"].as_str().unwrap();
    let list: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let kinds: Vec<&str> = list["items"].as_array().unwrap().iter().filter_map(|item| item["kind"].as_str()).collect();
    assert_eq!(kinds, ["PersistentVolumeClaim", "Job", "Job"]);
    // Every field is known to Kubernetes: none is dropped in the round trip through its types.
    let items = list["items"].as_array().unwrap();
    let typed =
        [round_trip::<PersistentVolumeClaim>(&items[0]), round_trip::<Job>(&items[1]), round_trip::<Job>(&items[2])];
    assert_eq!(items[..], typed[..]);
    let workers: Job = serde_json::from_value(items[1].clone()).unwrap();
    let spec = workers.spec.unwrap();
    assert_eq!(
        (spec.completion_mode.as_deref(), spec.completions, spec.parallelism),
        (Some("Indexed"), Some(2), Some(2))
    );
    let pod = spec.template.spec.unwrap();
    assert_eq!(
        (pod.restart_policy.as_deref(), pod.containers[0].image.as_deref()),
        (Some("Never"), Some("registry/orator:1"))
    );

    let ssh = project.answer(&["submit", "ssh", "--plan", "work/plan.json", "--dry-run", "a", "b"]);
    let lines = ssh.json["commands"].as_array().unwrap();
    assert!(ssh.code == 0 && lines.len() == 2 && lines[1].as_str().unwrap().starts_with("ssh b "), "{}", ssh.errors);
    let no_effect = project.answer(&["submit", "ssh", "--plan", "work/plan.json", "--hours", "2", "--dry-run", "a"]);
    assert!(no_effect.code == 1 && no_effect.errors.contains("--hours"), "{}", no_effect.errors);
}
