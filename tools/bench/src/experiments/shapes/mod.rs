//! What stands at the nodes, and the map that is learned with it (Fig. 4 of the paper).

mod alignment;

use std::path::{Path, PathBuf};

use bhm_core::{
    kernel::{KernelSettings, SquaredExponentialSettings},
    lattice::{Lattice, Node, offsets},
    settings::Settings,
    support::{AnySupport, PointSettings, RectangleSettings, SupportSettings, SupportTable},
};
use bhm_host::{
    map::AnyMap,
    supports::{LearnedSupports, RelevanceOptions, learn_relevance},
};
use bhm_plot::{
    folder::PictureFolder,
    map_picture::worth_drawing,
    picture::{Bounds, Overlay, Rgb888, Shape},
};
use serde::Serialize;

use self::alignment::{Alignment, alignment};
use super::{NoColumns, Table, Trial, Variant};
use crate::{evaluation::BeamSplit, text::Report};

/// Distance between supports at which a picture of a building shows them, metres.
pub const SPACING_M: f32 = 1.0;

/// Seen on free, unknown and occupied alike.
const COLOUR: Rgb888 = Rgb888::new(225, 30, 45);

/// What came of it.
#[derive(Serialize)]
pub struct Drawn {
    spacing_m: f32,
    alignment: Alignment,
    contestants: Table<NoColumns>,
    pictures: Vec<PathBuf>,
}

/// Learns, asks and draws each kind of support; the folder is made if need be.
///
/// # Errors
/// If a file cannot be written, or a contestant cannot learn all that it is shown.
pub fn compare(split: &BeamSplit, base: &Settings, folder: &Path) -> anyhow::Result<Drawn> {
    let kernel = match base.kernel {
        exponential @ KernelSettings::SquaredExponential(_) => exponential,
        _ => KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT),
    };
    let points = Settings { kernel, support: SupportSettings::PointSupport(PointSettings::DEFAULT), ..*base };
    let rectangles = Settings { support: SupportSettings::RectangularSupport(RectangleSettings::DEFAULT), ..points };
    for settings in [points, rectangles] {
        settings.fitted(&SupportTable::EMPTY).model()?;
    }
    let mut pictures = PictureFolder::into(folder)?;
    let learned = learn_relevance(|| &split.training, &points, &RelevanceOptions::DEFAULT, String::new())?;
    let learned = learned.supports;

    let gaussians = Variant::new("learned Gaussians", points).with_supports(learned.clone());
    let subjects = [
        ("shapes-a-points.png", "points", Variant::new("points", points)),
        ("shapes-b-gaussians.png", "Gaussians at 1 sigma, else points", gaussians),
        ("shapes-c-rectangles.png", "rectangles of one spacing", Variant::new("rectangles", rectangles)),
    ];
    let mut trials: Vec<Trial> = Vec::new();
    // The same part of the plane in all pictures: what the first map knows.
    let mut bounds_m = None;
    for (file, legend, variant) in subjects {
        let (trial, map) = Trial::run(split, &variant)?;
        let bounds_m = match bounds_m {
            Some(bounds_m) => bounds_m,
            None => *bounds_m.insert(observed(&*map)?),
        };
        let shapes = shapes(&map.model().basis.lattice, &bounds_m, &variant);
        let overlay = Overlay { legend, colour: COLOUR, shapes: &shapes };
        let title = format!("{}, {} m apart", variant.name, points.spacing_m);
        pictures.map(file, &title, bounds_m, &[overlay], |at| map.occupancy(at))?;
        trials.push(trial);
    }
    let drawn = Drawn {
        spacing_m: points.spacing_m,
        alignment: alignment(&split.training, points.limits.range_max_m, &learned),
        contestants: Table::of(trials),
        pictures: pictures.files,
    };
    Ok(drawn)
}

impl Report for Drawn {
    fn text(&self) -> String {
        let Self { contestants, alignment, pictures, .. } = self;
        contestants.text() + "\n" + &alignment.text() + "\n" + &bhm_plot::folder::list(pictures)
    }
}

fn observed(map: &dyn AnyMap) -> anyhow::Result<Bounds> {
    worth_drawing(map).ok_or_else(|| anyhow::anyhow!("the map has learned nothing that could be drawn"))
}

/// The supports of the nodes within the bounds.
fn shapes(lattice: &Lattice<2>, bounds_m: &Bounds, variant: &Variant) -> Vec<Shape> {
    let node_below = |axis: usize, metres: f32| ((metres - lattice.origin_m[axis]) / lattice.spacing_m).floor() as i32;
    let [first, last] = [bounds_m.min, bounds_m.max].map(|corner| [0, 1].map(|axis| node_below(axis, corner[axis])));
    let width = [0, 1].map(|axis| (last[axis] - first[axis]).max(0) as usize);
    let table = variant.supports.as_ref().map(LearnedSupports::table);
    offsets(width)
        .map(|offset| {
            // The node below a bound lies outside or on the edge.
            let node: Node<2> = [0, 1].map(|axis| first[axis] + 1 + offset[axis] as i32);
            let at_m = lattice.position_m(&node).into();
            match (table.and_then(|table| table.get(&node)), variant.settings.support) {
                (Some(AnySupport::GaussianSupport(gaussian)), _) => {
                    let s = gaussian.covariance_m2();
                    Shape::Ellipse { centre_m: at_m, covariance_m2: [s[(0, 0)], s[(0, 1)], s[(1, 1)]], sigmas: 1.0 }
                }
                (None, SupportSettings::RectangularSupport(rectangle)) => {
                    let side_m = rectangle.size * lattice.spacing_m;
                    Shape::Rectangle { centre_m: at_m, sides_m: [side_m; 2] }
                }
                _ => Shape::Point { at_m },
            }
        })
        .collect()
}
