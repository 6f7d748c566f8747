use std::path::{Path, PathBuf};

use bhm_bench::scattered::{Cluster, ClusterOptions, Clusters, learn_clusters};
use bhm_core::{kernel::KernelSettings, relevance::RelevanceSettings, settings::Settings};
use bhm_host::{
    ScanRecord,
    supports::{self, RelevanceOptions, learn_relevance},
};
use clap::Args;
use serde::Serialize;

use crate::{
    options::MapOptions,
    output::{Output, Usage, bytes, table},
};

/// Learn which places call for wide supports and which for narrow ones (relevance detection)
///
/// EM of a Gaussian mixture whose means stay on the lattice: a support between walls grows round, one on a wall grows along
/// it, one without data becomes a point. Scans stream by; memory is 40 bytes for each lattice node that the log reaches.
/// Every command that maps takes the file by --supports, with the same spacing. With --cluster, a list of supports that lie
/// where the data does instead, which `bhm experiment placement` takes.
#[derive(Args, Debug)]
pub(crate) struct Supports {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// File of supports to write
    #[arg(short, long, value_name = "FILE", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    /// Passes of EM over the log
    #[arg(long, default_value_t = RelevanceOptions::DEFAULT.passes, value_parser = clap::value_parser!(u32).range(1..=100),
        value_name = "N")]
    em_passes: u32,
    /// How many observations a hit counts as: there are several free points to a hit
    #[arg(long, default_value_t = RelevanceOptions::DEFAULT.hit_weight, value_name = "X")]
    hit_weight: f32,
    /// So many observations at the node itself does each support begin with: without more than that it stays a point
    #[arg(long, default_value_t = RelevanceSettings::DEFAULT.pseudo_count, value_name = "X")]
    pseudo_count: f32,
    /// Largest standard deviation of a support along any direction, in spacings
    #[arg(long, default_value_t = RelevanceSettings::DEFAULT.max_deviation, value_name = "X")]
    max_deviation: f32,
    /// Instead of shapes on the lattice, learn so many places off it: clusters of the hits and free points (k-means)
    #[arg(long, value_name = "N", conflicts_with_all = ["em_passes", "pseudo_count", "max_deviation"])]
    cluster: Option<usize>,
    /// Seed of where clusters begin
    #[arg(long, default_value_t = ClusterOptions::DEFAULT.seed, requires = "cluster")]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

#[derive(Serialize)]
struct ShapesLearned {
    output: PathBuf,
    bytes: usize,
    hits: u64,
    free: u64,
    unplaced: u64,
    nodes: usize,
    points: usize,
    gaussians: usize,
    /// Square root of the mean variance of those, in spacings, along their widest and their narrowest direction.
    mean_deviations: [f32; 2],
}

impl Supports {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let (Some(log), Some(file)) = (&self.log, &self.output) else { return Ok(()) };
        for (name, value) in [
            ("hit-weight", self.hit_weight),
            ("pseudo-count", self.pseudo_count),
            ("max-deviation", self.max_deviation),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Usage(format!("--{name} is {value}, expected a positive number")).into());
            }
        }
        let settings: &Settings = &options.profile.settings;
        let scans = options.read(log)?;
        if let Some(clusters) = self.cluster {
            return self.cluster(clusters, &scans.scans, settings, file, output);
        }
        let relevance = RelevanceOptions {
            passes: self.em_passes,
            hit_weight: self.hit_weight,
            settings: RelevanceSettings { pseudo_count: self.pseudo_count, max_deviation: self.max_deviation },
        };
        let name = log.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let source = format!("relevance detection on {name}, {} passes", self.em_passes);
        let learned = learn_relevance(|| &scans.scans, settings, &relevance, source)?;
        if matches!(settings.kernel, KernelSettings::CubicBSpline(_)) {
            tracing::warn!(
                "the {} blurs by quadrature, which is slow; map with --kernel squared-exponential",
                settings.kernel.name()
            );
        }
        supports::save(file, &learned.supports)?;
        let report = ShapesLearned::of(file, &learned, settings.spacing_m);
        output.result(&report, || report.text())
    }
}

#[derive(Serialize)]
struct ClustersLearned {
    output: PathBuf,
    bytes: usize,
    supports: usize,
    /// Observations, hits counting as several.
    weight: f64,
    /// Square root of the mean variance of a cluster along an axis, metres.
    mean_deviation_m: f64,
}

impl Supports {
    /// Learns places off the lattice.
    fn cluster(
        &self,
        clusters: usize,
        scans: &[ScanRecord],
        settings: &Settings,
        file: &Path,
        output: &Output,
    ) -> anyhow::Result<()> {
        let options =
            ClusterOptions { clusters, hit_weight: self.hit_weight, seed: self.seed, ..ClusterOptions::DEFAULT };
        let clusters = learn_clusters(|| scans, settings, &options)?;
        let log = self.log.as_deref().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let found = Clusters { source: format!("{} clusters of {log}", clusters.len()), clusters };
        let weight: f64 = found.clusters.iter().map(|cluster| cluster.weight).sum();
        let spread =
            |cluster: &Cluster| cluster.weight * 0.5 * f64::from(cluster.covariance_m2[0] + cluster.covariance_m2[2]);
        let report = ClustersLearned {
            output: file.to_owned(),
            bytes: found.save(file)?,
            supports: found.clusters.len(),
            weight,
            mean_deviation_m: (found.clusters.iter().map(spread).sum::<f64>() / weight).sqrt(),
        };
        output.result(&report, || {
            table(&[
                ("supports", format!("{} off the lattice", report.supports)),
                ("deviations", format!("{:.3} m on average", report.mean_deviation_m)),
                ("written", format!("{} ({})", file.display(), bytes(report.bytes))),
            ])
        })
    }
}

impl ShapesLearned {
    fn of(file: &Path, learned: &supports::LearnedRelevance, spacing_m: f32) -> Self {
        let shapes = learned.supports.supports();
        let mut deviations = [0.0_f32; 2];
        let mut gaussians = 0;
        for support in shapes {
            let bhm_core::support::AnySupport::GaussianSupport(support) = support else { continue };
            let s = support.covariance_m2();
            let (middle, half) = (0.5 * (s[(0, 0)] + s[(1, 1)]), 0.5 * (s[(0, 0)] - s[(1, 1)]));
            let radius = half.hypot(s[(0, 1)]);
            deviations[0] += middle + radius;
            deviations[1] += middle - radius;
            gaussians += 1;
        }
        Self {
            output: file.to_owned(),
            bytes: supports::encode(&learned.supports).len(),
            hits: learned.observations[0],
            free: learned.observations[1],
            unplaced: learned.unplaced,
            nodes: shapes.len(),
            points: shapes.len() - gaussians,
            gaussians,
            mean_deviations: deviations.map(|sum| (sum / gaussians.max(1) as f32).max(0.0).sqrt() / spacing_m),
        }
    }

    fn text(&self) -> String {
        let [wide, narrow] = self.mean_deviations;
        table(&[
            ("learned from", format!("{} hits, {} free points, {} unplaced", self.hits, self.free, self.unplaced)),
            ("supports", format!("{} Gaussians and {} points on {} nodes", self.gaussians, self.points, self.nodes)),
            ("deviations", format!("{wide:.3} by {narrow:.3} spacings on average")),
            ("written", format!("{} ({})", self.output.display(), bytes(self.bytes))),
        ])
    }
}
