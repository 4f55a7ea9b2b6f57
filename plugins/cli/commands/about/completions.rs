//! `manifactor completions` and `manifactor man`: shell completions and manual pages.
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Print a script that completes commands and flags in a shell.
///
/// For bash, source the script in ~/.bashrc, or write it to
/// ~/.local/share/bash-completion/completions/manifactor.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor completions bash > manifactor.bash")]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page of the program or of one command.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor man solve > manifactor-solve.1")]
pub(crate) struct Man {
    /// The command. Default: the program.
    command: Option<String>,
}

impl Completions {
    /// Prints the completions of this command line.
    pub(crate) fn run(&self, mut program: Command) -> Status {
        let mut script = vec![];
        generate(self.shell, &mut program, "manifactor", &mut script);
        output::print_bytes(&script);
        Status::Done
    }
}

impl Man {
    /// Prints the manual page of this command line or of one of its commands.
    pub(crate) fn run(&self, mut program: Command) -> Result<Status, Failure> {
        // global flags reach the subcommands only after `build`
        program.build();
        let command = match &self.command {
            None => program,
            Some(name) => match program.find_subcommand(name) {
                Some(command) => command.clone(),
                None => {
                    return Err(Failure::with_help(
                        format!("unknown command `{name}`"),
                        "`manifactor help` lists the commands",
                    ));
                }
            },
        };
        let mut page = vec![];
        clap_mangen::Man::new(command).render(&mut page).map_err(Failure::input)?;
        output::print_bytes(&page);
        Ok(Status::Done)
    }
}
