//! The `orator` program.

fn main() -> std::process::ExitCode {
    orator::process::prepare();
    orator::cli::main()
}
