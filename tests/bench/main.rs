//! Entry point of the benchmark, with the process settings of the program.

#![allow(dead_code)] // items of the benchmark and its fixtures that only tests use

#[path = "mod.rs"]
pub(crate) mod bench;

fn main() -> std::process::ExitCode {
    orator::process::prepare();
    bench::command::main()
}
