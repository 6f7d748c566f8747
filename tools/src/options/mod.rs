//! The options that decide what a map learns, shared by every command that makes one.

mod choice;
mod document;
mod map_option;
mod poses;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_bench::reading;
use bhm_core::{
    profile::{self, Profile},
    settings::Settings,
    support::SupportTable,
};
use bhm_host::{
    ScanRecord,
    dataset::{self, ReadOptions, ScanLog},
    map::{self, AnyMap},
    supports::{self, LearnedSupports, SupportsError, SupportsFileError},
};
use clap::{
    Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches,
    builder::{BoolishValueParser, PossibleValuesParser},
    parser::ValueSource,
    value_parser,
};
use toml::{Table, Value};
use tracing::warn;

pub(crate) use self::{choice::held, map_option::MapOption, poses::PoseDeviations};
use self::{
    document::{Configuration, Document, table_of},
    map_option::{Kind, MAP_OPTIONS},
};
use crate::output::{self, Usage};

/// What the firmware is built with.
const FIRMWARE_PROFILE: Profile = profile::COMPACT;

/// Most tiles of one scan, and tile slots, that a finer spacing asks for by itself.
const MAX_SCALED_TILES: usize = 1 << 14;

/// How a command is told what map to make: flag before environment (`BHM_SPACING` for `--spacing`) before configuration file
/// before profile.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapOptions {
    config: Option<PathBuf>,
    print_config: bool,
    /// In the order of [`MAP_OPTIONS`].
    given: Vec<(&'static MapOption, Value)>,
}

impl Args for MapOptions {
    fn augment_args(command: Command) -> Command {
        const HEADING: &str = "Map options";
        let command = command.next_help_heading(HEADING).args([
            Arg::new("config")
                .long("config")
                .env("BHM_CONFIG")
                .value_name("FILE")
                .value_parser(value_parser!(PathBuf))
                .help(
                    "TOML file of map options, as --print-config writes it, whole or in part; unknown keys are refused",
                ),
            Arg::new("print_config")
                .long("print-config")
                .action(ArgAction::SetTrue)
                .help("Print the map options in effect, as such a file, and exit"),
        ]);
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
        self.config = matches.get_one("config").cloned();
        self.print_config = matches.get_flag("print_config");
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
            Kind::Choice(names) => argument.value_parser(PossibleValuesParser::new(names())),
            Kind::Switch => argument.value_parser(BoolishValueParser::new()),
            Kind::File => argument.value_parser(value_parser!(String)),
        }
    }

    fn value(&self, matches: &ArgMatches) -> Option<Value> {
        match self.kind {
            Kind::Number => matches.get_one::<f32>(self.flag).map(|number| Value::Float(f64::from(*number))),
            Kind::Count => matches.get_one::<u32>(self.flag).map(|count| Value::Integer(i64::from(*count))),
            Kind::Choice(_) | Kind::File => matches.get_one::<String>(self.flag).cloned().map(Value::String),
            Kind::Switch => matches.get_one::<bool>(self.flag).copied().map(Value::Boolean),
        }
    }
}

/// Why options cannot be used.
#[derive(Debug)]
enum Unusable {
    /// They cannot be meant.
    Meant(String),
    /// The file of supports that they name cannot be used, whatever else they say.
    Supports(SupportsFileError),
}

impl From<String> for Unusable {
    fn from(problem: String) -> Self {
        Self::Meant(problem)
    }
}

impl From<Unusable> for anyhow::Error {
    fn from(unusable: Unusable) -> Self {
        match unusable {
            Unusable::Meant(problem) => Usage(problem).into(),
            Unusable::Supports(problem) => problem.into(),
        }
    }
}

/// What the options come to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Effective {
    /// What the map learns, and how much memory it may use.
    pub(crate) profile: Profile,
    /// The sensor's maximum range, metres, where the data are not to be believed or asked.
    pub(crate) max_range_m: Option<f32>,
    /// How far off the scans' poses are, where they do not say.
    pub(crate) poses: PoseDeviations,
    /// Supports of their own that nodes of the map have.
    pub(crate) supports: Option<SupportsFile>,
}

/// Learned supports, and the file that they were read from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SupportsFile {
    pub(crate) path: PathBuf,
    pub(crate) supports: LearnedSupports,
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
        let file = self.config.as_deref().map(|path| read(path).map(|text| (path, text))).transpose()?;
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
        if self.print_config {
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
            let names = profile::ALL.map(|profile| profile.name).join(", ");
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

impl Effective {
    /// A profile as it is.
    pub(crate) fn of(profile: Profile) -> Self {
        Self { profile, max_range_m: None, poses: PoseDeviations::default(), supports: None }
    }

    /// What a configuration whose named profile is `named` comes to, or what is wrong with it. Supports are loaded, unless
    /// they are `known`.
    fn of_document(named: &Profile, document: &Document, known: Option<&SupportsFile>) -> Result<Self, Unusable> {
        let Configuration {
            supports,
            max_range_m,
            pose_deviation_m,
            heading_deviation_rad,
            capacities,
            mut settings,
            ..
        } = document.read()?;
        let supports = match (supports, known) {
            (Some(path), Some(known)) if known.path == path => Some(known.clone()),
            (Some(path), _) => Some(load(&path)?),
            (None, _) => None,
        };
        let table = supports.as_ref().map_or(&SupportTable::EMPTY, |file| file.supports.table());
        if !document.tile_named {
            settings = settings.fitted(table);
        }
        settings.model().map_err(|error| error.to_string())?;
        if let Some(SupportsFile { path, supports }) = &supports {
            let file = path.display();
            supports.matches(&settings).map_err(|error| format!("{file}: {error}; {}", remedy(supports, &error)))?;
            settings.model_with(table.clone()).map_err(|error| format!("{file}: {error}"))?;
        }
        let poses = PoseDeviations { pose_deviation: pose_deviation_m, heading_deviation: heading_deviation_rad };
        poses.check()?;
        if let Some(max_range) = max_range_m.filter(|range| !(range.is_finite() && *range > 0.0)) {
            return Err(Unusable::Meant(format!("maximum range is {max_range}, expected a positive number")));
        }
        let mut profile = Profile { settings, capacities, ..*named };
        make_room(&mut profile, &named.settings, &document.capacities_named);
        Ok(Self { profile, max_range_m, poses, supports })
    }

    /// Everything that a configuration says.
    fn whole(&self) -> Configuration {
        let Self { profile, max_range_m, poses, supports } = self;
        Configuration {
            profile: profile.name.to_owned(),
            supports: supports.as_ref().map(|file| file.path.clone()),
            max_range_m: *max_range_m,
            pose_deviation_m: poses.pose_deviation,
            heading_deviation_rad: poses.heading_deviation,
            capacities: profile.capacities,
            settings: profile.settings,
        }
    }

    /// The same as plain values, for reports.
    pub(crate) fn values(&self) -> Table {
        table_of(&self.whole())
    }

    /// A configuration file that means the same.
    pub(crate) fn configuration(&self) -> anyhow::Result<String> {
        let settings = self.profile.settings;
        let table = self.table().map_or(&SupportTable::EMPTY, LearnedSupports::table);
        Ok(self.whole().text(settings.fitted(table) == settings)?)
    }

    /// One of the numbers in effect, or what is chosen instead and has no such number.
    pub(crate) fn number(&self, option: &MapOption) -> Result<f32, String> {
        Document::of(&self.whole()).number(option)
    }

    /// The same with other numbers, or why that cannot be. Tile slots stay as they are: a map does not depend on them.
    pub(crate) fn with(&self, numbers: &[(&'static MapOption, f32)]) -> Result<Self, String> {
        let named = profile::named(self.profile.name).unwrap_or(&profile::INDOOR);
        // What a scan may touch follows from the spacing anew.
        let mut profile = self.profile;
        profile.capacities.touched = named.capacities.touched;
        let mut document = Document::of(&Self { profile, ..self.clone() }.whole());
        document.capacities_named = vec!["tiles".to_owned()];
        for (option, value) in numbers {
            document.set(option, Value::Float(f64::from(*value))).map_err(|problem| problem.message)?;
        }
        Self::of_document(named, &document, self.supports.as_ref())
            .map_err(|unusable| format!("{:#}", anyhow::Error::from(unusable)))
    }

    /// An empty map.
    ///
    /// # Errors
    /// [`Usage`] if no map can be made like this.
    pub(crate) fn open(&self) -> anyhow::Result<Box<dyn AnyMap>> {
        map::open_with(&self.profile, self.table().cloned()).map_err(|error| Usage(error.to_string()).into())
    }

    /// Supports of their own that nodes of the map have.
    pub(crate) fn table(&self) -> Option<&LearnedSupports> {
        self.supports.as_ref().map(|file| &file.supports)
    }

    /// Reads a log, says how that went, and prepares its scans.
    ///
    /// # Errors
    /// If the log cannot be read.
    pub(crate) fn read(&self, log: &Path) -> anyhow::Result<ScanLog> {
        let mut read = dataset::read_log(log, &ReadOptions { max_range_m: self.max_range_m })?;
        reading::scan_log(log, &read.report);
        self.prepare(&mut read.scans);
        Ok(read)
    }

    /// Scans as they are to be learned: with what is known about their poses, where they do not say.
    fn prepare(&self, scans: &mut [ScanRecord]) {
        scans.iter_mut().for_each(|scan| self.poses.apply(scan));
    }
}

/// Reads learned supports.
fn load(path: &Path) -> Result<SupportsFile, Unusable> {
    let supports = supports::load(path).map_err(Unusable::Supports)?;
    Ok(SupportsFile { path: path.to_owned(), supports })
}

/// Reads a configuration file.
fn read(path: &Path) -> anyhow::Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Which options make a map that these supports fit.
fn remedy(supports: &LearnedSupports, error: &SupportsError) -> String {
    let alike = profile::ALL.into_iter().filter(|profile| supports.matches(&profile.settings).is_ok());
    let names: Vec<_> = alike.map(|profile| format!("--profile {}", profile.name)).collect();
    match error {
        SupportsError::Spacing { learned_m, .. } => {
            let spacing = format!("--spacing {learned_m}");
            format!("give {}", [vec![spacing], names].concat().join(" or "))
        }
        _ if names.is_empty() => "no profile's lattice begins there".to_owned(),
        _ => format!("give {}", names.join(" or ")),
    }
}

/// Gives a map that is finer than its profile the tiles that the same area then takes, where they are not named. A coarser one
/// keeps the profile's.
fn make_room(profile: &mut Profile, named: &Settings, stated: &[String]) {
    let ratio = named.spacing_m / profile.settings.spacing_m;
    if ratio > 1.0 && profile.settings.tile.count.is_none() {
        let capacities = &mut profile.capacities;
        for (name, tiles) in [("tiles", &mut capacities.tiles), ("touched", &mut capacities.touched)] {
            if !stated.iter().any(|stated| stated == name) {
                *tiles = ((*tiles as f32 * ratio * ratio).ceil() as usize).clamp(*tiles, MAX_SCALED_TILES);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        map: MapOptions,
    }

    fn effective(arguments: &[&str]) -> anyhow::Result<Effective> {
        let cli = Cli::try_parse_from([&["bhm"], arguments].concat())?;
        Ok(cli.map.effective()?.unwrap())
    }

    #[test]
    fn without_options_a_profile_is_itself() {
        assert_eq!(
            effective(&[]).unwrap(),
            Effective { profile: profile::INDOOR, max_range_m: None, poses: Default::default(), supports: None }
        );
        for profile in profile::ALL {
            assert_eq!(effective(&["--profile", profile.name]).unwrap().profile, *profile);
        }
    }

    #[test]
    fn a_printed_configuration_means_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        for arguments in [
            &["--profile=paper"][..],
            &["--profile=outdoor", "--rule=jaakkola-jordan", "--passes=1", "--no-return-free=5", "--max-range=30"],
            &["--pose-deviation=0.05", "--heading-deviation=0.01"],
            &["--spacing=0.1", "--kernel=squared-exponential", "--bias=on", "--gap=0", "--forgetting=0.99"],
            &["--slots=3", "--range-limit=12.5", "--free-spacing=0.3", "--prior-precision=1e-3", "--spacing=0.1"],
            &["--kernel=two-scales", "--kernel-shape=0.3", "--support=rectangle", "--support-samples=3"],
        ] {
            let expected = effective(arguments).unwrap();
            fs::write(&path, expected.configuration().unwrap()).unwrap();
            assert_eq!(effective(&["--config", path.to_str().unwrap()]).unwrap(), expected, "{arguments:?}");
        }
    }

    #[test]
    fn a_flag_overrides_the_file_and_the_file_the_profile() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        fs::write(&path, "profile = \"compact\"\n[settings]\npasses = 2\nspacing_m = 0.4\n").unwrap();
        let profile = effective(&["--spacing", "0.3", "--config", path.to_str().unwrap()]).unwrap().profile;
        assert_eq!((profile.name, profile.settings.passes, profile.settings.spacing_m), ("compact", 2, 0.3));
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        for (text, says) in [
            ("[settings]\nspacin_m = 1.0\n", ", line 2: unknown field `spacin_m`, expected one of `"),
            (
                "\n[settings]\nrule = \"newton\"\n",
                ", line 3: unknown rule `newton`, expected one of gaussian-variational, ",
            ),
            (
                "settings.beam = { point-samples = { length = 1.0 } }\n",
                ", line 1: unknown field `length`, expected one of ",
            ),
            (
                "gap = 1\n",
                ", line 1: unknown field `gap`, expected one of `capacities`, `heading_deviation_rad`, `max_range_m`",
            ),
            ("[settings]\nbiass = true\n", ", line 2: unknown field `biass`, expected one of `beam`, `bias`, "),
            ("[settings]\npasses = \"many\"\n", ", line 2: `settings.passes` is \"many\", expected a whole number"),
            ("[settings]\npasses = 1.5\n", ", line 2: `settings.passes` is 1.5, expected a whole number"),
            ("[settings]\nspacing_m = true\n", ", line 2: `settings.spacing_m` is true, expected a number"),
            ("settings = 1\n", ", line 1: `settings` is 1, expected a table"),
            ("[settings]\norigin_m = [1.0]\n", ": `settings.origin_m`: "),
            (
                "[settings.rule.jaakkola-jordan]\nstart = { constnt = 1.0 }\n",
                ": `settings.rule.start`: unknown variant `constnt`, expected `constant` or ",
            ),
            ("[settings]\nspacing_m = \n", ", line 2: "),
            ("[settings]\nspacing_m = -1.0\n", ": spacing is -1, expected 1 mm to 1 km"),
            ("settings.kernel.squared-exponential.shape = 0\n", ": kernel shape is 0, expected a positive number"),
            ("profile = \"cellar\"\n", ": unknown profile `cellar`, expected one of indoor, "),
        ] {
            fs::write(&path, text).unwrap();
            let error = effective(&["--config", path.to_str().unwrap()]).unwrap_err();
            assert!(error.is::<Usage>());
            let expected = format!("{}{says}", path.display());
            assert!(error.to_string().starts_with(&expected), "{error} is not {expected}");
        }
    }

    #[test]
    fn a_choice_keeps_what_it_has_in_common_with_the_one_before() {
        use bhm_core::{
            beam::{AnyBeamRule, LineSegments},
            rule::{AnyRule, JaakkolaJordan, XiStart},
        };
        let outdoor = effective(&["--profile=outdoor", "--beam-rule=line-segments"]).unwrap().profile.settings;
        assert_eq!(outdoor.beam, AnyBeamRule::LineSegments(LineSegments { gap_m: 0.3, ..LineSegments::DEFAULT }));
        // A start of the rule takes the place of another.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        for (start, name, expected) in
            [("constant", "compact", XiStart::Constant(2.0)), ("predicted-up-to", "paper", XiStart::PredictedUpTo(2.0))]
        {
            let text = format!("profile = \"{name}\"\nsettings.rule.jaakkola-jordan.start.{start} = 2\n");
            fs::write(&path, text).unwrap();
            let rule = effective(&["--config", path.to_str().unwrap()]).unwrap().profile.settings.rule;
            assert_eq!(rule, AnyRule::JaakkolaJordan(JaakkolaJordan { start: expected }));
        }
        // The paper's start of the rule is kept when the rule is named again.
        let paper = effective(&["--profile=paper", "--rule=jaakkola-jordan"]).unwrap().profile.settings;
        assert_eq!(paper, profile::PAPER.settings);
    }

    #[test]
    fn a_setting_that_nothing_chosen_has_is_refused() {
        for (argument, says) in [
            ("--kernel-shape=1", "--kernel-shape: cubic-b-spline has no kernel-shape"),
            ("--support-size=1", "--support-size: point has no support-size"),
            ("--segment-length=1", "--segment-length: point-samples has no segment-length"),
        ] {
            assert_eq!(effective(&[argument]).unwrap_err().to_string(), says);
        }
    }

    #[test]
    fn numbers_are_set_by_option_and_nothing_else_changes() {
        let mut start = effective(&["--kernel=squared-exponential", "--max-range=30"]).unwrap();
        start.profile.capacities.tiles = 77;
        for (flag, value) in
            [("spacing", 0.3), ("kernel-shape", 0.7), ("prior-precision", 1e-3), ("free-spacing", 0.8), ("gap", 0.2)]
        {
            let option = MapOption::named(flag).unwrap();
            let changed = start.with(&[(option, value)]).unwrap();
            assert_eq!(changed.number(option), Ok(value));
            assert_ne!(start.number(option), Ok(value));
            assert_eq!(changed.with(&[(option, start.number(option).unwrap())]), Ok(start.clone()), "{flag}");
        }
        let gap = MapOption::named("gap").unwrap();
        assert_eq!(start.with(&[(gap, -1.0)]).unwrap_err().split(" is ").next(), Some("gap before a hit"));
        let shape = Effective::of(profile::INDOOR).number(MapOption::named("kernel-shape").unwrap());
        assert_eq!(shape, Err("cubic-b-spline has no kernel-shape".to_owned()));
    }
}
