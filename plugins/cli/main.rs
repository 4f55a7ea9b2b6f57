//! The binary `manifactor`: the library's `main`, with the plugins that the facade links.

fn main() -> std::process::ExitCode {
    manifactor_cli::main()
}
