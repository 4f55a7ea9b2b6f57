//! The binary `manifactor`: the library's `main`, with the plugins that the facade links.

/// Graphs are many small pieces: reading and compiling them takes two thirds of the time that it takes with the system's.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    manifactor_cli::main()
}
