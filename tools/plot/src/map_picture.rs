//! Pictures of a posterior, wherever it lies: in a file, in memory, in shared memory.

use std::path::Path;

use anyhow::Context;
use bhm_core::map::{ModelledMap, Occupancy};
use serde::Serialize;

use crate::{
    knowledge::{KNOWN_DEVIATION, observed},
    picture::{Bounds, Field, FieldPicture},
};

/// Blank space around what was observed, metres.
const MARGIN_M: f32 = 1.0;

/// What is drawn of a posterior.
#[derive(Clone, Copy, Debug)]
pub enum Quantity {
    /// The probability of occupancy.
    Probability,
    /// The standard deviation of the log-odds: how little is known; the last colour is the unknown.
    Deviation,
}

impl Quantity {
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

/// A picture of a posterior.
pub struct MapPicture<'a> {
    /// The posterior.
    pub map: &'a dyn ModelledMap<2>,
    /// What is drawn.
    pub quantity: Quantity,
    /// The part of the plane.
    pub bounds_m: Bounds,
    /// The scale; `None` for 1200 pixels along the longest side.
    pub pixels_per_metre: Option<f32>,
    /// The heading.
    pub title: &'a str,
    /// Where the robot was.
    pub path_m: &'a [[f32; 2]],
}

/// What was drawn.
#[derive(Serialize)]
pub struct Drawn {
    /// Of the map alone.
    pub width_px: u32,
    /// Of the map alone.
    pub height_px: u32,
    /// Lower left corner.
    pub min_m: [f32; 2],
    /// Upper right corner.
    pub max_m: [f32; 2],
}

impl MapPicture<'_> {
    /// Writes it as PNG.
    ///
    /// # Errors
    /// [`PictureError`](crate::picture::PictureError) for what cannot be drawn; if the file cannot be written.
    pub fn write(&self, png: &Path) -> anyhow::Result<Drawn> {
        let picture = FieldPicture {
            bounds_m: self.bounds_m,
            pixels_per_metre: self.pixels_per_metre,
            title: self.title,
            field: self.quantity.field(),
            overlays: &[],
            path_m: self.path_m,
        };
        let canvas = picture.render_all(|points_m| {
            let mut answers = vec![Occupancy::UNKNOWN; points_m.len()];
            self.map.occupancies(points_m, &mut answers);
            answers.iter().map(|answer| self.quantity.value(answer)).collect()
        })?;
        canvas.write_png(png).with_context(|| format!("cannot write {}", png.display()))?;
        let size = canvas.map_area().size;
        let Bounds { min, max } = self.bounds_m;
        Ok(Drawn { width_px: size.width, height_px: size.height, min_m: min, max_m: max })
    }
}

/// What the map has observed with a margin around it, in whole metres; `None` if nothing was.
#[must_use]
pub fn worth_drawing(map: &dyn ModelledMap<2>) -> Option<Bounds> {
    let Bounds { min, max } = observed(map)?;
    Some(Bounds { min: min.map(|m| (m - MARGIN_M).floor()), max: max.map(|m| (m + MARGIN_M).ceil()) })
}
