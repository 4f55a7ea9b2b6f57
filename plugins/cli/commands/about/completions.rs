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
    /// Print the help of all commands as one page of Markdown (docs/reference/command-line.md).
    #[arg(long, conflicts_with = "command")]
    markdown: bool,
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
        if self.markdown {
            output::print(&markdown(program));
            return Ok(Status::Done);
        }
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

/// Returns the help of a program and of all its commands as one page.
fn markdown(program: Command) -> String {
    let mut page = String::from(
        "# Command line\n\nThe help of every command. `manifactor man --markdown` writes this page.\n",
    );
    add_help(&mut page, "manifactor", program);
    page
}

/// Appends the help of a command, then that of its subcommands. `name` is the full name, such as `manifactor new plugin`.
fn add_help(page: &mut String, name: &str, command: Command) {
    // the width of the terminal must not change the page
    let mut fixed = command.term_width(80);
    let help = fixed.render_long_help().to_string();
    let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
    *page += &format!("\n## {name}\n\n```text\n{}\n```\n", lines.join("\n").trim_end());
    for inner in fixed.get_subcommands().filter(|c| c.get_name() != "help") {
        add_help(page, &format!("{name} {}", inner.get_name()), inner.clone());
    }
}
