use std::{collections::BTreeMap, fs, path::PathBuf};

use bhm_core::profile::{self, Profile};
use bhm_host::{
    snapshot::{self, Extras, Snapshot},
    supports::LearnedSupports,
};
use bhm_plot::knowledge::observed;
use bhm_plot::picture::Bounds;
use clap::Args;
use serde::Serialize;

use crate::{
    options::Effective,
    output::{Output, bytes, table},
};

/// Say what a map file holds
#[derive(Args, Debug)]
pub(crate) struct Info {
    /// Map file
    map: PathBuf,
}

#[derive(Serialize)]
struct Facts {
    format_version: u32,
    bytes: u64,
    /// Checksum of means and covariances: equal for maps that are equal bit for bit.
    posterior: String,
    scans: u64,
    newest_stamp_ns: u64,
    tiles: usize,
    tile_bytes: usize,
    /// Around everything that was observed; null if nothing was.
    observed_m: Option<Bounds>,
    path_points: usize,
    path_length_m: f32,
    profile: String,
    /// Supports of their own that nodes have; null if there are none.
    supports: Option<SupportsFacts>,
    settings: toml::Table,
}

/// What a map's learned supports are.
#[derive(Serialize)]
struct SupportsFacts {
    count: usize,
    /// How many of each kind.
    kinds: BTreeMap<&'static str, usize>,
    /// Equal for supports that are equal bit for bit.
    digest: String,
    /// Null where that is not known.
    kernel: Option<&'static str>,
    source: String,
}

impl Info {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Snapshot { map, extras: Extras { profile, path_m } } = snapshot::load(&self.map)?;
        let (scans, newest_stamp_ns) = map.progress();
        let name = profile::named(&profile).map_or("", |profile| profile.name);
        let made_with =
            Effective::of(Profile { name, purpose: "", settings: *map.settings(), capacities: *map.capacities() });
        let facts = Facts {
            format_version: snapshot::VERSION,
            bytes: fs::metadata(&self.map)?.len(),
            posterior: map.digest().to_string(),
            scans,
            newest_stamp_ns,
            tiles: map.tile_indices().len(),
            tile_bytes: map.bytes().1,
            observed_m: observed(&*map),
            path_points: path_m.len(),
            path_length_m: path_m.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum(),
            profile,
            supports: map.supports().map(SupportsFacts::of),
            settings: made_with.values(),
        };
        let settings = made_with.configuration()?;
        output.result(&facts, || {
            let area =
                |Bounds { min, max }| format!("x {:.1} to {:.1} m, y {:.1} to {:.1} m", min[0], max[0], min[1], max[1]);
            let mut rows = vec![
                ("file", format!("format version {}, {}", facts.format_version, bytes(facts.bytes as usize))),
                ("posterior", facts.posterior.clone()),
                ("scans", format!("{scans}, the newest at {newest_stamp_ns} ns")),
                ("tiles", format!("{} of {}", facts.tiles, bytes(facts.tile_bytes))),
                ("observed", facts.observed_m.map_or("nothing".to_owned(), area)),
                ("path", format!("{} points, {:.1} m", facts.path_points, facts.path_length_m)),
            ];
            rows.extend(facts.supports.as_ref().map(|supports| ("supports", supports.text())));
            format!("{}\n# made with\n{settings}", table(&rows))
        })
    }
}

impl SupportsFacts {
    fn of(supports: &LearnedSupports) -> Self {
        Self {
            count: supports.supports().len(),
            kinds: supports.kinds().collect(),
            digest: format!("{:08x}", supports.digest()),
            kernel: supports.learned_with().map(|with| with.kernel.name()),
            source: supports.learned_with().map_or(String::new(), |with| with.source.clone()),
        }
    }

    fn text(&self) -> String {
        let kinds: Vec<_> = self.kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let Self { count, digest, kernel, source, .. } = self;
        let source = if source.is_empty() { String::new() } else { format!(", {source}") };
        let kernel = kernel.unwrap_or("of which nothing is known");
        format!("{count} learned ({}), {digest}; with the kernel {kernel}{source}", kinds.join(", "))
    }
}
