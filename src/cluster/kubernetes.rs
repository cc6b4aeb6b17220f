//! Kubernetes manifests: an Indexed Job of workers and a Job that builds the datasets, on the project's volume.

use super::job::{JobRequest, shell};
use super::plan::ClusterPlan;
use serde_json::{Value, json};
use std::path::Path;

#[derive(Clone, Debug, PartialEq)]
pub struct KubernetesTarget {
    /// Container image with the program.
    pub image: String,
    pub namespace: String,
    /// PersistentVolumeClaim of the project, writable from every node, and its size (GiB) if the manifests create it.
    pub claim: String,
    pub claim_gib: Option<u64>,
    /// Mount path of the volume: a folder that contains the plan, the videos and the work folder.
    pub mount: String,
}

/// The manifests, as one List for `kubectl apply -f`. The job of the datasets itself waits until the units have ended.
pub fn manifests(job: &JobRequest, plan: &ClusterPlan, work: &Path, target: &KubernetesTarget) -> Value {
    let name = |suffix: &str| format!("orator-{}{suffix}", &plan.seal[..8.min(plan.seal.len())]);
    let meta =
        |suffix: &str| json!({ "name": name(suffix), "namespace": target.namespace, "labels": { "app": "orator" } });
    let limits = job.worker_limits;
    let resources = json!({
        "requests": { "cpu": limits.cores.to_string(), "memory": format!("{}Mi", limits.memory_mib()) },
        "limits": { "memory": format!("{}Mi", limits.memory_mib()) },
    });
    let pod = |command: Vec<String>| {
        json!({
            "metadata": { "labels": { "app": "orator" } },
            "spec": {
                "restartPolicy": "Never",
                // Gives the unit in progress time to finish when a node is drained.
                "terminationGracePeriodSeconds": 120,
                "containers": [{
                    "name": "orator", "image": target.image, "command": command, "resources": resources,
                    "volumeMounts": [{ "name": "project", "mountPath": target.mount }],
                }],
                "volumes": [{ "name": "project", "persistentVolumeClaim": { "claimName": target.claim } }],
            },
        })
    };
    // Losing a node does not count as a failure of the task; exit code 1 of the program fails the job.
    let lost_node =
        json!({ "action": "Ignore", "onPodConditions": [{ "type": "DisruptionTarget", "status": "True" }] });
    let failed = json!({
        "action": "FailJob", "onExitCodes": { "containerName": "orator", "operator": "In", "values": [1] },
    });
    let failure_rules = json!({ "rules": [lost_node, failed] });
    let seconds = (limits.hours * 3600.0).ceil() as i64;
    let script = |lines: Vec<String>| vec!["/bin/sh".to_owned(), "-c".to_owned(), lines.join("\n")];
    let mut last = vec!["code=0".to_owned(), format!("{} || code=$?", shell(&job.last_worker()))];
    last.push(format!("{} || code=$?", plan.datasets_command(&job.program.display().to_string())));
    last.extend(job.verify(plan, work).iter().map(|words| format!("{} || code=$?", shell(words))));
    last.push("exit $code".to_owned());
    let mut items = Vec::new();
    if let Some(gib) = target.claim_gib {
        items.push(json!({
            "apiVersion": "v1", "kind": "PersistentVolumeClaim",
            "metadata": { "name": target.claim, "namespace": target.namespace },
            "spec": { "accessModes": ["ReadWriteMany"], "resources": { "requests": { "storage": format!("{gib}Gi") } } },
        }));
    }
    items.push(json!({
        "apiVersion": "batch/v1", "kind": "Job", "metadata": meta(""),
        "spec": {
            "completionMode": "Indexed", "completions": job.n_tasks, "parallelism": job.n_at_once.min(job.n_tasks),
            "backoffLimit": 3 * job.n_tasks, "activeDeadlineSeconds": seconds, "podFailurePolicy": failure_rules,
            "template": pod(script(sigterm_forwarding_script(&shell(&job.worker())))),
        },
    }));
    items.push(json!({
        "apiVersion": "batch/v1", "kind": "Job", "metadata": meta("-last"),
        "spec": {
            "backoffLimit": 3, "activeDeadlineSeconds": seconds, "podFailurePolicy": { "rules": [lost_node] },
            "template": pod(script(last)),
        },
    }));
    json!({ "apiVersion": "v1", "kind": "List", "items": items })
}

/// Shell script that runs a worker and forwards SIGTERM to it, which the shell, as the pod's first process, would not
/// do by itself. Failed videos (exit code 2) do not fail the pod.
pub fn sigterm_forwarding_script(worker: &str) -> Vec<String> {
    let lines = [
        &format!("{worker} & worker=$!"),
        "trap 'kill -TERM $worker 2>/dev/null' TERM",
        "wait $worker; code=$?",
        // A signal ends the `wait`, not the worker.
        "while kill -0 $worker 2>/dev/null; do wait $worker; code=$?; done",
        "[ $code -eq 0 ] || [ $code -eq 2 ]",
    ];
    lines.map(str::to_owned).to_vec()
}
