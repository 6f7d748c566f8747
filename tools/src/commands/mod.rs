//! One file per subcommand: its options, and `run`. A new one is its file, its `mod` line, and its line in the list.

mod bridge;
mod budget;
mod build;
mod compare;
mod completions;
mod demo;
mod evaluate;
mod experiment;
mod export;
mod info;
mod learn;
mod onboard;
mod play;
mod query;
mod render;
mod replay;
mod reproduce;
mod score;
mod simulate;
mod tune;
mod watch;

use crate::output::Output;

macro_rules! commands {
    ($($command:ident in $module:ident),* $(,)?) => {
        /// What can be done.
        #[derive(Debug, clap::Subcommand)]
        pub(crate) enum Command {
            $($command($module::$command)),*
        }

        impl Command {
            /// Does it.
            pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
                match self { $(Self::$command(command) => command.run(output)),* }
            }
        }
    };
}

commands! {
    Demo in demo,
    Replay in replay,
    Onboard in onboard,
    Bridge in bridge,
    Budget in budget,
    Simulate in simulate,
    Play in play,
    Watch in watch,
    Build in build,
    Query in query,
    Render in render,
    Info in info,
    Evaluate in evaluate,
    Compare in compare,
    Export in export,
    Score in score,
    Reproduce in reproduce,
    Learn in learn,
    Tune in tune,
    Experiment in experiment,
    Completions in completions,
}
