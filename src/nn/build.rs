//! Compiles the kernels of the networks for a GPU, with the feature `cuda` only: `nvcc` is that of the environment variable
//! `NVCC`, of the folder `CUDA_HOME`, or of the search path.

use std::env::var;
use std::io::Write;
use std::process::Command;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut instructions = String::from("cargo:rerun-if-changed=gpu\n");
    for variable in ["NVCC", "CUDA_HOME", "CUDA_COMPUTE_CAP"] {
        instructions += &format!("cargo:rerun-if-env-changed={variable}\n");
    }
    std::io::stdout().write_all(instructions.as_bytes())?;
    if var("CARGO_FEATURE_CUDA").is_err() {
        return Ok(());
    }
    let nvcc = var("NVCC").or_else(|_| var("CUDA_HOME").map(|home| format!("{home}/bin/nvcc")));
    let nvcc = nvcc.unwrap_or_else(|_| "nvcc".to_owned());
    // The driver compiles PTX for its GPU, which may be newer.
    let architecture = format!("-arch=compute_{}", var("CUDA_COMPUTE_CAP").unwrap_or_else(|_| "80".to_owned()));
    let output = format!("{}/kernels.ptx", var("OUT_DIR")?);
    let arguments = ["-ptx", "-O3", "--std=c++17", &architecture, "-o", &output, "gpu/training.cu"];
    match Command::new(&nvcc).args(arguments).status() {
        Ok(status) if status.success() => Ok(()),
        result => {
            Err(format!("{nvcc} {}: {result:?}; set CUDA_HOME to the folder of CUDA", arguments.join(" ")).into())
        }
    }
}
