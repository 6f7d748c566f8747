//! `bhm`: maps from lidar scans, at the command line.
//!
//! Results go to standard output (with `--json` as one JSON object; from processes that run on, one object a line),
//! everything else to standard error. Exit codes: 0, 1 if the command failed, 2 if it was not understood: flags,
//! environment, configuration file.
#![forbid(unsafe_code)]

mod commands;
mod logging;
mod options;
mod output;
mod processes;
mod progress;
mod reports;

use std::process::ExitCode;

use clap::Parser;

use self::{commands::Command, logging::Verbosity, output::Output};

/// Bayesian Hilbert maps: continuous occupancy maps from lidar scans.
#[derive(Debug, Parser)]
#[command(name = "bhm", version, propagate_version = true, max_term_width = 120)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print the result as one JSON object, or one a line.
    #[arg(long, global = true)]
    json: bool,
    #[command(flatten)]
    verbosity: Verbosity,
}

fn main() -> ExitCode {
    // Ends the process with code 2 and the usage if the command line is not understood, with 0 after --help.
    let cli = Cli::parse();
    logging::start(cli.verbosity);
    match cli.command.run(&Output { json: cli.json }) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if output::is_usage(&error) { 2 } else { 1 })
        }
    }
}
