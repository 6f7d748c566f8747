//! What areas bring where supports are few (Fig. 5 of the paper).

mod outcome;
mod series;
mod way;

use std::path::PathBuf;

use bhm_core::{
    kernel::KernelChoice,
    profile::{OUTDOOR, PAPER},
    settings::Settings,
    support::SupportTable,
};
use bhm_host::{ScanRecord, sim::Scene};
use bhm_tools::picture::Bounds;
use clap::{Args, builder::PossibleValuesParser};

use self::{
    outcome::{Outcome, Row},
    way::Way,
};
use super::trial::Exam;
use crate::{
    output::{Output, Usage},
    plates::Plates,
};

/// What areas bring where supports are few (Fig. 5): points, rectangles and Gaussians on coarser and coarser lattices
///
/// The kernel keeps its width in metres while the supports move apart, until points no longer see what lies between them.
/// Draws AUC and NLL against the number of samples that stand for a rectangle, and against the distance between supports;
/// held-out beams judge. The numbers of every run are left in a CSV file beside the pictures.
#[derive(Args, Debug)]
pub(crate) struct Granularity {
    /// Folder for the pictures and the numbers; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What is mapped: the site that a robot drives around, or the corner that a fixed lidar watches
    #[arg(long, default_value = DATASETS[0].scene, value_parser = PossibleValuesParser::new(DATASETS.map(|data| data.scene)))]
    scene: String,
    /// Less of everything, in seconds: for a first look
    #[arg(long)]
    quick: bool,
    /// Repetitions, each with a seed of its own for the simulation and what is held out
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100), value_name = "N")]
    seeds: u32,
    /// Use every n-th scan [default: as many as the scene needs]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: Option<u32>,
    /// Learn by the paper's rule: Jaakkola-Jordan from xi = 1, two passes
    #[arg(long)]
    paper: bool,
    /// Learn a bias, which speaks where no support reaches
    #[arg(long)]
    bias: bool,
    /// Longest piece of a beam for which one free point is learned, metres. Two free points to a hit are asked for; the
    /// more are learned, the more a support that covers both is taken for free
    #[arg(long, default_value_t = OUTDOOR.settings.free_spacing_m, value_name = "M")]
    free_spacing: f32,
    /// Also draw the maps of points and of rectangles on the coarse lattice
    #[arg(long)]
    maps: bool,
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

/// Distances between supports, metres.
const SPACINGS_M: [f32; 6] = [5.0, 7.5, 10.0, 12.5, 15.0, 20.0];
const QUICK_SPACINGS_M: [f32; 2] = [10.0, 15.0];

/// Samples a side of a rectangle.
const SAMPLES: [u32; 6] = [1, 2, 3, 4, 6, 8];
const QUICK_SAMPLES: [u32; 2] = [1, 4];

/// What is compared on every lattice. A deviation of 0.29 spacings is that of the rectangle: 1/√12.
const WAYS: [Way; 6] =
    [Way::Points, Way::Sampled(4), Way::Exact, Way::Isotropic(0.29), Way::Isotropic(0.5), Way::Learned];

/// What a first look leaves of the scans and the seeds.
const QUICK_EVERY: u32 = 4;
const QUICK_SEEDS: u32 = 2;

impl Granularity {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let data = DATASETS.iter().find(|data| data.scene == self.scene).unwrap_or(&DATASETS[0]);
        let scene = Scene::named(data.scene)?;
        let base = self.base();
        base.fitted(SupportTable::EMPTY).model().map_err(|error| Usage(error.to_string()))?;
        let mut plates = Plates::into(&self.output)?;

        let quick_every = if self.quick { QUICK_EVERY } else { 1 };
        let every = self.every.unwrap_or(data.every * quick_every) as usize;
        let seeds = if self.quick { self.seeds.min(QUICK_SEEDS) } else { self.seeds };
        let exam = |seed: u64| {
            let scans: Vec<ScanRecord> = scene.simulate(seed).step_by(every).collect();
            Exam::of(&scans, 0.1, seed).map(|exam| (seed, exam))
        };
        let exams: Vec<(u64, Exam)> = (1..=u64::from(seeds)).map(exam).collect::<Result<_, _>>()?;

        let mut rows: Vec<Row> = Vec::new();
        for (spacing_m, way) in self.combinations(data) {
            let settings =
                Settings { spacing_m, kernel_shape: data.shape_m2 / (spacing_m * spacing_m), ..way.settings(&base) };
            let (row, map) = outcome::row(&exams, way, settings)?;
            let name = match way {
                Way::Points => "points",
                Way::Exact => "rectangles",
                _ => "",
            };
            if let Some(map) = map.filter(|_| self.maps && spacing_m == data.coarse_m && !name.is_empty()) {
                let world = scene.world().bounds();
                let [min, max] = [world.min, world.max].map(|corner| corner.map(|metres| metres as f32));
                let title = format!("{}: {}, {spacing_m} m apart", data.scene, row.supports);
                let file = format!("granularity-{}-map-{name}.png", data.scene);
                plates.map(&file, &title, Bounds { min, max }, &[], &*map)?;
            }
            rows.push(row);
        }
        let outcome = Outcome::new(data, rows);
        series::draw(data, &outcome.rows, &mut plates)?;
        plates.text(&format!("granularity-{}.csv", data.scene), &outcome.csv())?;
        output.result(&outcome, || outcome.text() + "\n" + &plates.list())
    }

    /// What is the same for everybody.
    fn base(&self) -> Settings {
        let learning = if self.paper { PAPER.settings } else { OUTDOOR.settings };
        Settings {
            kernel: KernelChoice::SquaredExponential,
            rule: learning.rule,
            passes: learning.passes,
            bias: self.bias,
            free_spacing_m: self.free_spacing,
            // Like every weight, as in the paper: a bias with a narrow prior would not be heard beside them.
            bias_precision: PAPER.settings.bias_precision,
            ..OUTDOOR.settings
        }
    }

    /// Every lattice and way that some picture shows, once.
    fn combinations(&self, data: &Dataset) -> Vec<(f32, Way)> {
        let (spacings_m, samples) =
            if self.quick { (&QUICK_SPACINGS_M[..], &QUICK_SAMPLES[..]) } else { (&SPACINGS_M[..], &SAMPLES[..]) };
        let on_every = spacings_m.iter().flat_map(|spacing_m| WAYS.map(|way| (*spacing_m, way)));
        let counted = samples.iter().map(|count| Way::Sampled(*count)).chain([Way::Exact]);
        let mut combinations: Vec<(f32, Way)> = Vec::new();
        for combination in on_every.chain(counted.map(|way| (data.coarse_m, way))) {
            if !combinations.contains(&combination) {
                combinations.push(combination);
            }
        }
        combinations
    }
}
