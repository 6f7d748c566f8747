use std::{
    fmt,
    path::{Path, PathBuf},
};

use bhm_core::{
    beam::{AnyBeamRule, PointSamples},
    profile::{self, Profile},
};
use bhm_host::{
    ScanRecord,
    dataset::{self, DatasetError, PointLog, PointReport, ReadOptions, ReadReport},
    sim::{Scene, World},
};

use crate::evaluation::{Held, Sampling, Task, hold_out};

/// Something to map, and with which profile.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// What tables call it.
    pub name: String,
    /// Where it comes from.
    pub origin: Origin,
    /// What our map and the sampling of points begin with.
    pub profile: Profile,
    /// Every how many scans are used.
    pub every: usize,
}

/// Where a dataset comes from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// Simulated here, seeded.
    Scene(&'static Scene),
    /// A recorded log.
    Log(PathBuf),
    /// Points that were divided elsewhere, and the log they are of, if it is there: grids that cast rays need it.
    Points {
        /// Learned.
        train: PathBuf,
        /// Asked.
        test: PathBuf,
        /// Where the sensor stood: scan n of the points is scan n of the log.
        log: Option<PathBuf>,
    },
}

/// A dataset cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum DatasetProblem {
    /// A file.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Neither a scene nor a profile is called so.
    #[error("there is no profile {0:?}; there are: {names}", names = profile::ALL.map(|p| p.name).join(", "))]
    Profile(String),
    /// Nothing can be learned or asked of it.
    #[error("{0}: nothing to learn, or nothing to ask")]
    Nothing(String),
}

/// A dataset in memory.
#[derive(Debug)]
pub struct Loaded {
    /// What it is.
    pub dataset: Dataset,
    /// What really stands there, where that is known.
    pub world: Option<World>,
    /// How reading the log went, where one was read.
    pub report: Option<ReadReport>,
    /// How reading points went.
    pub point_reports: Vec<(PathBuf, PointReport)>,
    scans: Vec<ScanRecord>,
    points: Option<[PointLog; 2]>,
}

impl Dataset {
    /// A scene by its name, or a log by its path; `@PROFILE` may follow. Scenes but the building are sites.
    ///
    /// # Errors
    /// If there is no such profile.
    pub fn parse(text: &str) -> Result<Self, DatasetProblem> {
        let (text, profile) = match text.rsplit_once('@') {
            Some((text, name)) => {
                (text, Some(profile::named(name).ok_or_else(|| DatasetProblem::Profile(name.to_owned()))?))
            }
            None => (text, None),
        };
        Ok(match Scene::named(text) {
            Ok(scene) => {
                let own = if scene.lidar.range_max_m > profile::INDOOR.settings.limits.range_max_m {
                    &profile::OUTDOOR
                } else {
                    &profile::INDOOR
                };
                Self { name: text.to_owned(), origin: Origin::Scene(scene), profile: *profile.unwrap_or(own), every: 1 }
            }
            Err(_) => {
                let file = Path::new(text).file_name().unwrap_or_default().to_string_lossy();
                let name = file.split('.').next().unwrap_or_default().to_owned();
                Self { name, origin: Origin::Log(text.into()), profile: *profile.unwrap_or(&profile::INDOOR), every: 1 }
            }
        })
    }

    /// How much coarser than in a building everything is that has a length.
    #[must_use]
    pub fn scale(&self) -> f32 {
        // The profile's own spacing would be four times that of a building; twice is what the range of the lidars affords.
        if self.profile.settings.spacing_m > profile::COMPACT.settings.spacing_m { 2.0 } else { 1.0 }
    }

    /// Reads or simulates it.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn load(self, seed: u64) -> Result<Loaded, DatasetProblem> {
        let read = |path: &Path| dataset::read_log(path, &ReadOptions::default());
        let mut loaded = Loaded {
            dataset: self,
            world: None,
            report: None,
            point_reports: Vec::new(),
            scans: Vec::new(),
            points: None,
        };
        match loaded.dataset.origin.clone() {
            Origin::Scene(scene) => {
                loaded.world = Some(scene.world());
                loaded.scans = scene.simulate(seed).collect();
            }
            Origin::Log(path) => {
                let log = read(&path)?;
                (loaded.scans, loaded.report) = (log.scans, Some(log.report));
            }
            Origin::Points { train, test, log } => {
                let mut points = |path: PathBuf| -> Result<PointLog, DatasetProblem> {
                    let points = PointLog::read(&path)?;
                    loaded.point_reports.push((path, points.report.clone()));
                    Ok(points)
                };
                loaded.points = Some([points(train)?, points(test)?]);
                if let Some(path) = log {
                    let log = read(&path)?;
                    (loaded.scans, loaded.report) = (log.scans, Some(log.report));
                }
            }
        }
        if loaded.points.is_none() {
            loaded.scans = loaded.scans.into_iter().step_by(loaded.dataset.every.max(1)).collect();
        }
        Ok(loaded)
    }
}

/// Points on the free part of a beam as a rule has them, with its gap if it has segments.
pub(crate) fn as_points(rule: &AnyBeamRule) -> PointSamples {
    match *rule {
        AnyBeamRule::PointSamples(rule) => rule,
        AnyBeamRule::LineSegments(rule) => PointSamples { gap_m: rule.gap_m, ..PointSamples::DEFAULT },
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(scene) => write!(f, "simulated: {}", scene.name),
            Self::Log(path) => write!(f, "log {}", path.display()),
            Self::Points { test, .. } => write!(f, "points {}", test.display()),
        }
    }
}

impl Loaded {
    /// How beams of it become points.
    #[must_use]
    pub fn sampling(&self, seed: u64) -> Sampling {
        let settings = &self.dataset.profile.settings;
        let PointSamples { free_spacing_m, gap_m, .. } = as_points(&settings.beam);
        Sampling { limits: settings.limits, free_spacing_m, gap_m, seed }
    }

    /// Divides it. What was divided elsewhere stays as it is, whatever is to be held out.
    ///
    /// # Errors
    /// If nothing remains to be learned or asked.
    pub fn task(&self, held: Held, fraction: f64, seed: u64) -> Result<Task, DatasetProblem> {
        let sampling = self.sampling(seed);
        let task = match &self.points {
            Some([train, test]) => Task::of_points(train.scans.clone(), test.scans.clone(), sampling.limits, |scan| {
                let pose = self.scans.get(usize::try_from(scan).ok()?)?.header.map_from_sensor;
                Some([pose.x_m, pose.y_m])
            }),
            None => Task::of_split(&self.scans, hold_out(&self.scans, held, fraction, seed), &sampling),
        };
        if task.area_m().is_none() || task.test.points_m.is_empty() {
            return Err(DatasetProblem::Nothing(self.dataset.origin.to_string()));
        }
        Ok(task)
    }

    /// How many scans there are.
    #[must_use]
    pub fn scans(&self) -> usize {
        self.points.as_ref().map_or(self.scans.len(), |[train, _]| train.scans.len())
    }
}
