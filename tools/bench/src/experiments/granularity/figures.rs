//! The two pictures: against samples, and against the lattice.

use bhm_plot::{
    chart::{Axis, Chart, Figure, Layout, Sample, Scale, Series},
    folder::PictureFolder,
};

use super::{Dataset, NODE_SUPPORTS, NodeSupport, result::Row};
use crate::metrics::Spread;

const BARS: &str = "mean ± 2 sigma over seeds";

/// A name and its points for each chart, AUC and NLL.
type Line = (String, [Vec<Sample>; 2]);

pub(super) fn draw(data: &Dataset, rows: &[Row], pictures: &mut PictureFolder) -> anyhow::Result<()> {
    let Dataset { scene, shape_m2, coarse_m, .. } = data;
    let samples = Axis { label: "samples per rectangle", scale: Scale::Logarithmic };
    let title = format!("{scene}: rectangles {coarse_m} m apart, G = {shape_m2} m²");
    write(pictures, &format!("granularity-{scene}-samples.png"), &title, samples, &against_samples(rows, *coarse_m))?;

    let spacing = Axis { label: "distance between supports [m]", scale: Scale::Linear };
    let title = format!("{scene}: what stands at the nodes, G = {shape_m2} m²");
    let lines: Vec<Line> = NODE_SUPPORTS.iter().map(|support| against_spacing(rows, *support)).collect();
    write(pictures, &format!("granularity-{scene}.png"), &title, spacing, &lines)
}

/// What a row adds to a line at `x`.
fn add(line: &mut Line, x: f64, row: &Row) {
    let sample = |spread: Spread| Sample { x, y: spread.mean, error: (spread.count > 1).then_some(spread.two_sigma) };
    for (points, spread) in line.1.iter_mut().zip([row.auc, row.nll]) {
        points.extend(spread.map(sample));
    }
}

fn against_spacing(rows: &[Row], support: NodeSupport) -> Line {
    let mut line = (support.name(), Default::default());
    for row in rows.iter().filter(|row| row.support == support) {
        add(&mut line, f64::from(row.spacing_m), row);
    }
    line
}

/// Sampled rectangles on one lattice, and the closed form as a level line across them.
fn against_samples(rows: &[Row], spacing_m: f32) -> [Line; 2] {
    let mut lines = ["sampled", "closed form"].map(|name| (name.to_owned(), Default::default()));
    let here = || rows.iter().filter(|row| row.spacing_m == spacing_m);
    let mut sampled: Vec<(u32, &Row)> = here()
        .filter_map(|row| match row.support {
            NodeSupport::Sampled(a_side) => Some((a_side * a_side, row)),
            _ => None,
        })
        .collect();
    sampled.sort_by_key(|(count, _)| *count);
    for (count, row) in sampled {
        add(&mut lines[0], f64::from(count), row);
        for exact in here().filter(|row| row.support == NodeSupport::Exact) {
            add(&mut lines[1], f64::from(count), exact);
        }
    }
    lines
}

fn write(pictures: &mut PictureFolder, file: &str, title: &str, x: Axis<'_>, lines: &[Line]) -> anyhow::Result<()> {
    let series = |chart: usize| -> Vec<Series<'_>> {
        let all = lines.iter().map(|(name, points)| Series { name, points: &points[chart] });
        all.filter(|series| !series.points.is_empty()).collect()
    };
    let [auc, nll] = [series(0), series(1)];
    let y = |label| Axis { label, scale: Scale::Linear };
    let charts = [
        Chart { title: "Area under the ROC curve", x, y: y("AUC"), series: &auc },
        Chart { title: "Negative log-likelihood of what was held out", x, y: y("NLL [nat]"), series: &nll },
    ];
    pictures.figure(file, &Figure { title, bars: BARS, layout: Layout::SideBySide, charts: &charts })
}
