use std::path::PathBuf;

use bhm_core::geometry::Point;
use bhm_host::snapshot;
use bhm_plot::knowledge::is_known;
use clap::Args;
use serde::Serialize;

use crate::output::{Output, Usage, table};

/// Ask a map about a point
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub(crate) struct Query {
    /// Map file
    map: PathBuf,
    /// Where, metres
    x: f32,
    /// Where, metres
    y: f32,
}

#[derive(Serialize)]
struct Answer {
    x_m: f32,
    y_m: f32,
    /// Whether something was learned about the point.
    known: bool,
    probability: f32,
    log_odds_mean: f32,
    /// Null where the map cannot reach.
    log_odds_variance: Option<f32>,
    probability_gradient_per_m: [f32; 2],
    log_odds_gradient_per_m: [f32; 2],
}

impl Query {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Self { map: path, x, y } = self;
        if !(x.is_finite() && y.is_finite()) {
            return Err(Usage(format!("the point ({x}, {y}) is not finite, expected two numbers of metres")).into());
        }
        let map = snapshot::load(path)?.map;
        let point_m = Point::<2>::new(*x, *y);
        let gradient = map.gradient(&point_m);
        let occupancy = gradient.occupancy;
        let answer = Answer {
            x_m: *x,
            y_m: *y,
            known: is_known(&*map, &point_m, &occupancy),
            probability: occupancy.probability,
            log_odds_mean: occupancy.mean,
            log_odds_variance: occupancy.variance.is_finite().then_some(occupancy.variance),
            probability_gradient_per_m: gradient.probability.into(),
            log_odds_gradient_per_m: gradient.mean.into(),
        };
        output.result(&answer, || {
            let vector = |[x, y]: [f32; 2]| format!("({x:.6}, {y:.6}) per m");
            table(&[
                ("point", format!("({x}, {y}) m")),
                ("state", if answer.known { "known" } else { "unknown" }.to_owned()),
                ("p(occupied)", format!("{:.6}", answer.probability)),
                ("log-odds", format!("{:.6}, standard deviation {:.6}", occupancy.mean, occupancy.variance.sqrt())),
                ("gradient of p", vector(answer.probability_gradient_per_m)),
                ("of log-odds", vector(answer.log_odds_gradient_per_m)),
            ])
        })
    }
}
