//! What a first pass over a log learns for the maps that follow.

mod supports;

use clap::Args;

use crate::output::Output;

/// Learn something from a log that other commands then map with
#[derive(Args, Debug)]
pub(crate) struct Learn {
    #[command(subcommand)]
    what: What,
}

subcommands! { enum What { Supports(supports::Supports) } }

impl Learn {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.what.run(output)
    }
}
