//! What areas bring where supports are few (Fig. 5 of the paper).

mod figures;
mod node_support;
mod result;

use std::path::PathBuf;

use bhm_core::{
    beam::{AnyBeamRule, PointSamples},
    profile::{OUTDOOR, PAPER},
    settings::Settings,
    support::SupportTable,
};
use bhm_host::{ScanRecord, sim::Scene};
use bhm_plot::{folder::PictureFolder, picture::Bounds};

pub use self::result::Compared;
use self::{node_support::NodeSupport, result::Row};
use super::{split, squared_exponential};
use crate::{contest::as_points, evaluation::BeamSplit};

/// What is compared, and how often.
#[derive(Clone, Debug)]
pub struct Granularity {
    /// Folder for the pictures and the numbers; made if need be.
    pub output: PathBuf,
    /// What is mapped: one of [`SCENES`].
    pub scene: String,
    /// Less of everything, in seconds: for a first look.
    pub quick: bool,
    /// Repetitions, each with a seed of its own for the simulation and what is held out.
    pub seeds: u32,
    /// Every how many scans are used; `None` for as many as the scene needs.
    pub every: Option<u32>,
    /// Learn by the paper's rule: Jaakkola–Jordan from ξ = 1, two passes.
    pub paper: bool,
    /// Learn a bias, which speaks where no support reaches.
    pub bias: bool,
    /// Longest piece of a beam for which one free point is learned, metres.
    pub free_spacing_m: f32,
    /// Also draw the maps of points and of rectangles on the coarse lattice.
    pub maps: bool,
}

/// What is mapped, and the paper's numbers for it.
struct Dataset {
    scene: &'static str,
    /// The `g` of `G = g·I`, square metres.
    shape_m2: f32,
    /// Where samples are counted, metres.
    coarse_m: f32,
    /// Every so many scans: neighbours say the same.
    every: u32,
}

const DATASETS: [Dataset; 2] = [
    // "Dataset 2". A scan every 56 m, of a lidar that sees 60 m.
    Dataset { scene: "outdoor", shape_m2: 13.0, coarse_m: 15.0, every: 40 },
    // "Dataset 1". The lidar stands still; the vehicles move on by 20 m.
    Dataset { scene: "traffic", shape_m2: 16.0, coarse_m: 15.0, every: 20 },
];

/// Names of what can be mapped.
pub const SCENES: [&str; 2] = [DATASETS[0].scene, DATASETS[1].scene];

/// Distances between supports, metres.
const SPACINGS_M: [f32; 6] = [5.0, 7.5, 10.0, 12.5, 15.0, 20.0];
const QUICK_SPACINGS_M: [f32; 2] = [10.0, 15.0];

/// Samples a side of a rectangle.
const SAMPLES: [u32; 6] = [1, 2, 3, 4, 6, 8];
const QUICK_SAMPLES: [u32; 2] = [1, 4];

/// What is compared on every lattice. A deviation of 0.29 spacings is that of the rectangle: 1/√12.
const NODE_SUPPORTS: [NodeSupport; 6] = [
    NodeSupport::Points,
    NodeSupport::Sampled(4),
    NodeSupport::Exact,
    NodeSupport::Isotropic(0.29),
    NodeSupport::Isotropic(0.5),
    NodeSupport::Learned,
];

/// What a first look leaves of the scans and the seeds.
const QUICK_EVERY: u32 = 4;
const QUICK_SEEDS: u32 = 2;

impl Granularity {
    /// Learns and asks everything, and draws it.
    ///
    /// # Errors
    /// If a file cannot be written, or a contestant cannot learn all that it is shown.
    pub fn compare(&self) -> anyhow::Result<Compared> {
        let data = DATASETS.iter().find(|data| data.scene == self.scene).unwrap_or(&DATASETS[0]);
        let scene = Scene::named(data.scene)?;
        let base = self.base();
        base.fitted(&SupportTable::EMPTY).model()?;
        let mut pictures = PictureFolder::into(&self.output)?;

        let quick_every = if self.quick { QUICK_EVERY } else { 1 };
        let every = self.every.unwrap_or(data.every * quick_every) as usize;
        let seeds = if self.quick { self.seeds.min(QUICK_SEEDS) } else { self.seeds };
        let split_of = |seed: u64| {
            let scans: Vec<ScanRecord> = scene.simulate(seed).step_by(every).collect();
            split(&scans, seed).map(|split| (seed, split))
        };
        let splits: Vec<(u64, BeamSplit)> = (1..=u64::from(seeds)).map(split_of).collect::<Result<_, _>>()?;

        let mut rows: Vec<Row> = Vec::new();
        for (spacing_m, support) in self.combinations(data) {
            let settings = Settings {
                spacing_m,
                kernel: squared_exponential(data.shape_m2 / (spacing_m * spacing_m)),
                ..support.settings(&base)
            };
            let (row, map) = result::row(&splits, support, settings)?;
            let name = match support {
                NodeSupport::Points => "points",
                NodeSupport::Exact => "rectangles",
                _ => "",
            };
            if let Some(map) = map.filter(|_| self.maps && spacing_m == data.coarse_m && !name.is_empty()) {
                let world = scene.world().bounds();
                let [min, max] = [world.min, world.max].map(|corner| corner.map(|metres| metres as f32));
                let title = format!("{}: {}, {spacing_m} m apart", data.scene, row.supports);
                let file = format!("granularity-{}-map-{name}.png", data.scene);
                pictures.map(&file, &title, Bounds { min, max }, &[], |at| map.occupancy(at))?;
            }
            rows.push(row);
        }
        let mut compared = Compared::new(data, rows);
        figures::draw(data, &compared.rows, &mut pictures)?;
        pictures.text(&format!("granularity-{}.csv", data.scene), &compared.csv())?;
        compared.pictures = pictures.files;
        Ok(compared)
    }

    /// What is the same for everybody.
    fn base(&self) -> Settings {
        let learning = if self.paper { PAPER.settings } else { OUTDOOR.settings };
        let as_points = as_points(&OUTDOOR.settings.beam);
        Settings {
            rule: learning.rule,
            passes: learning.passes,
            beam: AnyBeamRule::PointSamples(PointSamples { free_spacing_m: self.free_spacing_m, ..as_points }),
            // Like every weight, as in the paper: a bias with a narrow prior would not be heard beside them.
            bias: PAPER.settings.bias.filter(|_| self.bias),
            ..OUTDOOR.settings
        }
    }

    /// Every lattice and kind of support that some picture shows, once.
    fn combinations(&self, data: &Dataset) -> Vec<(f32, NodeSupport)> {
        let (spacings_m, samples) =
            if self.quick { (&QUICK_SPACINGS_M[..], &QUICK_SAMPLES[..]) } else { (&SPACINGS_M[..], &SAMPLES[..]) };
        let on_every = spacings_m.iter().flat_map(|spacing_m| NODE_SUPPORTS.map(|support| (*spacing_m, support)));
        let counted = samples.iter().map(|count| NodeSupport::Sampled(*count)).chain([NodeSupport::Exact]);
        let mut combinations: Vec<(f32, NodeSupport)> = Vec::new();
        for combination in on_every.chain(counted.map(|support| (data.coarse_m, support))) {
            if !combinations.contains(&combination) {
                combinations.push(combination);
            }
        }
        combinations
    }
}
