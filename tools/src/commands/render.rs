use std::path::PathBuf;

use anyhow::Context;
use bhm_core::geometry::Point;
use bhm_host::{
    map::AnyMap,
    snapshot::{self, Snapshot},
};
use bhm_tools::picture::{Bounds, Field, FieldPicture};
use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::{
    known::{KNOWN_DEVIATION, Knowledge},
    output::{Output, Usage, table},
};

/// Blank space around what was observed, metres.
const MARGIN_M: f32 = 1.0;

/// Draw a map as PNG, with scale, colour bar and the robot's path
#[derive(Args, Debug)]
pub(crate) struct Render {
    /// Map file
    map: PathBuf,
    /// PNG file to write
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// What to draw
    #[arg(long, value_enum, default_value_t = What::Probability)]
    what: What,
    /// The part of the plane to draw, metres [default: what was observed]
    #[arg(long, value_name = "XMIN,YMIN,XMAX,YMAX", value_parser = bounds, allow_hyphen_values = true)]
    bounds: Option<Bounds>,
    /// Pixels per metre [default: 1200 for the longest side]
    #[arg(long, value_name = "PX")]
    scale: Option<f32>,
    /// Heading [default: the map file's name]
    #[arg(long)]
    title: Option<String>,
    /// Leave the robot's path out
    #[arg(long)]
    no_path: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum What {
    /// The probability of occupancy
    Probability,
    /// The standard deviation of the log-odds: how little is known; the last colour is the unknown
    Deviation,
}

#[derive(Serialize)]
struct Rendered {
    png: PathBuf,
    width_px: u32,
    height_px: u32,
    min_m: [f32; 2],
    max_m: [f32; 2],
}

impl Render {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Snapshot { map, extras } = snapshot::load(&self.map)?;
        let bounds_m = match self.bounds {
            Some(bounds) => bounds,
            None => self.observed(&*map)?,
        };
        let file_name = self.map.file_name().unwrap_or_default().to_string_lossy();
        let picture = FieldPicture {
            bounds_m,
            pixels_per_metre: self.scale,
            title: self.title.as_deref().unwrap_or(&file_name),
            field: match self.what {
                What::Probability => Field::PROBABILITY,
                What::Deviation => Field::standard_deviation(KNOWN_DEVIATION),
            },
            path_m: if self.no_path { &[] } else { &extras.path_m },
        };
        let canvas = picture
            .render(|x, y| {
                let occupancy = map.occupancy(&Point::<2>::new(x, y));
                match self.what {
                    What::Probability => occupancy.probability,
                    What::Deviation => occupancy.variance.sqrt(),
                }
            })
            // The map is as it is; what cannot be drawn was asked for.
            .map_err(|error| Usage(error.to_string()))?;
        canvas.write_png(&self.output).with_context(|| format!("cannot write {}", self.output.display()))?;

        let size = canvas.map_area().size;
        let Bounds { min, max } = bounds_m;
        let rendered =
            Rendered { png: self.output.clone(), width_px: size.width, height_px: size.height, min_m: min, max_m: max };
        output.result(&rendered, || {
            table(&[
                ("picture", self.output.display().to_string()),
                ("map", format!("{} x {} pixels", size.width, size.height)),
                ("area", format!("x {} to {} m, y {} to {} m", min[0], max[0], min[1], max[1])),
            ])
        })
    }

    fn observed(&self, map: &dyn AnyMap) -> anyhow::Result<Bounds> {
        let model = map.settings().model()?;
        let observed = Knowledge::of(&model).observed(map);
        let Bounds { min, max } = observed.with_context(|| {
            format!("{}: the map has learned nothing yet; say with --bounds what to draw", self.map.display())
        })?;
        Ok(Bounds { min: min.map(|m| (m - MARGIN_M).floor()), max: max.map(|m| (m + MARGIN_M).ceil()) })
    }
}

fn bounds(text: &str) -> Result<Bounds, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x_min, y_min, x_max, y_max]) => Ok(Bounds { min: [x_min, y_min], max: [x_max, y_max] }),
        _ => Err("expected four numbers of metres, XMIN,YMIN,XMAX,YMAX".to_owned()),
    }
}
