//! What an update costs a Cortex-M7 at most, known before it begins.
//!
//! Every loop of an update ends at a capacity, so that the work of a scan can be counted from the profile alone
//! ([`Work::most`]), and the work of one that was done from its report ([`Work::done`]). What a unit of work costs follows
//! from the shape of the tiles: `M` supports in a band of `B`, rows of `F` features. The coefficients are instructions of the
//! firmware as it is compiled for `thumbv7em-none-eabihf`, five to ten per cent above what a fit to a recorded log gives
//! (`docs/firmware.md`), so that another compiler's build stays below them too.

use bhm_core::{
    beam::{AnyBeamRule, BeamTally},
    kernel::KernelSettings,
    mapper::{IntegrateReport, Link, ObservationSlot, TouchedTile},
    posterior::{Posterior, RowState, Scratch},
    profile::{Capacities, Profile},
    scan::MAX_BEAMS,
    settings::Settings,
    support::SupportSettings,
    tile::{DirectoryEntry, Tile},
};

/// Longest piece of a ray that one observation stands for, metres.
fn longest_free_m(settings: &Settings) -> f32 {
    match settings.beam {
        AnyBeamRule::PointSamples(rule) => rule.free_spacing_m,
        // A segment is cut once more where it enters another cell.
        AnyBeamRule::LineSegments(_) => 0.5 * settings.spacing_m,
    }
}

/// How much of everything an update does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Beams looked at, each time that they are.
    pub beams: u64,
    /// Observations counted, each time that they are, to see whether they fit.
    pub counted: u64,
    /// Observations made: their features computed, and sorted into tiles.
    pub observations: u64,
    /// Tiles found, begun, or brought back.
    pub tiles: u64,
    /// Rows made, with room for them or not.
    pub rows: u64,
    /// Rows' parts in passes.
    pub row_passes: u64,
    /// Passes over a tile.
    pub passes: u64,
    /// Factorisations beyond one a pass.
    pub again: u64,
    /// Rows added for them.
    pub rows_again: u64,
}

/// Tiles that can hold the stencil of one observation: regions of whole stencils overlap by one cell along each axis.
const TILES_OF_AN_OBSERVATION: u64 = 4;

/// Factorisations of an update beyond one a pass: as many as there are inflations to be tried.
const AGAIN: u64 = 2;

/// How often a scan's observations did not fit, so that they were counted again with half the beams; from how many were left
/// out.
fn overflows(beams: &BeamTally) -> u64 {
    let (sent, read) = (beams.total(), beams.total() - beams.over_capacity);
    let all = MAX_BEAMS.ilog2() + 1;
    // Half of the beams, rounded up, are never as many as all of them, unless that is one, which was the last to be tried.
    u64::from((0..all).find(|halvings| sent.div_ceil(1 << halvings) == read).unwrap_or(all))
}

impl Work {
    /// The most that an update can be under this profile.
    #[must_use]
    pub fn most(profile: &Profile) -> Self {
        let Profile { settings, capacities, .. } = profile;
        let (observations, tiles) = (capacities.observations as u64, capacities.touched as u64);
        // If a scan's observations do not fit, they are counted again with half the beams, until they do; then they are made.
        let of_a_beam = (settings.limits.range_max_m / longest_free_m(settings)) as u64 + 2;
        let counts = u64::from((MAX_BEAMS as u64 * of_a_beam).div_ceil(observations).next_power_of_two().ilog2()) + 1;
        let rows = observations * TILES_OF_AN_OBSERVATION.min(tiles);
        let learned = rows.min(tiles * capacities.rows as u64);
        let passes = u64::from(settings.passes);
        let forgetting = u64::from(settings.forgetting < 1.0);
        Self {
            beams: (counts + 1) * MAX_BEAMS as u64,
            counted: counts * observations,
            observations,
            tiles,
            rows,
            row_passes: learned * passes,
            passes: tiles * (passes + forgetting),
            again: tiles * AGAIN,
            rows_again: learned * AGAIN,
        }
    }

    /// What an update was, by its report; where that does not tell, the most that it can have been.
    #[must_use]
    pub fn done(profile: &Profile, report: &IntegrateReport) -> Self {
        let Profile { settings, capacities, .. } = profile;
        let IntegrateReport { beams, observations: tally, .. } = report;
        let [tiles, learned, failed] = [report.tiles_touched, report.rows, report.tiles_failed].map(u64::from);
        let room = capacities.observations as u64;
        // An observation that misses one of its tiles may have missed them all, or have been used.
        let made = u64::from(tally.used + tally.unplaceable + tally.outside + tally.over_capacity).min(room);
        let overflows = overflows(beams);
        let passes = u64::from(settings.passes);
        let forgetting = if settings.forgetting < 1.0 { tiles } else { 0 };
        let again = AGAIN * (u64::from(report.conditioned) + failed).min(tiles);
        Self {
            beams: (overflows + 2) * u64::from(beams.total()),
            counted: overflows * room + made,
            observations: made,
            tiles,
            rows: learned + u64::from(report.rows_over_capacity),
            row_passes: learned * passes,
            // The report counts no passes of an update that failed.
            passes: (u64::from(report.passes) + failed * passes).min(tiles * passes) + forgetting,
            again,
            rows_again: if again > 0 { AGAIN * learned } else { 0 },
        }
    }

    /// Whether it is nowhere more than the other.
    #[must_use]
    pub fn is_within(&self, most: &Self) -> bool {
        let counts = |work: &Self| {
            let &Self { beams, counted, observations, tiles, rows, row_passes, passes, again, rows_again } = work;
            [beams, counted, observations, tiles, rows, row_passes, passes, again, rows_again]
        };
        counts(self).iter().zip(counts(most)).all(|(here, most)| *here <= most)
    }

    /// Instructions that it takes at most.
    #[must_use]
    pub fn instructions(&self, unit: &Instructions) -> u64 {
        unit.scan
            + self.beams * unit.beam
            + self.counted * unit.counted
            + self.observations * unit.observation
            + self.tiles * unit.tile
            + self.rows * unit.row
            + self.row_passes * unit.row_pass
            + self.passes * unit.pass
            + self.again * unit.again
            + self.rows_again * unit.row_again
    }
}

/// What a unit of work costs, instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instructions {
    /// Whatever the scan.
    pub scan: u64,
    /// Reading a beam.
    pub beam: u64,
    /// Counting an observation.
    pub counted: u64,
    /// Making an observation, and sorting it into its tiles.
    pub observation: u64,
    /// Finding a tile; writing one that goes and one that comes.
    pub tile: u64,
    /// Making a row, its moments under the prior, its place in `Λ` at the end.
    pub row: u64,
    /// Adding a row to `Λ`, reading its moments, its next site.
    pub row_pass: u64,
    /// Assembling, factoring, solving and inverting the matrix of a tile.
    pub pass: u64,
    /// Assembling and factoring it once more, rows apart.
    pub again: u64,
    /// Adding a row for that.
    pub row_again: u64,
}

impl Instructions {
    /// What they are for the tiles of these settings; `None` where nobody has measured: features other than the cubic
    /// B-spline's at points.
    #[must_use]
    pub fn of(settings: &Settings) -> Option<Self> {
        let measured = matches!(settings.kernel, KernelSettings::CubicBSpline(_))
            && matches!(settings.support, SupportSettings::PointSupport(_))
            && matches!(settings.beam, AnyBeamRule::PointSamples(_))
            && settings.bias.is_none();
        let [m, b, f] = [settings.supports(), settings.band(), settings.stencil_nodes()].map(|count| count as u64);
        // A row of the factor has B − 1 sources of up to B columns at two instructions each, load and multiply-subtract; panels
        // of 16 columns skip a third of those that are zero. A row of Σ has no zeros to skip, and weights, two dot products
        // and two copies beside.
        let factor = m * (16 * b * b / 10 + 12 * b + 250);
        let rest = m * (27 * b * b / 10 + 20 * b + 300);
        measured.then_some(Self {
            scan: 20_000,
            beam: 200,
            counted: 60,
            // Its features, and its place in the lists of its tiles.
            observation: 20 * f + 80,
            tile: 6 * m * b + 60_000,
            // Two of the F²/2 products that a row makes with itself, with Σ and for Λ, here as in each pass; then what is done
            // feature by feature.
            row: 6 * f * f + 105 * f + 400,
            row_pass: 6 * f * f + 65 * f + 950,
            pass: factor + rest,
            again: factor,
            row_again: 3 * f * f + 300,
        })
    }
}

/// Instructions that an update takes at most under this profile, whatever the scan; `None` where nobody has measured.
#[must_use]
pub fn most_instructions(profile: &Profile) -> Option<u64> {
    Instructions::of(&profile.settings).map(|unit| Work::most(profile).instructions(&unit))
}

/// Bytes of a map's state: tiles, the prior, and what one scan is worked on in. The same on every machine: nothing of it is a pointer.
#[must_use]
pub fn state_bytes<const M: usize, const B: usize>(profile: &Profile) -> usize {
    let Profile { settings, capacities: Capacities { tiles, observations, rows, touched }, .. } = *profile;
    let features = settings.stencil_nodes() * size_of::<f32>();
    let links = TILES_OF_AN_OBSERVATION as usize * size_of::<Link>();
    tiles * (size_of::<Tile<2, M, B>>() + size_of::<DirectoryEntry<2>>())
        + size_of::<Posterior<M, B>>()
        + size_of::<Scratch<M, B>>()
        + observations * (size_of::<ObservationSlot<2>>() + features + links)
        + touched * size_of::<TouchedTile<2>>()
        + rows * size_of::<RowState>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_what_a_static_takes() {
        use bhm_core::profile::COMPACT;
        let padding = size_of::<bhm_core::static_memory!(COMPACT)>() - state_bytes::<144, 40>(&COMPACT);
        assert!(padding < 8, "{padding} bytes");
    }

    #[test]
    fn what_was_left_out_tells_how_often_a_scan_was_read() {
        for sent in [1, 2, 3, 180, 181, 1_024, 1_025, MAX_BEAMS as u32] {
            // Every `every`-th beam, until that is the first alone; then not even it.
            for halvings in (0_u64..).take_while(|halvings| *halvings == 0 || 1 << (halvings - 1) < sent) {
                let hits = (0..sent).filter(|number| number % (1 << halvings) == 0).count() as u32;
                let tally = BeamTally { hits, over_capacity: sent - hits, ..BeamTally::default() };
                assert_eq!(overflows(&tally), halvings, "{hits} of {sent}");
            }
            let none = BeamTally { over_capacity: sent, ..BeamTally::default() };
            assert_eq!(overflows(&none), 12);
        }
        assert_eq!(overflows(&BeamTally::default()), 0);
    }
}
