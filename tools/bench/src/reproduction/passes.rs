//! How many EM passes a scan needs: the paper says "1-2 iterations".

use bhm_core::{
    profile::{COMPACT, PAPER},
    rule::AnyRule,
};

use super::{COARSE, Extent, FRACTION, Reproduce, page::Page};
use crate::{
    contest::{Contest, Contestant, Dataset, Results, RunOptions, hold, load, rounds},
    evaluation::Held,
    text::headed,
};

const PASSES: [u32; 5] = [1, 2, 3, 5, 10];

pub(super) fn write(page: &mut Page, asked: &Reproduce, extent: &Extent, results: &mut Results) -> anyhow::Result<()> {
    page.section("EM passes over a scan");
    page.text(
        "`ours:0.5`, beams held out, by update rule and passes over each scan. The paper: \"1-2 iterations\" of Jaakkola and \
         Jordan's bound suffice.\n",
    );
    let rules: [(&str, AnyRule); 2] =
        [("Gaussian variational", COMPACT.settings.rule), ("Jaakkola-Jordan", PAPER.settings.rule)];
    let Some(dataset) = asked.datasets(extent)?.pop() else { return Ok(()) };
    let mut rows = headed(["dataset", "rule", "passes", "AUC", "NLL", "ECE", "median ms"]);
    for (rule_name, rule) in rules {
        let variant = |passes: u32| {
            let mut variant: Dataset = dataset.clone();
            variant.name = format!("{}, {rule_name}, {passes} passes", dataset.name);
            (variant.profile.settings.rule, variant.profile.settings.passes) = (rule, passes);
            variant
        };
        let loaded = load(&PASSES.map(variant), &[asked.seed])?;
        let contest = Contest {
            rounds: rounds(&loaded, &[Held::Beams], FRACTION)?,
            contestants: vec![COARSE.parse::<Contestant>()?],
            options: RunOptions { deadline_s: None, checkpoints: 0 },
            jobs: asked.jobs,
        };
        for (outcome, passes) in hold(&contest, results)?.iter().zip(PASSES) {
            let Some(scores) = outcome.scores else { continue };
            rows.push(vec![
                dataset.name.clone(),
                rule_name.to_owned(),
                passes.to_string(),
                scores.auc.map_or("-".to_owned(), |auc| format!("{auc:.4}")),
                format!("{:.4}", scores.nll),
                format!("{:.4}", scores.ece),
                format!("{:.2}", outcome.timing.p50_ms),
            ]);
        }
    }
    page.table(&rows);
    Ok(())
}
