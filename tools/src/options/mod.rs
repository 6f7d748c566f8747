//! The options that decide what a map learns, shared by every command that makes one.

mod choice;
mod document;
mod effective;
mod map_option;
mod poses;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_core::profile::{self, Profile};
use clap::{
    Arg, ArgMatches, Args, Command, FromArgMatches,
    builder::{BoolishValueParser, PossibleValuesParser},
    parser::ValueSource,
    value_parser,
};
use toml::{Table, Value};
use tracing::warn;

pub(crate) use self::{
    choice::{fraction, held, number, seconds},
    effective::{Effective, SupportsFile},
    map_option::MapOption,
    poses::PoseDeviations,
};
use self::{
    document::Document,
    effective::Unusable,
    map_option::{Kind, MAP_OPTIONS},
};
use crate::output::{self, Usage};

/// What the firmware is built with.
const FIRMWARE_PROFILE: Profile = profile::COMPACT;

/// Options about all map options together.
#[derive(Args, Clone, Debug, Default)]
struct ConfigOptions {
    /// TOML file of map options, as --print-config writes it, whole or in part; unknown keys are refused
    #[arg(long, env = "BHM_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the map options in effect, as such a file, and exit
    #[arg(long)]
    print_config: bool,
}

/// How a command is told what map to make: flag before environment (`BHM_SPACING` for `--spacing`) before configuration file
/// before profile.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapOptions {
    all: ConfigOptions,
    /// In the order of [`MAP_OPTIONS`].
    given: Vec<(&'static MapOption, Value)>,
}

impl Args for MapOptions {
    fn augment_args(command: Command) -> Command {
        let command = ConfigOptions::augment_args(command.next_help_heading("Map options"));
        command.args(MAP_OPTIONS.iter().map(MapOption::argument))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for MapOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut options = Self::default();
        options.update_from_arg_matches(matches)?;
        Ok(options)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.all = ConfigOptions::from_arg_matches(matches)?;
        let given = MAP_OPTIONS.iter().filter(|option| {
            matches!(matches.value_source(option.flag), Some(ValueSource::CommandLine | ValueSource::EnvVariable))
        });
        self.given = given.filter_map(|option| Some((option, option.value(matches)?))).collect();
        Ok(())
    }
}

impl MapOption {
    fn argument(&self) -> Arg {
        let argument =
            Arg::new(self.flag).long(self.flag).env(self.variable).value_name(self.value_name).help(self.help);
        match self.kind {
            Kind::Number => argument.value_parser(value_parser!(f32)),
            Kind::Count => argument.value_parser(value_parser!(u32)),
            Kind::Choice => argument.value_parser(PossibleValuesParser::new(document::names(self.path))),
            Kind::Switch => argument.value_parser(BoolishValueParser::new()),
            Kind::File => argument.value_parser(value_parser!(String)),
        }
    }

    fn value(&self, matches: &ArgMatches) -> Option<Value> {
        match self.kind {
            Kind::Number => matches.get_one::<f32>(self.flag).map(|number| Value::Float(f64::from(*number))),
            Kind::Count => matches.get_one::<u32>(self.flag).map(|count| Value::Integer(i64::from(*count))),
            Kind::Choice | Kind::File => matches.get_one::<String>(self.flag).cloned().map(Value::String),
            Kind::Switch => matches.get_one::<bool>(self.flag).copied().map(Value::Boolean),
        }
    }
}

impl MapOptions {
    /// The options in effect; `None` if they were only to be printed, which is then done.
    ///
    /// # Errors
    /// [`Usage`] for options that contradict themselves, whatever they come from; if the file cannot be read.
    pub(crate) fn effective(&self) -> anyhow::Result<Option<Effective>> {
        self.effective_with(&[])
    }

    /// As [`effective`](Self::effective), with other defaults than the profile's for some numbers.
    ///
    /// # Errors
    /// As [`effective`](Self::effective).
    pub(crate) fn effective_with(&self, defaults: &[(&str, f32)]) -> anyhow::Result<Option<Effective>> {
        self.effective_by(&profile::INDOOR, defaults)
    }

    /// The options in effect where a microcontroller makes the map: what it learns with is built in.
    ///
    /// # Errors
    /// As [`effective`](Self::effective); [`Usage`] for options that would change what it learns with.
    pub(crate) fn effective_of_firmware(&self) -> anyhow::Result<Option<Effective>> {
        let effective = self.effective_by(&FIRMWARE_PROFILE, &[])?;
        match &effective {
            Some(Effective { profile, supports, .. }) if *profile != FIRMWARE_PROFILE || supports.is_some() => {
                Err(Usage(format!(
                    "the firmware is built with the profile {FIRMWARE_PROFILE} as it is; options that change what a map \
                     learns, or how much memory it has, have no effect on it"
                ))
                .into())
            }
            _ => Ok(effective),
        }
    }

    fn effective_by(
        &self,
        default_profile: &'static Profile,
        defaults: &[(&str, f32)],
    ) -> anyhow::Result<Option<Effective>> {
        let file = self.all.config.as_deref().map(|path| read(path).map(|text| (path, text))).transpose()?;
        let text = file.as_ref().map(|(_, text)| text.as_str());
        let fault = |problem: document::Problem| match (&file, problem.at) {
            (Some((path, text)), Some(at)) => {
                let line = 1 + text[..at.min(text.len())].matches('\n').count();
                Usage(format!("{}, line {line}: {}", path.display(), problem.message))
            }
            _ => Usage(problem.message),
        };
        let effective = self.layered(default_profile, defaults, text).map_err(fault)?;
        let effective = effective.map_err(|problem| {
            let Unusable::Meant(problem) = problem else { return problem.into() };
            // The file's fault if it says so on its own.
            let alone = Self::default().layered(default_profile, &[], text);
            match &file {
                Some((path, _)) if matches!(&alone, Ok(Err(Unusable::Meant(alone))) if *alone == problem) => {
                    anyhow::Error::from(Usage(format!("{}: {problem}", path.display())))
                }
                _ => Usage(problem).into(),
            }
        })?;
        if let Some(SupportsFile { path, supports }) = &effective.supports {
            let learned = supports.learned_with().map(|with| with.kernel.name());
            let used = effective.profile.settings.kernel.name();
            if let Some(learned) = learned.filter(|learned| *learned != used) {
                warn!("{}: learned with the kernel {learned}, used with {used}", path.display());
            }
        }
        if self.all.print_config {
            output::print(&effective.configuration()?)?;
            return Ok(None);
        }
        Ok(Some(effective))
    }

    /// The profile, the file over it, the flags over that; within, what they come to or what is wrong with that.
    fn layered(
        &self,
        default_profile: &'static Profile,
        defaults: &[(&str, f32)],
        file: Option<&str>,
    ) -> Result<Result<Effective, Unusable>, document::Problem> {
        let given = self.given.iter().find(|(option, _)| option.flag == "profile").and_then(|(_, name)| name.as_str());
        let in_file = file.and_then(|text| text.parse::<Table>().ok());
        let in_file = in_file.as_ref().and_then(|table| table.get("profile")?.as_str());
        let name = given.or(in_file).unwrap_or(default_profile.name);
        let Some(named) = profile::named(name) else {
            let names = document::names("profile").join(", ");
            return Ok(Err(Unusable::Meant(format!("unknown profile `{name}`, expected one of {names}"))));
        };
        let mut document = Document::of(&Effective::of(*named).whole());
        for (flag, default) in defaults {
            if let Some(option) = MapOption::named(flag) {
                document.set(option, Value::Float(f64::from(*default)))?;
            }
        }
        if let Some(text) = file {
            document.lay_file(text)?;
        }
        for (option, value) in &self.given {
            document.set(option, value.clone())?;
        }
        Ok(Effective::of_document(named, &document, None))
    }
}

/// Reads a configuration file.
fn read(path: &Path) -> anyhow::Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests;
