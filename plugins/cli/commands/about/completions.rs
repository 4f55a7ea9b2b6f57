//! `manifactor completions` and `manifactor man`: what shells and readers of manuals want to know of the command line.
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Print a script by which a shell completes commands and flags.
///
/// For bash: manifactor completions bash > ~/.local/share/bash-completion/completions/manifactor
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page of the program or of one of its commands: manifactor man > manifactor.1
#[derive(Debug, Args)]
pub(crate) struct Man {
    /// The command. Default: the program.
    command: Option<String>,
}

impl Completions {
    /// For this command line.
    pub(crate) fn run(&self, mut program: Command) -> Status {
        let mut script = vec![];
        generate(self.shell, &mut program, "manifactor", &mut script);
        output::print_as_is(&script);
        Status::Done
    }
}

impl Man {
    /// Of this command line.
    pub(crate) fn run(&self, mut program: Command) -> Result<Status, Failure> {
        // flags that all commands have are known once it is built
        program.build();
        let command = match &self.command {
            None => program,
            Some(name) => match program.find_subcommand(name) {
                Some(command) => command.clone(),
                None => {
                    return Err(Failure::with_help(
                        format!("there is no command `{name}`"),
                        "`manifactor help` lists them",
                    ));
                }
            },
        };
        let mut page = vec![];
        clap_mangen::Man::new(command).render(&mut page).map_err(Failure::input)?;
        output::print_as_is(&page);
        Ok(Status::Done)
    }
}
