//! Figures 6, 8a and 8b: scores and run time against scans, and what is said of unseen places.

use bhm_plot::chart::{Axis, Chart, Figure, Layout, Sample, Scale, Series};

use super::{COARSE, FINE, SMALL_DENSE, page::Page};
use crate::{
    contest::{Checkpoint, Outcome, grouped, median},
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

fn is_drawn(outcome: &Outcome) -> bool {
    DRAWN.iter().any(|name| outcome.contestant == *name || outcome.contestant.split(':').next() == Some(name))
}

/// Those drawn, of the first seed, with this held out, dataset by dataset.
fn datasets<'a>(outcomes: &'a [Outcome], held: &str) -> Vec<(&'a str, Vec<&'a Outcome>)> {
    let first = outcomes.iter().map(|outcome| outcome.seed).min();
    let drawn = outcomes.iter().filter(|o| o.held == held && Some(o.seed) == first && is_drawn(o));
    grouped(drawn, |outcome| outcome.dataset.as_str())
}

/// One chart of a figure, with a curve for each contestant.
struct Curve {
    title: &'static str,
    x: Axis<'static>,
    y: Axis<'static>,
    points: fn(&Outcome) -> Vec<Sample>,
}

/// Draws a figure for each dataset where there is anything for each of its charts; `file` begins the names of the files.
fn draw(
    page: &mut Page,
    outcomes: &[Outcome],
    held: &str,
    [file, title]: [&str; 2],
    charts: &[Curve],
) -> anyhow::Result<()> {
    for (dataset, group) in datasets(outcomes, held) {
        let curves = |chart: &Curve| -> Vec<(String, Vec<Sample>)> {
            let all = group.iter().map(|outcome| (outcome.contestant.clone(), (chart.points)(outcome)));
            all.filter(|(_, points)| !points.is_empty()).collect()
        };
        let curves: Vec<_> = charts.iter().map(curves).collect();
        if curves.iter().any(Vec::is_empty) {
            continue;
        }
        let series = curves.iter().map(|curves| curves.iter().map(|(name, points)| Series { name, points }).collect());
        let series: Vec<Vec<Series<'_>>> = series.collect();
        let charts = charts.iter().zip(&series);
        let charts: Vec<_> = charts.map(|(&Curve { title, x, y, .. }, series)| Chart { title, x, y, series }).collect();
        let title = &format!("Dataset {dataset}: {title}");
        let figure = Figure { title, bars: "", layout: Layout::SideBySide, charts: &charts };
        page.figure(&format!("{file}-{}.png", number(dataset)), &figure)?;
    }
    Ok(())
}

fn linear(label: &'static str) -> Axis<'static> {
    Axis { label, scale: Scale::Linear }
}

fn logarithmic(label: &'static str) -> Axis<'static> {
    Axis { label, scale: Scale::Logarithmic }
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
    let x = linear("scans");
    let auc = |outcome: &Outcome| checkpoints(outcome, |checkpoint| checkpoint.auc);
    let nll = |outcome: &Outcome| checkpoints(outcome, |checkpoint| Some(checkpoint.nll.max(1e-4)));
    let charts = [
        Curve { title: "AUC", x, y: linear("AUC"), points: auc },
        Curve { title: "NLL", x, y: logarithmic("NLL, nats"), points: nll },
    ];
    draw(page, outcomes, "points", ["fig6", "scores against scans"], &charts)
}

fn checkpoints(outcome: &Outcome, value: fn(&Checkpoint) -> Option<f64>) -> Vec<Sample> {
    let at = |checkpoint: &Checkpoint| Some(sample(checkpoint.scans as f64, value(checkpoint)?));
    outcome.curve.iter().filter_map(at).collect()
}

/// Figure 8a: run time per update against scans.
pub(super) fn run_times(page: &mut Page, outcomes: &[Outcome]) -> anyhow::Result<()> {
    page.section("Fig. 8a: run time of an update against scans");
    page.text(
        "Median time of the processor over a thirtieth of the run. The paper's figure: BHM stays flat, VSDGPOM grows with its \
         inducing points. Ours is flat because it depends on the tiles that a scan touches, and on nothing that was before; \
         VSDGPOM grows with the explored area until its inducing points are all placed.\n",
    );
    let points = |outcome: &Outcome| {
        let window = outcome.scans.div_ceil(TIME_POINTS).max(1);
        let of = |(index, part): (usize, &[f32])| sample((index * window + part.len()) as f64, median(part).max(1e-4));
        outcome.update_ms.chunks(window).enumerate().map(of).collect()
    };
    let chart = Curve { title: "time of an update", x: linear("scans"), y: logarithmic("ms"), points };
    draw(page, outcomes, "points", ["fig8a", "run time against scans"], &[chart])?;
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
    let points = |outcome: &Outcome| {
        let Some(unseen) = &outcome.unseen else { return Vec::new() };
        let at = [5.0, 25.0, 50.0, 75.0, 95.0];
        at.into_iter().zip(unseen.inside.at).map(|(percent, value)| sample(percent, value)).collect()
    };
    let title = "p(occupied) inside unseen obstacles";
    let chart = Curve { title, x: linear("percent of the places"), y: linear("p(occupied) at most"), points };
    draw(page, outcomes, "beams", ["fig8b", "inside unseen obstacles"], &[chart])
}

/// The number that a dataset's name begins with, for a file's name.
fn number(dataset: &str) -> &str {
    dataset.split(' ').next().unwrap_or(dataset)
}
