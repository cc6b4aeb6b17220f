//! The `orator` program: parse, run the verb, print the error, set the exit code.

#![cfg_attr(not(test), deny(clippy::print_stderr))]

mod cli;
mod process;

fn main() -> std::process::ExitCode {
    process::prepare();
    cli::main()
}
