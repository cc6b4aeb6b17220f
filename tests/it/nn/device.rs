//! The choice of a device as text, and opening it.

use orator_base::types::device::DeviceChoice;
use orator_nn::device::open;

#[test]
fn a_choice_is_read_and_written_as_text() {
    for (text, choice) in [
        ("auto", DeviceChoice::Auto),
        ("cpu", DeviceChoice::Cpu),
        ("cuda", DeviceChoice::Cuda(0)),
        ("cuda:3", DeviceChoice::Cuda(3)),
    ] {
        assert_eq!((text.parse(), choice.to_string().as_str()), (Ok(choice), text));
        let stored = serde_json::json!(choice);
        assert_eq!(stored, text);
        assert_eq!(serde_json::from_value::<DeviceChoice>(stored).unwrap(), choice);
    }
    assert_eq!("cuda:0".parse(), Ok(DeviceChoice::Cuda(0)));
    for wrong in ["", "gpu", "CUDA", "cuda:", "cuda:-1", "cuda:1.5", "cpu:0"] {
        let error = wrong.parse::<DeviceChoice>().unwrap_err();
        assert_eq!(error, "expected \"auto\", \"cpu\", \"cuda\" or \"cuda:N\"");
    }
}

#[test]
fn networks_that_run_on_the_cpu_only_are_named() {
    let reason = || Some("this network runs on the CPU only");
    let (device, chosen) = open(DeviceChoice::Auto, reason).unwrap();
    assert!(device.is_cpu());
    assert_eq!(chosen.as_deref(), Some("CPU (this network runs on the CPU only)"));
    let error = open(DeviceChoice::Cuda(1), reason).unwrap_err().to_string();
    assert!(error.starts_with("cannot use the device cuda:1: this network runs on the CPU only; "), "{error}");
    let (device, chosen) = open(DeviceChoice::Cpu, || panic!("not called for the CPU")).unwrap();
    assert!(device.is_cpu() && chosen.is_none());
}

#[cfg(not(feature = "cuda"))]
#[test]
fn without_cuda_there_is_only_the_cpu() {
    let error = open(DeviceChoice::Cuda(0), || None).unwrap_err().to_string();
    assert!(error.contains("cargo build --release --features cuda") && error.contains("--device cpu"), "{error}");
    let (device, chosen) = open(DeviceChoice::Auto, || None).unwrap();
    assert!(device.is_cpu() && chosen.is_some_and(|chosen| chosen.starts_with("CPU (this program has no CUDA")));
}
