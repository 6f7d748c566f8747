//! Experiments, each with its own options; what they compare is in `bhm_bench::experiments`.

use std::path::{Path, PathBuf};

use bhm_bench::{
    evaluation::BeamSplit,
    experiments::{self, granularity, kernels, placement, poses, relevance, segments, shapes},
    scattered::{Clusters, MAX_SCATTERED},
    text::Report,
};
use bhm_core::settings::Settings;
use bhm_host::sim::Scene;
use clap::{Args, builder::PossibleValuesParser};

use crate::{
    options::MapOptions,
    output::{Output, Usage},
};

/// Compare ways of mapping, as the paper's figures do: tables and pictures
#[derive(Args, Debug)]
pub(crate) struct Experiment {
    #[command(subcommand)]
    which: Which,
}

impl Experiment {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.which.run(output)
    }
}

subcommands! {
    enum Which {
        Granularity(Granularity),
        Kernels(Kernels),
        Placement(Placement),
        Poses(Poses),
        Relevance(Relevance),
        Segments(Segments),
        Shapes(Shapes),
    }
}

/// A log of which some is held out, and the map options: what most experiments begin with.
#[derive(Args, Debug)]
struct OnLog {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of what is held out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl OnLog {
    /// Prints what an experiment finds, unless options were only to be printed. What some numbers are by default is the
    /// experiment's to say.
    fn run<R: Report>(
        &self,
        output: &Output,
        defaults: &[(&str, f32)],
        experiment: impl FnOnce(&BeamSplit, &Settings) -> anyhow::Result<R>,
    ) -> anyhow::Result<()> {
        let (Some(options), Some(log)) = (self.map.effective_with(defaults)?, &self.log) else { return Ok(()) };
        let scans: Vec<_> = options.read(log)?.scans.into_iter().step_by(self.every as usize).collect();
        output.report(&experiment(&experiments::split(&scans, self.seed)?, &options.profile.settings)?)
    }
}

/// What one kernel brings over another at equal spacing, and what several on one lattice bring
///
/// The cubic B-spline, the squared exponential at every shape of --shapes, and the sum of two squared exponentials, the second
/// of twice the length scale, at every shape of --two-scales-shapes. Held-out beams judge.
#[derive(Args, Debug)]
struct Kernels {
    /// Shapes of the squared exponential, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.2,0.3,0.45,0.6,0.8,1.0,1.5", value_name = "LIST")]
    shapes: Vec<f32>,
    /// Shapes of the narrower of two scales, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.1,0.2,0.3,0.45,0.6", value_name = "LIST")]
    two_scales_shapes: Vec<f32>,
    #[command(flatten)]
    on: OnLog,
}

impl Kernels {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.on.run(output, &[], |split, settings| {
            kernels::compare(split, settings, &self.shapes, &self.two_scales_shapes)
        })
    }
}

/// What learned relevance brings (Figs. 3c and 4b): supports of learned shape against isotropic ones of many sizes
///
/// Every kernel shape of --shapes is tried with points, with isotropic Gaussian supports of each size of --sizes, and with
/// Gaussians learned from the training beams. Held-out beams judge.
#[derive(Args, Debug)]
struct Relevance {
    /// Kernel shapes, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.45,0.7,1.0", value_name = "LIST")]
    shapes: Vec<f32>,
    /// Standard deviations of isotropic supports, in spacings
    #[arg(long, value_delimiter = ',', default_value = "0.3,0.5,0.7", value_name = "LIST")]
    sizes: Vec<f32>,
    #[command(flatten)]
    on: OnLog,
}

impl Relevance {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.on.run(output, &[], |split, settings| relevance::compare(split, settings, &self.shapes, &self.sizes))
    }
}

/// What line segments bring (eqs. 11 and 12) against points on the free part of a beam, at equal cost
///
/// Every segment length of --lengths is tried against points at three densities: the one that is configured, the one that
/// gives as many rows, and the one that takes as many instructions. Held-out beams judge.
#[derive(Args, Debug)]
struct Segments {
    /// Longest segments, in spacings; each line of the lattice cuts once more
    #[arg(long, value_delimiter = ',', default_value = "0.5,1,2,4", value_name = "LIST")]
    lengths: Vec<f32>,
    #[command(flatten)]
    on: OnLog,
}

impl Segments {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.on.run(output, &[], |split, settings| segments::compare(split, settings, &self.lengths))
    }
}

/// What placing supports by data brings over a lattice: the dense posterior, with as many supports and the same kernel
///
/// A lattice over the box around all data, a lattice over the cells that hold data, the centres of k-means clusters, and those
/// clusters' Gaussians. There are no tiles: the cost of a scan grows with the cube of the number of supports. Held-out beams
/// judge.
#[derive(Args, Debug)]
#[command(mut_arg("every", |every| every.default_value("10")))]
#[command(mut_arg("seed", |seed| seed.help("Seed of what is held out and of where clusters begin")))]
struct Placement {
    /// Numbers of supports, each at most 512
    #[arg(long, value_delimiter = ',', default_value = "256,512", value_name = "LIST")]
    counts: Vec<usize>,
    /// Shapes of the squared exponential, in units of the squared pitch of the lattice over the cells that hold data
    #[arg(long, value_delimiter = ',', default_value = "0.6,1.0,2.0", value_name = "LIST")]
    shapes: Vec<f32>,
    /// How many observations a hit counts as when clusters are looked for
    #[arg(long, value_delimiter = ',', default_value = "1,15", value_name = "LIST")]
    hit_weights: Vec<f32>,
    /// A list of scattered supports to place, as `bhm learn supports --cluster` writes it, instead of looking for clusters
    #[arg(long, value_name = "FILE", conflicts_with_all = ["counts", "hit_weights"])]
    list: Option<PathBuf>,
    #[command(flatten)]
    on: OnLog,
}

impl Placement {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        if let Some(count) = self.counts.iter().find(|count| !(1..=MAX_SCATTERED).contains(*count)) {
            return Err(Usage(format!("--counts: {count} supports, expected 1 to {MAX_SCATTERED}")).into());
        }
        let placement = placement::Placement {
            given: self.list.as_deref().map(Clusters::load).transpose()?,
            counts: &self.counts,
            shapes: &self.shapes,
            hit_weights: &self.hit_weights,
            seed: self.on.seed,
        };
        self.on.run(output, &[], |split, settings| placement.compare(split, settings))
    }
}

/// What knowing the poses' uncertainty brings (eq. 13): noisy poses taken as exact against their covariance used
///
/// A simulated robot reports poses with errors of every standard deviation of --position-noise and --heading-noise. Its scans
/// are learned with and without the covariance of those errors. Held-out beams, asked where they really went, judge, and so
/// does the true world at points drawn by lot, of which those count that a map of the noise-free scans knows.
#[derive(Args, Debug)]
struct Poses {
    /// World, route and lidar
    #[arg(long, default_value = "building", value_parser = PossibleValuesParser::new(Scene::names()))]
    scene: String,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of all noise, of what is held out and of what is asked
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviations of the position along each axis, metres
    #[arg(long, value_delimiter = ',', default_value = "0.05,0.1,0.2", value_name = "LIST")]
    position_noise: Vec<f64>,
    /// Standard deviations of the heading, radians
    #[arg(long, value_delimiter = ',', default_value = "0.01,0.03", value_name = "LIST")]
    heading_noise: Vec<f64>,
    #[command(flatten)]
    map: MapOptions,
}

impl Poses {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let poses = poses::Poses {
            scene: Scene::named(&self.scene)?,
            every: self.every as usize,
            seed: self.seed,
            position_noise: &self.position_noise,
            heading_noise: &self.heading_noise,
        };
        output.report(&poses.compare(&options.profile.settings)?)
    }
}

/// What supports look like (Fig. 4): points, learned Gaussians and rectangles, each over the map learned with it
///
/// Also says how well the learned Gaussians lie along the walls, whose directions are those in which the hits near a node
/// spread most. Map options apply, with a spacing of 1 m unless they say otherwise, so that shapes can be seen; the kernel is
/// the squared exponential.
#[derive(Args, Debug)]
struct Shapes {
    /// Folder for the pictures; made if need be
    #[arg(short, long, value_name = "DIR", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    #[command(flatten)]
    on: OnLog,
}

impl Shapes {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        let folder = self.output.as_deref().unwrap_or(Path::new(""));
        self.on
            .run(output, &[("spacing", shapes::SPACING_M)], |split, settings| shapes::compare(split, settings, folder))
    }
}

/// What areas bring where supports are few (Fig. 5): points, rectangles and Gaussians on coarser and coarser lattices
///
/// The kernel keeps its width in metres while the supports move apart, until points no longer see what lies between them.
/// Draws AUC and NLL against the number of samples that stand for a rectangle, and against the distance between supports;
/// held-out beams judge. The numbers of every run are left in a CSV file beside the pictures.
#[derive(Args, Debug)]
struct Granularity {
    /// Folder for the pictures and the numbers; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What is mapped: the site that a robot drives around, or the corner that a fixed lidar watches
    #[arg(long, default_value = granularity::SCENES[0], value_parser = PossibleValuesParser::new(granularity::SCENES))]
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
    #[arg(long, default_value_t = 2.0, value_name = "M")]
    free_spacing: f32,
    /// Also draw the maps of points and of rectangles on the coarse lattice
    #[arg(long)]
    maps: bool,
}

impl Granularity {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        let experiment = granularity::Granularity {
            output: self.output.clone(),
            scene: self.scene.clone(),
            quick: self.quick,
            seeds: self.seeds,
            every: self.every,
            paper: self.paper,
            bias: self.bias,
            free_spacing_m: self.free_spacing,
            maps: self.maps,
        };
        output.report(&experiment.compare()?)
    }
}
