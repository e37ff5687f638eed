//! `main` of programs for the command line.

use std::{error::Error, io::Write, process::ExitCode};

/// Result of a program.
pub(crate) type Outcome<T> = Result<T, Box<dyn Error>>;

/// Runs a program with its options, or prints its usage if the options are `None`; prints an error with the program's
/// name in front.
pub(crate) fn run_with_options<Options, E: Into<Box<dyn Error>>>(
    name: &str,
    usage: &str,
    options: Result<Option<Options>, E>,
    run: impl FnOnce(&Options) -> Outcome<()>,
) -> ExitCode {
    let outcome = match options {
        Ok(Some(options)) => run(&options),
        // The reader of the help may close the pipe early, as `head` does.
        Ok(None) => writeln!(std::io::stdout(), "{usage}").or(Ok(())),
        Err(error) => Err(error.into()),
    };
    exit_code(name, outcome)
}

/// Prints an error with the program's name in front, and returns the exit code.
pub(crate) fn exit_code(name: &str, outcome: Outcome<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{name}: {error}");
            ExitCode::FAILURE
        }
    }
}
