//! The benchmark, in a process like the program's.

#![allow(dead_code)] // what the tests use of the benchmark and of its fixtures

#[path = "mod.rs"]
pub(crate) mod bench;

fn main() -> std::process::ExitCode {
    orator::process::prepare();
    bench::command::main()
}
