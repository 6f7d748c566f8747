use std::path::PathBuf;

use anyhow::Context;
use bhm_host::snapshot::{self, Snapshot};
use bhm_plot::{
    map_picture::{Drawn, MapPicture, Quantity, worth_drawing},
    picture::Bounds,
};
use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::output::{Output, table};

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

/// What to draw of a posterior.
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
    #[serde(flatten)]
    drawn: Drawn,
}

impl Render {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Snapshot { map, extras } = snapshot::load(&self.map)?;
        let bounds_m = self.bounds.or_else(|| worth_drawing(&*map)).with_context(|| {
            format!("{}: the map has learned nothing yet; say with --bounds what to draw", self.map.display())
        })?;
        let file_name = self.map.file_name().unwrap_or_default().to_string_lossy();
        let picture = MapPicture {
            map: &*map,
            quantity: match self.what {
                What::Probability => Quantity::Probability,
                What::Deviation => Quantity::Deviation,
            },
            bounds_m,
            pixels_per_metre: self.scale,
            title: self.title.as_deref().unwrap_or(&file_name),
            path_m: if self.no_path { &[] } else { &extras.path_m },
        };
        let rendered = Rendered { png: self.output.clone(), drawn: picture.write(&self.output)? };
        output.result(&rendered, || {
            let Drawn { width_px, height_px, min_m, max_m } = rendered.drawn;
            table(&[
                ("picture", self.output.display().to_string()),
                ("map", format!("{width_px} x {height_px} pixels")),
                ("area", format!("x {} to {} m, y {} to {} m", min_m[0], max_m[0], min_m[1], max_m[1])),
            ])
        })
    }
}

fn bounds(text: &str) -> Result<Bounds, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x_min, y_min, x_max, y_max]) => Ok(Bounds { min: [x_min, y_min], max: [x_max, y_max] }),
        _ => Err("expected four numbers of metres, XMIN,YMIN,XMAX,YMAX".to_owned()),
    }
}
