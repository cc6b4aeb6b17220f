//! The benchmark, in a process like the program's.

#[path = "mod.rs"]
pub mod bench;
#[path = "../../src/process.rs"]
pub mod process;

fn main() -> std::process::ExitCode {
    process::prepare();
    bench::command::main()
}
