use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::{
    Cli,
    output::{self, Output},
};

/// Print completions for a shell
#[derive(Args, Debug)]
pub(crate) struct Completions {
    /// Which shell
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(&self, _: &Output) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "bhm", &mut script);
        output::print(&String::from_utf8_lossy(&script))
    }
}
