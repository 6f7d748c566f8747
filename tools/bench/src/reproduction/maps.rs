//! Figure 7: maps side by side.

use std::time::Instant;

use bhm_plot::picture::{Bounds, Canvas, Field, FieldPicture};

use super::{FINE, FRACTION, page::Page};
use crate::{
    baselines::{Baseline, Failed},
    contest::{Contestant, Dataset, Loaded, load, setup},
    evaluation::{Held, Task},
    metrics::sigmoid,
    progress,
};

/// Whose maps are drawn.
const DRAWN: [&str; 2] = [FINE, "vsdgpom"];

/// Places asked along the longer side: a pixel shows the nearest of them.
const PLACES: f32 = 300.0;

/// Metres of the longer side beyond which a map is drawn no larger.
const PIXELS: f32 = 600.0;

pub(super) fn write(page: &mut Page, datasets: &[Dataset], seed: u64, deadlines_s: [f64; 2]) -> anyhow::Result<()> {
    page.section("Fig. 7: maps side by side");
    page.text(
        "What was learned with 10 % of the beams held out: black is occupied, white is free, blue unknown. VSDGPOM \
         has one length scale for everything, and blurs walls that ours resolves.\n",
    );
    for (_, loaded) in load(datasets, &[seed])? {
        let task = loaded.task(Held::Beams, FRACTION, seed)?;
        let deadline_s = deadlines_s[usize::from(loaded.world.is_none())];
        let number = loaded.dataset.name.split(' ').next().unwrap_or_default().to_owned();
        for name in DRAWN {
            let contestant: Contestant = name.parse()?;
            let title = format!("Dataset {}: {contestant}", loaded.dataset.name);
            match learned(&contestant, &loaded, &task, seed, deadline_s) {
                Ok((mut baseline, scans)) => {
                    let canvas = draw(&mut *baseline, &task, &title)?;
                    page.canvas(&format!("fig7-{number}-{}.png", contestant.entry.name), &title, &canvas)?;
                    if scans < task.training.len() {
                        page.text(&format!(
                            "`{contestant}` learned {scans} of {} scans in {deadline_s} s.\n",
                            task.training.len()
                        ));
                    }
                }
                Err(Failed(why)) => page.text(&format!("`{contestant}` has no map: {why}\n")),
            }
        }
    }
    Ok(())
}

/// A contestant that has learned, and how many scans.
fn learned(
    contestant: &Contestant,
    loaded: &Loaded,
    task: &Task,
    seed: u64,
    deadline_s: f64,
) -> Result<(Box<dyn Baseline>, usize), Failed> {
    let mut baseline = (contestant.entry.open)(&setup(contestant, loaded, task, seed))?;
    let start = Instant::now();
    let mut scans = 0;
    for shown in progress::over(task.training.iter(), format!("{contestant} for a picture")) {
        if start.elapsed().as_secs_f64() > deadline_s {
            break;
        }
        baseline.integrate(shown)?;
        scans += 1;
    }
    Ok((baseline, scans))
}

fn draw(baseline: &mut dyn Baseline, task: &Task, title: &str) -> anyhow::Result<Canvas> {
    let [min, max] = task.area_m().unwrap_or_default();
    let side_m = [0, 1].map(|axis| max[axis] - min[axis]);
    let longer_m = side_m[0].max(side_m[1]);
    let step_m = longer_m / PLACES;
    let shape = side_m.map(|side_m| (side_m / step_m).ceil().max(1.0) as usize);
    let place = |slot: usize| {
        let [x, y] = [slot % shape[0], slot / shape[0]].map(|i| (i as f32 + 0.5) * step_m);
        [min[0] + x, min[1] + y]
    };
    let places: Vec<[f32; 2]> = (0..shape[0] * shape[1]).map(place).collect();
    let values = baseline.predict(&places);
    let picture = FieldPicture {
        bounds_m: Bounds { min, max },
        pixels_per_metre: Some(PIXELS / longer_m),
        title,
        field: Field::PROBABILITY,
        overlays: &[],
        path_m: &[],
    };
    let at = |x: f32, y: f32| {
        let [column, row] = [(x - min[0], 0), (y - min[1], 1)]
            .map(|(along_m, axis)| ((along_m / step_m) as usize).min(shape[axis].saturating_sub(1)));
        sigmoid(values[row * shape[0] + column].logit) as f32
    };
    Ok(picture.render(at)?)
}
