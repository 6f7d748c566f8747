//! What the options come to: a profile, what is known of the data, and learned supports.

use std::path::{Path, PathBuf};

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
use toml::{Table, Value};

use super::{
    MapOption, PoseDeviations,
    document::{Configuration, Document, table_of},
};
use crate::output::Usage;

/// Most tiles of one scan, and tile slots, that a finer spacing asks for by itself.
const MAX_SCALED_TILES: usize = 1 << 14;

/// Why options cannot be used.
#[derive(Debug)]
pub(super) enum Unusable {
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

impl Effective {
    /// A profile as it is.
    pub(crate) fn of(profile: Profile) -> Self {
        Self { profile, max_range_m: None, poses: PoseDeviations::default(), supports: None }
    }

    /// What a configuration whose named profile is `named` comes to, or what is wrong with it. Supports are loaded, unless
    /// they are `known`.
    pub(super) fn of_document(
        named: &Profile,
        document: &Document,
        known: Option<&SupportsFile>,
    ) -> Result<Self, Unusable> {
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
        let (prior, kernel) = (settings.prior, settings.kernel);
        if prior.or_white(&kernel) != prior {
            return Err(format!("prior {}: it is not defined for the kernel {}", prior.name(), kernel.name()).into());
        }
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
    pub(super) fn whole(&self) -> Configuration {
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
            document.set(option, Value::Float(f64::from(*value)))?;
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
    pub(super) fn prepare(&self, scans: &mut [ScanRecord]) {
        scans.iter_mut().for_each(|scan| self.poses.apply(scan));
    }
}

/// Reads learned supports.
fn load(path: &Path) -> Result<SupportsFile, Unusable> {
    let supports = supports::load(path).map_err(Unusable::Supports)?;
    Ok(SupportsFile { path: path.to_owned(), supports })
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
