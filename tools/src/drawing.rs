//! Pictures of a posterior, wherever it lies: in a file, in memory, in shared memory.

use std::path::Path;

use anyhow::Context;
use bhm_core::{
    geometry::Point,
    settings::Model,
    tile::{Occupancy, TileIndex},
};
use bhm_tools::picture::{Bounds, Field, FieldPicture};
use clap::ValueEnum;
use serde::Serialize;

use crate::{
    known::{KNOWN_DEVIATION, Knowledge},
    output::Usage,
};

/// Blank space around what was observed, metres.
const MARGIN_M: f32 = 1.0;

/// What to draw of a posterior.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum What {
    /// The probability of occupancy
    Probability,
    /// The standard deviation of the log-odds: how little is known; the last colour is the unknown
    Deviation,
}

impl What {
    fn field(self) -> Field {
        match self {
            Self::Probability => Field::PROBABILITY,
            Self::Deviation => Field::standard_deviation(KNOWN_DEVIATION),
        }
    }

    fn value(self, occupancy: &Occupancy) -> f32 {
        match self {
            Self::Probability => occupancy.probability,
            Self::Deviation => occupancy.variance.sqrt(),
        }
    }
}

/// A picture of a posterior that is asked by `occupancy`.
pub(crate) struct Drawing<'a, F> {
    pub(crate) what: What,
    pub(crate) bounds_m: Bounds,
    pub(crate) pixels_per_metre: Option<f32>,
    pub(crate) title: &'a str,
    pub(crate) path_m: &'a [[f32; 2]],
    pub(crate) occupancy: F,
}

/// What was drawn.
#[derive(Serialize)]
pub(crate) struct Drawn {
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) min_m: [f32; 2],
    pub(crate) max_m: [f32; 2],
}

impl<F: Fn(&Point<2>) -> Occupancy> Drawing<'_, F> {
    /// Writes it as PNG.
    ///
    /// # Errors
    /// [`Usage`] for what cannot be drawn; if the file cannot be written.
    pub(crate) fn write(&self, png: &Path) -> anyhow::Result<Drawn> {
        let picture = FieldPicture {
            bounds_m: self.bounds_m,
            pixels_per_metre: self.pixels_per_metre,
            title: self.title,
            field: self.what.field(),
            overlays: &[],
            path_m: self.path_m,
        };
        let canvas = picture
            .render(|x, y| self.what.value(&(self.occupancy)(&Point::<2>::new(x, y))))
            // The map is as it is; what cannot be drawn was asked for.
            .map_err(|error| Usage(error.to_string()))?;
        canvas.write_png(png).with_context(|| format!("cannot write {}", png.display()))?;
        let size = canvas.map_area().size;
        let Bounds { min, max } = self.bounds_m;
        Ok(Drawn { width_px: size.width, height_px: size.height, min_m: min, max_m: max })
    }
}

/// What was observed in these tiles with a margin around it, in whole metres; `None` if nothing was.
pub(crate) fn worth_drawing(
    model: &Model<'_>,
    tiles: &[TileIndex<2>],
    occupancy: impl Fn(&Point<2>) -> Occupancy,
) -> Option<Bounds> {
    let Bounds { min, max } = Knowledge::of(model).observed(tiles, occupancy)?;
    Some(Bounds { min: min.map(|m| (m - MARGIN_M).floor()), max: max.map(|m| (m + MARGIN_M).ceil()) })
}
