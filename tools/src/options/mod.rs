//! The options that decide what a map learns, shared by every command that makes one.

mod choice;
mod number;
mod poses;
mod values;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_bench::reading;
use bhm_core::profile::{self, Profile};
use bhm_host::{
    ScanRecord,
    dataset::{self, ReadOptions, ScanLog},
    map::{self, AnyMap},
    supports::{self, LearnedSupports},
};
use clap::Args;
use tracing::warn;

pub(crate) use self::{choice::held, number::Number, poses::PoseDeviations, values::MapValues};
use crate::output::{self, Usage};

/// What the firmware is built with.
const FIRMWARE_PROFILE: Profile = profile::COMPACT;

/// How a command is told what map to make: flag before environment (`BHM_SPACING` for `--spacing`) before configuration file
/// before profile.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Map options")]
pub(crate) struct MapOptions {
    /// TOML file of map options: the same names without dashes before them; unknown ones are refused
    #[arg(long, env = "BHM_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the map options in effect, as such a file, and exit
    #[arg(long)]
    print_config: bool,
    #[command(flatten)]
    values: MapValues,
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
    pub(crate) supports: &'static LearnedSupports,
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
    pub(crate) fn effective_with(&self, defaults: &[(Number, f32)]) -> anyhow::Result<Option<Effective>> {
        self.effective_by(|merged| merged, defaults)
    }

    /// The options in effect where a microcontroller makes the map: what it learns with is built in.
    ///
    /// # Errors
    /// As [`effective`](Self::effective); [`Usage`] for options that would change what it learns with.
    pub(crate) fn effective_of_firmware(&self) -> anyhow::Result<Option<Effective>> {
        let effective = self.effective_by(|merged| merged.with_default_profile(&FIRMWARE_PROFILE), &[])?;
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
        complete: impl Fn(MapValues) -> MapValues,
        defaults: &[(Number, f32)],
    ) -> anyhow::Result<Option<Effective>> {
        let file = self.config.as_deref().map(|path| read(path).map(|values| (path, values))).transpose()?;
        let merged = file.as_ref().map_or(self.values.clone(), |(_, values)| self.values.or(values));
        let mut merged = complete(merged);
        for (number, default) in defaults {
            merged.number_mut(*number).get_or_insert(*default);
        }
        let supports = merged.supports().map(load).transpose()?;
        let effective = merged.effective(supports.as_ref()).map_err(|problem| match &file {
            // The file's fault if it says so on its own.
            Some((path, values)) if values.effective(supports.as_ref()).as_ref() == Err(&problem) => {
                Usage(format!("{}: {problem}", path.display()))
            }
            _ => Usage(problem),
        })?;
        if let Some(SupportsFile { path, supports }) = &effective.supports {
            let (learned, used) = (supports.learned_with().kernel.name(), effective.profile.settings.kernel.name());
            if learned != used {
                warn!("{}: learned with the kernel {learned}, used with {used}", path.display());
            }
        }
        if self.print_config {
            output::print(&effective.configuration()?)?;
            return Ok(None);
        }
        Ok(Some(effective))
    }
}

impl Effective {
    /// A profile as it is.
    #[cfg(test)]
    pub(crate) fn of(profile: Profile) -> Self {
        Self { profile, max_range_m: None, poses: PoseDeviations::default(), supports: None }
    }

    /// An empty map.
    ///
    /// # Errors
    /// [`Usage`] if no map can be made like this.
    pub(crate) fn open(&self) -> anyhow::Result<Box<dyn AnyMap>> {
        map::open_with(&self.profile, self.table()).map_err(|error| Usage(error.to_string()).into())
    }

    /// A configuration file that means the same.
    pub(crate) fn configuration(&self) -> anyhow::Result<String> {
        Ok(toml::to_string(&MapValues::of(self))?)
    }

    /// Supports of their own that nodes of the map have.
    pub(crate) fn table(&self) -> Option<&'static LearnedSupports> {
        self.supports.as_ref().map(|file| file.supports)
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
fn load(path: &Path) -> anyhow::Result<SupportsFile> {
    Ok(SupportsFile { path: path.to_owned(), supports: supports::load(path)?.interned() })
}

/// Reads a configuration file.
fn read(path: &Path) -> anyhow::Result<MapValues> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        Usage(format!("{}, line {line}: {}", path.display(), error.message())).into()
    })
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
            &["--slots=3", "--kernel-shape=1.2", "--range-limit=12.5", "--free-spacing=0.3", "--prior-precision=1e-3"],
        ] {
            let expected = effective(arguments).unwrap();
            fs::write(&path, toml::to_string(&MapValues::of(&expected)).unwrap()).unwrap();
            assert_eq!(effective(&["--config", path.to_str().unwrap()]).unwrap(), expected, "{arguments:?}");
        }
    }

    #[test]
    fn a_flag_overrides_the_file_and_the_file_the_profile() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        fs::write(&path, "profile = \"compact\"\npasses = 2\nspacing = 0.4\n").unwrap();
        let profile = effective(&["--spacing", "0.3", "--config", path.to_str().unwrap()]).unwrap().profile;
        assert_eq!((profile.name, profile.settings.passes, profile.settings.spacing_m), ("compact", 2, 0.3));
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        for (text, says) in [
            ("passes = 2\nspacin = 1.0\n", ", line 2: unknown field `spacin`, expected one of `profile`, `spacing`"),
            ("\n\nrule = \"newton\"\n", ", line 3: unknown rule `newton`, expected one of gaussian-variational, "),
            ("passes = \"many\"\n", ", line 1: invalid type: string \"many\", expected u32"),
            ("spacing = \n", ", line 1: "),
            ("spacing = -1.0\n", ": spacing is -1, expected 1 mm to 1 km"),
        ] {
            fs::write(&path, text).unwrap();
            let error = effective(&["--config", path.to_str().unwrap()]).unwrap_err();
            assert!(error.is::<Usage>());
            let expected = format!("{}{says}", path.display());
            assert!(error.to_string().starts_with(&expected), "{error} is not {expected}");
        }
    }
}
