//! Figures 6, 8a and 8b: scores and run time against scans, and what is said of unseen places.

use bhm_plot::chart::{Axis, Chart, Figure, Layout, Sample, Scale, Series};

use super::{COARSE, FINE, SMALL_DENSE, page::Page};
use crate::{
    contest::{Checkpoint, Outcome},
    text::headed,
};

/// Who is drawn: a figure tells eight apart.
const DRAWN: [&str; 8] = [
    FINE,
    COARSE,
    "vsdgpom",
    "gaussian-process",
    SMALL_DENSE,
    "diagonal-bhm-mean-field",
    "hilbert-sparse",
    "counting-grid",
];

/// Updates that a point of a curve of run times averages, as a share of the run.
const TIME_POINTS: usize = 30;

/// The curves of one figure: names, and points.
type Curves = Vec<(String, Vec<Sample>)>;

fn is_drawn(outcome: &Outcome) -> bool {
    DRAWN.iter().any(|name| outcome.contestant == *name || outcome.contestant.split(':').next() == Some(name))
}

/// Those drawn, of the first seed, with this held out, dataset by dataset.
fn datasets<'a>(outcomes: &'a [Outcome], held: &str) -> Vec<(&'a str, Vec<&'a Outcome>)> {
    let mut groups: Vec<(&str, Vec<&Outcome>)> = Vec::new();
    let first = outcomes.iter().map(|outcome| outcome.seed).min();
    for outcome in outcomes.iter().filter(|o| o.held == held && Some(o.seed) == first && is_drawn(o)) {
        match groups.iter_mut().find(|(dataset, _)| *dataset == outcome.dataset) {
            Some((_, group)) => group.push(outcome),
            None => groups.push((&outcome.dataset, vec![outcome])),
        }
    }
    groups
}

fn curves(group: &[&Outcome], points: impl Fn(&Outcome) -> Vec<Sample>) -> Curves {
    group.iter().map(|outcome| (outcome.contestant.clone(), points(outcome))).filter(|(_, p)| !p.is_empty()).collect()
}

fn series(curves: &Curves) -> Vec<Series<'_>> {
    curves.iter().map(|(name, points)| Series { name, points }).collect()
}

/// A chart for each dataset, with a curve for each contestant.
struct Curve {
    /// What its file's name begins with.
    file: &'static str,
    title: &'static str,
    chart: &'static str,
    x: Axis<'static>,
    y: Axis<'static>,
}

impl Curve {
    /// Draws it where there is anything to be drawn.
    fn draw(
        &self,
        page: &mut Page,
        outcomes: &[Outcome],
        held: &str,
        points: impl Fn(&Outcome) -> Vec<Sample>,
    ) -> anyhow::Result<()> {
        for (dataset, group) in datasets(outcomes, held) {
            let curves = curves(&group, &points);
            if curves.is_empty() {
                continue;
            }
            let chart = Chart { title: self.chart, x: self.x, y: self.y, series: &series(&curves) };
            let title = format!("Dataset {dataset}: {}", self.title);
            page.chart(&format!("{}-{}.png", self.file, number(dataset)), &title, chart)?;
        }
        Ok(())
    }
}

fn sample(x: f64, y: f64) -> Sample {
    Sample { x, y, error: None }
}

/// Figure 6: AUC and NLL against scans.
pub(super) fn scores(page: &mut Page, outcomes: &[Outcome]) -> anyhow::Result<()> {
    page.section("Fig. 6: AUC and NLL against scans");
    page.text(
        "On questions about scans seen so far (points held out, at most 4 000 of them at a time). A curve \
         that ends early was stopped by its deadline.\n",
    );
    for (dataset, group) in datasets(outcomes, "points") {
        let of = |value: fn(&Checkpoint) -> Option<f64>| {
            curves(&group, |outcome| {
                let points = outcome
                    .curve
                    .iter()
                    .filter_map(|checkpoint| Some(sample(checkpoint.scans as f64, value(checkpoint)?)));
                points.collect()
            })
        };
        let (auc, nll) = (of(|checkpoint| checkpoint.auc), of(|checkpoint| Some(checkpoint.nll.max(1e-4))));
        if auc.is_empty() || nll.is_empty() {
            continue;
        }
        let x = Axis { label: "scans", scale: Scale::Linear };
        let (auc_series, nll_series) = (series(&auc), series(&nll));
        let charts = [
            Chart { title: "AUC", x, y: Axis { label: "AUC", scale: Scale::Linear }, series: &auc_series },
            Chart { title: "NLL", x, y: Axis { label: "NLL, nats", scale: Scale::Logarithmic }, series: &nll_series },
        ];
        let title = format!("Dataset {dataset}: scores against scans");
        let figure = Figure { title: &title, bars: "", layout: Layout::SideBySide, charts: &charts };
        page.figure(&format!("fig6-{}.png", number(dataset)), &figure)?;
    }
    Ok(())
}

/// Figure 8a: run time per update against scans.
pub(super) fn run_times(page: &mut Page, outcomes: &[Outcome]) -> anyhow::Result<()> {
    page.section("Fig. 8a: run time of an update against scans");
    page.text(
        "Median time of the processor over a thirtieth of the run. The paper's figure: BHM stays flat, VSDGPOM grows with its \
         inducing points. Ours is flat because it depends on the tiles that a scan touches, and on nothing that was before; \
         VSDGPOM grows with the explored area until its inducing points are all placed.\n",
    );
    let chart = Curve {
        file: "fig8a",
        title: "run time against scans",
        chart: "time of an update",
        x: Axis { label: "scans", scale: Scale::Linear },
        y: Axis { label: "ms", scale: Scale::Logarithmic },
    };
    chart.draw(page, outcomes, "points", |outcome| {
        let window = outcome.scans.div_ceil(TIME_POINTS).max(1);
        let middle = |part: &[f32]| {
            let mut sorted = part.to_vec();
            sorted.sort_unstable_by(f32::total_cmp);
            f64::from(sorted[sorted.len() / 2])
        };
        let of = |(index, part): (usize, &[f32])| sample((index * window + part.len()) as f64, middle(part).max(1e-4));
        outcome.update_ms.chunks(window).enumerate().map(of).collect()
    })?;
    let mut rows = headed(["dataset", "contestant", "first quarter ms", "last quarter ms", "growth"]);
    for (dataset, group) in datasets(outcomes, "points") {
        for outcome in group {
            let quarter = outcome.update_ms.len() / 4;
            let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
            let Some(growth) = outcome.growth.filter(|_| quarter > 0) else { continue };
            let (first, last) =
                (&outcome.update_ms[..quarter], &outcome.update_ms[outcome.update_ms.len() - quarter..]);
            rows.push(vec![
                dataset.to_owned(),
                format!("`{}`", outcome.contestant),
                format!("{:.3}", mean(first)),
                format!("{:.3}", mean(last)),
                format!("{growth:.2}"),
            ]);
        }
    }
    page.table(&rows);
    Ok(())
}

/// Figure 8b: values inside unseen obstacles.
pub(super) fn unseen(page: &mut Page, outcomes: &[Outcome]) -> anyhow::Result<()> {
    page.section("Fig. 8b: what is said of the inside of obstacles that no beam saw");
    page.text(
        "Probabilities of occupancy at places inside obstacles, and on free ground, that no beam came near (beams held out; \
         median, quartiles, and what 5 and 95 of 100 do not exceed). Nobody can know what was not seen: what counts is that certainty \
         is not claimed. A value of one half says \"unknown\".\n",
    );
    let first = outcomes.iter().map(|outcome| outcome.seed).min();
    let mut rows = headed([
        "dataset",
        "contestant",
        "inside: 5 %",
        "25 %",
        "median",
        "75 %",
        "95 %",
        "free ground: median",
        "5 % to 95 %",
        "NLL",
    ]);
    for outcome in outcomes.iter().filter(|o| o.held == "beams" && Some(o.seed) == first) {
        let Some(unseen) = &outcome.unseen else { continue };
        let [low, .., high] = unseen.outside.at;
        let mut row = vec![outcome.dataset.clone(), format!("`{}`", outcome.contestant)];
        row.extend(unseen.inside.at.map(|value| format!("{value:.3}")));
        row.push(format!("{:.3}", unseen.outside.at[2]));
        row.push(format!("{low:.3} to {high:.3}"));
        row.push(format!("{:.3}", unseen.scores.nll));
        rows.push(row);
    }
    page.table(&rows);
    let chart = Curve {
        file: "fig8b",
        title: "inside unseen obstacles",
        chart: "p(occupied) inside unseen obstacles",
        x: Axis { label: "percent of the places", scale: Scale::Linear },
        y: Axis { label: "p(occupied) at most", scale: Scale::Linear },
    };
    chart.draw(page, outcomes, "beams", |outcome| {
        let Some(unseen) = &outcome.unseen else { return Vec::new() };
        let at = [5.0, 25.0, 50.0, 75.0, 95.0];
        at.into_iter().zip(unseen.inside.at).map(|(percent, value)| sample(percent, value)).collect()
    })
}

/// The number that a dataset's name begins with, for a file's name.
fn number(dataset: &str) -> &str {
    dataset.split(' ').next().unwrap_or(dataset)
}
