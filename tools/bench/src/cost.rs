//! What scans cost a computer: rows and tiles are counted, without learning where need be, and instructions follow from them, as
//! [`budget`](bhm_firmware_sim::budget) has them follow from an update's work on a microcontroller.

use std::collections::HashSet;

use bhm_core::{
    beam::AnyBeamRule,
    geometry::Place,
    settings::{Settings, SettingsError},
    tile::TileIndex,
};
use bhm_firmware_sim::budget::{Instructions, Work};
use bhm_host::{ScanRecord, supports::observe};

/// Instructions that were counted, with the tile that the kernel calls for.
///
/// By callgrind within the mapper's `integrate` of `bhm evaluate --profile compact`, built with the dev profile, on every 30th scan of
/// the Intel log: with 1 and 3 passes, which tells a row's features, computed once, from what each pass does with them, and
/// with two densities of points, which tells rows from tiles. Debug assertions count, so that these are some tenths more than
/// a release build takes; only their ratios matter here. `cargo bench -p bhm-tools --bench instructions -- LOG every=30
/// kernel=… beam-rule=… passes=…` finds them for a release build. Of two scales, `row_pass` and `segment` are extrapolated.
struct Counted {
    /// Name of the kernel.
    kernel: &'static str,
    /// Tile shape they were counted with.
    supports: usize,
    band: usize,
    stencil: usize,
    /// Of a tile in a pass.
    tile_pass: f64,
    /// Of a row in a pass.
    row_pass: f64,
    /// Of a row once, where the rows are those of points.
    point: f64,
    /// Of a row once, where the rows are pieces of segments and a point for each hit.
    segment: f64,
}

const COUNTED: [Counted; 3] = [
    Counted {
        kernel: "cubic-b-spline",
        supports: 144,
        band: 40,
        stencil: 4,
        tile_pass: 413e3,
        row_pass: 2.6e3,
        point: 8.2e3,
        segment: 18.6e3,
    },
    Counted {
        kernel: "squared-exponential",
        supports: 196,
        band: 76,
        stencil: 6,
        tile_pass: 2.74e6,
        row_pass: 6.6e3,
        point: 17.7e3,
        segment: 31.5e3,
    },
    Counted {
        kernel: "two-scales",
        supports: 256,
        band: 120,
        stencil: 8,
        tile_pass: 3.26e6,
        row_pass: 12.7e3,
        point: 39.8e3,
        segment: 70.8e3,
    },
];

/// What a unit of work costs a computer, estimated: equal on every machine. Passes cost what the stencil decides, features what
/// the kernel does, in proportion to the nodes of the stencil; with a tile of another shape passes scale by its `M·B²`.
fn unit(settings: &Settings) -> Result<Instructions, SettingsError> {
    settings.model()?;
    let (stencil, supports, band) = (settings.tile.stencil, settings.supports(), settings.band());
    let [kernel, ..] = &COUNTED;
    let kernel = COUNTED.iter().find(|counted| counted.kernel == settings.kernel.name()).unwrap_or(kernel);
    let shape = COUNTED.iter().find(|counted| counted.stencil == stencil).unwrap_or(kernel);
    let work = |supports: usize, band: usize| (supports * band * band) as f64;
    let pass = shape.tile_pass * work(supports, band) / work(shape.supports, shape.band);
    let features = match settings.beam {
        AnyBeamRule::PointSamples(_) => kernel.point,
        AnyBeamRule::LineSegments(_) => kernel.segment,
    };
    let nodes = (stencil as f64 / kernel.stencil as f64).powi(2);
    let [pass, row, row_pass] = [pass, features * nodes, shape.row_pass].map(|count| count.round() as u64);
    Ok(Instructions { pass, row, row_pass, ..Instructions::default() })
}

/// Instructions of so many rows and passes over tiles.
///
/// # Errors
/// Settings that contradict themselves.
pub fn instructions(settings: &Settings, rows: u64, passes: u64) -> Result<f64, SettingsError> {
    let work = Work { rows, row_passes: rows * u64::from(settings.passes), passes, ..Work::default() };
    Ok(work.instructions(&unit(settings)?) as f64)
}

/// What scans ask of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// An observation is a row in each tile that holds its whole stencil; a segment is one observation in every cell.
    pub rows: u64,
    /// Tiles touched, scan by scan.
    pub updates: u64,
}

impl Load {
    /// Counts, with no limit to what a scan may hold, and no map.
    ///
    /// # Errors
    /// Settings that contradict themselves.
    pub fn of<'a>(scans: impl IntoIterator<Item = &'a ScanRecord>, settings: &Settings) -> Result<Self, SettingsError> {
        let model = settings.model()?;
        let lattice = &model.basis.lattice;
        let (mut load, mut touched) = (Self::default(), HashSet::<TileIndex<2>>::new());
        for scan in scans {
            let mut row = |place: &Place<2>| {
                let Some(stencil) = lattice.stencil_at(&place.middle_m()) else { return };
                for tile in model.tiling.holding(&stencil.first).filter(|tile| model.tiling.contains(tile)) {
                    load.rows += 1;
                    touched.insert(tile);
                }
            };
            observe(scan, settings, |observed| match observed.place {
                Place::Segment { from_m, to_m } => {
                    lattice.cut(from_m, to_m).for_each(|(from_m, to_m)| row(&Place::Segment { from_m, to_m }));
                }
                Place::Point(_) => row(&observed.place),
            });
            load.updates += touched.len() as u64;
            touched.clear();
        }
        Ok(load)
    }

    /// The instructions that follow if no pass is cut short.
    ///
    /// # Errors
    /// Settings that contradict themselves.
    pub fn instructions(&self, settings: &Settings) -> Result<f64, SettingsError> {
        instructions(settings, self.rows, self.updates * u64::from(settings.passes))
    }
}

/// Where `falling`, a function that falls, takes a value, between 1 cm and 100 m: by bisection of the exponent; an end of
/// that range if it never does.
///
/// # Errors
/// What the function returns.
pub fn where_falls_to(value: f64, falling: impl Fn(f32) -> Result<f64, SettingsError>) -> Result<f32, SettingsError> {
    let (mut low, mut high) = (0.01_f32.ln(), 100.0_f32.ln());
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if falling(middle.exp())? > value {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok((0.5 * (low + high)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile::{COMPACT, Profile};
    use bhm_host::{map, sim::Scene};

    #[test]
    fn a_count_is_what_a_map_learns() {
        let scans: Vec<ScanRecord> = Scene::named("building").unwrap().simulate(1).step_by(40).take(4).collect();
        for beam in AnyBeamRule::ALL {
            let settings = Settings { beam: *beam, ..COMPACT.settings };
            let capacities =
                bhm_core::profile::Capacities { observations: 1 << 15, rows: 1 << 15, ..COMPACT.capacities };
            let mut map = map::open(&Profile { settings, capacities, ..COMPACT }).unwrap();
            let (mut learned, mut passes) = (Load::default(), 0);
            for scan in &scans {
                let report = map.integrate(&scan.as_scan()).unwrap();
                learned.rows += u64::from(report.rows);
                learned.updates += u64::from(report.tiles_touched);
                passes += u64::from(report.passes);
            }
            assert_eq!(Load::of(&scans, &settings).unwrap(), learned);
            let modelled = learned.instructions(&settings).unwrap();
            assert!((instructions(&settings, learned.rows, passes).unwrap() / modelled - 1.0).abs() < 0.05);
        }
    }

    #[test]
    fn bisection_finds_the_value() {
        let found = where_falls_to(4.0, |x| Ok(f64::from(8.0 / x))).unwrap();
        assert!((found - 2.0).abs() < 1e-3, "{found}");
    }
}
