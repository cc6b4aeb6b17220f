//! The `orator-lab` program.

fn main() -> std::process::ExitCode {
    orator::process::prepare();
    orator_lab::cli::main()
}
