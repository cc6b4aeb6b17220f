//! A training folder read in Python: metrics of the log by the `tensorboard` package, tensors of a checkpoint by
//! `safetensors`. Both come from PyPI (`make readers`).

use candle_core::{Device, Tensor};
use orator_gesture::train::log;
use orator_gesture::train::log::MetricsLog;
use orator_nn::weights::Contents;
use orator_test_support::skip::readers;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

fn python(readers: &Path, script: &str, argument: &Path) -> String {
    let output =
        Command::new("python3").args(["-c", script]).arg(argument).env("PYTHONPATH", readers).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

const EVENTS: &str = r"
import json, sys
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
log = EventAccumulator(sys.argv[1], size_guidance={'scalars': 0})
log.Reload()
print(json.dumps([[tag, e.step, e.wall_time, e.value] for tag in log.Tags()['scalars'] for e in log.Scalars(tag)]))
";

#[test]
fn tensorboard_reads_every_metric_of_the_log() {
    let Some(readers) = readers("tensorboard") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut log = MetricsLog::open(folder.path(), 0).unwrap();
    for i in 1..=300_u64 {
        let x = i as f64;
        log.write(&json!({"step": 10 * i, "l1": x.sqrt() / 7.0, "adversarial": -1e-9 * x, "gradient_norm": 1e12 * x}))
            .unwrap();
        let metrics = json!({"pck": 1.0 / x, "frechet": if i == 2 { Value::Null } else { json!(x) }});
        let validation = json!({"split": "validation", "generator": metrics, "mean_pose": {"pck": 0.25}, "score": 2});
        log.write(&json!({"step": 10 * i, "epoch": i, "validation": validation})).unwrap();
    }
    // Resuming at step 1,000 removes the lines of later steps.
    MetricsLog::open(folder.path(), 1000).unwrap().write(&json!({"step": 1010, "l1": 0.5})).unwrap();

    let found: Vec<(String, u64, f64, f32)> = serde_json::from_str(&python(&readers, EVENTS, folder.path())).unwrap();
    let mut found: BTreeMap<(String, u64), (f64, f32)> =
        found.into_iter().map(|(tag, step, time, value)| ((tag, step), (time, value))).collect();
    let mut expect = |tag: &str, step: &Value, value: &Value| {
        let Some(value) = value.as_f64() else { return };
        let step = step.as_u64().unwrap();
        assert_eq!(found.remove(&(tag.to_owned(), step)), Some((step as f64, value as f32)), "{tag} at {step}");
    };
    for line in log::read(folder.path()).unwrap() {
        for name in ["l1", "adversarial", "gradient_norm"] {
            expect(&format!("train/{name}"), &line["step"], &line[name]);
        }
        let validation = &line["validation"];
        for name in ["pck", "frechet"] {
            expect(&format!("validation/{name}"), &line["step"], &validation["generator"][name]);
        }
        expect("validation/mean_pose/pck", &line["step"], &validation["mean_pose"]["pck"]);
        expect("validation/score", &line["step"], &validation["score"]);
    }
    assert!(found.is_empty(), "TensorBoard also reads {:?}", found.keys().next());
}

const TENSORS: &str = r#"
import json, sys
import numpy as np
from safetensors import safe_open
with safe_open(sys.argv[1], 'np') as file:
    facts = json.loads(file.metadata()['orator'])
    for name in sorted(file.keys()):
        tensor = file.get_tensor(name)
        print(name, tensor.dtype, list(tensor.shape), f"{tensor.astype(np.float64).sum():.6f}", facts['step'])
"#;

#[test]
fn safetensors_for_python_reads_a_checkpoint() {
    let Some(readers) = readers("safetensors") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("step-00000007.safetensors");
    let tensor = |shape: &[usize]| {
        let n: usize = shape.iter().product();
        let values: Vec<f32> = (0..n).map(|i| (i * 7919 % 1009) as f32 / 1009.0 - 0.3).collect();
        Tensor::from_vec(values, shape, &Device::Cpu).unwrap()
    };
    let names =
        [("generator.front.0.conv.weight", vec![8, 4, 3]), ("generator.out.bias", vec![144]), ("step", vec![1])];
    let tensors: BTreeMap<String, Tensor> =
        names.iter().map(|(name, shape)| ((*name).to_owned(), tensor(shape))).collect();
    Contents { facts: json!({"step": 7}), tensors: tensors.clone() }.write(&path).unwrap();
    let expected: String = tensors
        .iter()
        .map(|(name, tensor)| {
            let values = tensor.flatten_all().unwrap().to_vec1::<f32>().unwrap();
            let sum: f64 = values.iter().map(|v| f64::from(*v)).sum();
            format!("{name} float32 {:?} {sum:.6} 7\n", tensor.dims())
        })
        .collect();
    assert_eq!(python(&readers, TENSORS, &path), expected);
}
