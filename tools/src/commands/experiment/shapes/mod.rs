//! What stands at the nodes, and the map that is learned with it (Fig. 4 of the paper).

mod alignment;

use std::path::PathBuf;

use bhm_core::{
    kernel::{Averaging, KernelChoice},
    lattice::{Lattice, Node, offsets},
    settings::Settings,
    support::{AnySupport, SupportChoice, SupportTable},
};
use bhm_host::{
    map::AnyMap,
    supports::{LearnedSupports, RelevanceOptions, learn_relevance},
};
use bhm_tools::picture::{Bounds, Overlay, Rgb888, Shape};
use clap::Args;
use serde::Serialize;

use self::alignment::{Alignment, alignment};
use super::trial::{Exam, Marks, table, take};
use crate::plates::Plates;
use crate::{
    drawing::worth_drawing,
    options::{MapOptions, Number},
    output::{Output, Usage},
};

/// What supports look like (Fig. 4): points, learned Gaussians and rectangles, each over the map learned with it
///
/// Also says how well the learned Gaussians lie along the walls, whose directions are those in which the hits near a node
/// spread most. Map options apply, with a spacing of 1 m unless they say otherwise, so that shapes can be seen; the kernel is
/// the squared exponential.
#[derive(Args, Debug)]
pub(crate) struct Shapes {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Folder for the pictures; made if need be
    #[arg(short, long, value_name = "DIR", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of what is held out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

/// Distance between supports at which a picture of a building shows them, metres.
const SPACING_M: f32 = 1.0;

/// Seen on free, unknown and occupied alike.
const COLOUR: Rgb888 = Rgb888::new(225, 30, 45);

#[derive(Serialize)]
struct Report {
    spacing_m: f32,
    alignment: Alignment,
    contestants: Vec<Marks>,
    pictures: Vec<PathBuf>,
}

/// A kind of support, and how it is drawn.
struct Subject {
    file: &'static str,
    name: &'static str,
    legend: &'static str,
    settings: Settings,
    supports: Option<&'static LearnedSupports>,
}

impl Shapes {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective_with(&[(Number::Spacing, SPACING_M)])? else { return Ok(()) };
        let (Some(log), Some(folder)) = (&self.log, &self.output) else { return Ok(()) };
        let points = Settings {
            kernel: KernelChoice::SquaredExponential,
            support: SupportChoice::PointSupport,
            ..options.profile.settings
        };
        let rectangles = Settings {
            support: SupportChoice::RectangularSupport,
            support_size: 1.0,
            support_averaging: Averaging::Exact,
            ..points
        };
        for settings in [points, rectangles] {
            settings.fitted(SupportTable::EMPTY).model().map_err(|error| Usage(error.to_string()))?;
        }
        let exam = Exam::of_log(log, &options, self.every as usize, 0.1, self.seed)?;
        let mut plates = Plates::into(folder)?;
        let learned = learn_relevance(|| &exam.scans, &points, &RelevanceOptions::DEFAULT, String::new())?;
        let learned = learned.supports.interned();

        let subject = |file, name, legend, settings, supports| Subject { file, name, legend, settings, supports };
        let subjects = [
            subject("shapes-a-points.png", "points", "points", points, None),
            subject(
                "shapes-b-gaussians.png",
                "learned Gaussians",
                "Gaussians at 1 sigma, else points",
                points,
                Some(learned),
            ),
            subject("shapes-c-rectangles.png", "rectangles", "rectangles of one spacing", rectangles, None),
        ];
        let mut contestants = Vec::new();
        // The same part of the plane in all pictures: what the first map knows.
        let mut bounds_m = None;
        for subject in subjects {
            let (marks, map) = take(&exam, subject.name, subject.settings, subject.supports)?;
            let bounds_m = match bounds_m {
                Some(bounds_m) => bounds_m,
                None => *bounds_m.insert(observed(&*map)?),
            };
            let shapes = shapes(&map.model().basis.lattice, &bounds_m, &subject);
            let overlay = Overlay { legend: subject.legend, colour: COLOUR, shapes: &shapes };
            let title = format!("{}, {} m apart", subject.name, subject.settings.spacing_m);
            plates.map(subject.file, &title, bounds_m, &[overlay], &*map)?;
            contestants.push(marks);
        }
        let report = Report {
            spacing_m: points.spacing_m,
            alignment: alignment(&exam.scans, points.limits.range_max_m, learned),
            contestants,
            pictures: plates.files.clone(),
        };
        output.result(&report, || table(&report.contestants) + "\n" + &report.alignment.text() + "\n" + &plates.list())
    }
}

fn observed(map: &dyn AnyMap) -> anyhow::Result<Bounds> {
    worth_drawing(&map.model(), &map.tile_indices(), |point_m| map.occupancy(point_m))
        .ok_or_else(|| anyhow::anyhow!("the map has learned nothing that could be drawn"))
}

/// The supports of the nodes within the bounds.
fn shapes(lattice: &Lattice<2>, bounds_m: &Bounds, subject: &Subject) -> Vec<Shape> {
    let node_below = |axis: usize, metres: f32| ((metres - lattice.origin_m[axis]) / lattice.spacing_m).floor() as i32;
    let [first, last] = [bounds_m.min, bounds_m.max].map(|corner| [0, 1].map(|axis| node_below(axis, corner[axis])));
    let width = [0, 1].map(|axis| (last[axis] - first[axis]).max(0) as usize);
    let table = subject.supports.map_or(SupportTable::EMPTY, LearnedSupports::table);
    offsets(width)
        .map(|offset| {
            // The node below a bound lies outside or on the edge.
            let node: Node<2> = [0, 1].map(|axis| first[axis] + 1 + offset[axis] as i32);
            let at_m = lattice.position_m(&node).into();
            match (table.get(&node), subject.settings.support) {
                (Some(AnySupport::GaussianSupport(gaussian)), _) => {
                    let s = gaussian.covariance_m2();
                    Shape::Ellipse { centre_m: at_m, covariance_m2: [s[(0, 0)], s[(0, 1)], s[(1, 1)]], sigmas: 1.0 }
                }
                (None, SupportChoice::RectangularSupport) => {
                    let side_m = subject.settings.support_size * lattice.spacing_m;
                    Shape::Rectangle { centre_m: at_m, sides_m: [side_m; 2] }
                }
                _ => Shape::Point { at_m },
            }
        })
        .collect()
}
