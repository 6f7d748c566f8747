//! One file per subcommand: its options, and `run`. A new one is its file, its `mod` line, and its line in the list.

/// An enumeration of subcommands, each of which runs itself.
macro_rules! subcommands {
    ($visibility:vis enum $name:ident { $($command:ident($options:ty)),* $(,)? }) => {
        /// What can be done.
        #[derive(Debug, clap::Subcommand)]
        $visibility enum $name {
            $($command($options)),*
        }

        impl $name {
            /// Does it.
            $visibility fn run(&self, output: &crate::output::Output) -> anyhow::Result<()> {
                match self { $(Self::$command(command) => command.run(output)),* }
            }
        }
    };
}

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

subcommands! {
    pub(crate) enum Command {
        Demo(demo::Demo),
        Replay(replay::Replay),
        Onboard(onboard::Onboard),
        Bridge(bridge::Bridge),
        Budget(budget::Budget),
        Simulate(simulate::Simulate),
        Play(play::Play),
        Watch(watch::Watch),
        Build(build::Build),
        Query(query::Query),
        Render(render::Render),
        Info(info::Info),
        Evaluate(evaluate::Evaluate),
        Compare(compare::Compare),
        Export(export::Export),
        Score(score::Score),
        Reproduce(reproduce::Reproduce),
        Learn(learn::Learn),
        Tune(tune::Tune),
        Experiment(experiment::Experiment),
        Completions(completions::Completions),
    }
}
