use bhm_core::{
    beam::{BeamRule, Observation},
    lattice::{Lattice, Window},
    relevance::{NodeStatistics, Relevance, RelevanceSettings},
    settings::{Settings, SettingsError},
    support::SupportTable,
};

use super::{LearnedSupports, LearnedWith, SupportsError};
use crate::ScanRecord;

/// Most nodes of a window that is learned: what one log of a site of kilometres needs.
pub const MAX_NODES: usize = 1 << 24;

/// How supports are learned from a first pass over a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelevanceOptions {
    /// Passes of EM over the scans.
    pub passes: u32,
    /// How many observations a hit counts as.
    pub hit_weight: f32,
    /// What the M-step is regularised by.
    pub settings: RelevanceSettings,
}

impl RelevanceOptions {
    /// Of hit weights 1, 4 and 15 the last predicted held-out beams best: there are several free points to a hit, and only
    /// where hits outweigh them does a support at a wall lie along it.
    pub const DEFAULT: Self = Self { passes: 3, hit_weight: 15.0, settings: RelevanceSettings::DEFAULT };
}

/// What was learned, and from what.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRelevance {
    /// The supports.
    pub supports: LearnedSupports,
    /// Hits and free points of one pass.
    pub observations: [u64; 2],
    /// Observations of one pass that could not be placed.
    pub unplaced: u64,
}

/// Why nothing was learned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RelevanceError {
    /// The map's settings contradict themselves.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The weight of a hit is not a positive number of observations.
    #[error("weight of a hit: {0} observations, expected a positive number")]
    HitWeight(f32),
    /// The scans hold no observation that can be placed.
    #[error("the scans hold no usable observation")]
    Nothing,
    /// The scans reach over more of the lattice than is learned at once.
    #[error(
        "the scans reach over {nodes} nodes of the lattice, at most {MAX_NODES} are learned: take a larger spacing"
    )]
    TooLarge {
        /// Nodes.
        nodes: u128,
    },
    /// The learned values are not usable as supports.
    #[error(transparent)]
    Supports(#[from] SupportsError),
}

/// Learns which nodes call for wide supports (see [`bhm_core::relevance`]) from scans that may be read as often as wanted.
///
/// Memory is one entry per node of the area that the scans reach, whatever their number.
///
/// # Errors
/// What [`RelevanceError`] names.
pub fn learn_relevance<'a, S: IntoIterator<Item = &'a ScanRecord>>(
    scans: impl Fn() -> S,
    settings: &Settings,
    options: &RelevanceOptions,
    source: String,
) -> Result<LearnedRelevance, RelevanceError> {
    // The widest stencil, so that no component misses the observations that its neighbours compete for.
    let lattice = Lattice { stencil: 8, ..settings.fitted(&SupportTable::EMPTY).model()?.basis.lattice };
    let mut first_pass = Extent::default();
    for scan in scans() {
        observe(scan, settings, |observation| first_pass.add(observation, &lattice));
    }
    let window = first_pass.window(lattice.stencil)?;
    if !(options.hit_weight > 0.0 && options.hit_weight.is_finite()) {
        return Err(RelevanceError::HitWeight(options.hit_weight));
    }
    let mut nodes = vec![NodeStatistics::default(); window.supports()];
    let Ok(mut relevance) = Relevance::new(lattice, window, options.settings, &mut nodes) else {
        unreachable!("as many nodes as the window has")
    };
    for _ in 0..options.passes.max(1) {
        for scan in scans() {
            observe(scan, settings, |Observation { place, occupied }| {
                relevance.observe(&place.middle_m(), if *occupied { options.hit_weight } else { 1.0 });
            });
        }
        relevance.maximise();
    }
    let supports: Vec<_> = relevance.supports().collect();
    let learned_with = LearnedWith { kernel: settings.kernel, source };
    let supports = LearnedSupports::new(settings.origin_m, settings.spacing_m, window, supports, Some(learned_with))?;
    Ok(LearnedRelevance { supports, observations: first_pass.observations, unplaced: first_pass.unplaced })
}

/// The observations that a scan gives under these settings, one by one, before any lattice is known.
pub fn observe(scan: &ScanRecord, settings: &Settings, mut each: impl FnMut(&Observation<2>)) {
    for ray in scan.as_scan().rays(&settings.limits) {
        settings.beam.observe(&ray, settings.spacing_m, |observation| {
            each(&observation);
            true
        });
    }
}

/// What a first pass needs to know before any memory is sized.
#[derive(Default)]
struct Extent {
    /// Lowest and highest first node of a stencil.
    firsts: Option<[[i32; 2]; 2]>,
    /// Hits and free points.
    observations: [u64; 2],
    unplaced: u64,
}

impl Extent {
    fn add(&mut self, observation: &Observation<2>, lattice: &Lattice<2>) {
        let Some(stencil) = lattice.stencil_at(&observation.place.middle_m()) else {
            self.unplaced += 1;
            return;
        };
        self.observations[usize::from(!observation.occupied)] += 1;
        let [low, high] = self.firsts.get_or_insert([stencil.first; 2]);
        for axis in 0..2 {
            low[axis] = low[axis].min(stencil.first[axis]);
            high[axis] = high[axis].max(stencil.first[axis]);
        }
    }

    /// Every node that an observation sees.
    fn window(&self, stencil: usize) -> Result<Window<2>, RelevanceError> {
        let [low, high] = self.firsts.ok_or(RelevanceError::Nothing)?;
        let width = [0, 1].map(|axis| (high[axis] - low[axis]) as usize + stencil);
        let nodes = width.iter().map(|width| *width as u128).product();
        if nodes > MAX_NODES as u128 {
            return Err(RelevanceError::TooLarge { nodes });
        }
        Ok(Window { first: low, width })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{geometry::Pose, profile::COMPACT, scan::ScanHeader, support::AnySupport};

    /// A wall 3 m ahead along y, seen from places along it.
    fn scans() -> Vec<ScanRecord> {
        (0..40_u16)
            .map(|i| ScanRecord {
                header: ScanHeader {
                    stamp_ns: u64::from(i),
                    map_from_sensor: Pose::new(0.0, f32::from(i) * 0.1, 0.0),
                    angle_min_rad: -0.5,
                    angle_increment_rad: 0.02,
                    range_max_m: 30.0,
                    ..ScanHeader::default()
                },
                ranges_m: (0..50_u16).map(|beam| 3.2 / (f32::from(beam) * 0.02 - 0.5).cos()).collect(),
            })
            .collect()
    }

    #[test]
    fn supports_at_a_wall_lie_along_it() {
        let scans = scans();
        let learned = learn_relevance(|| &scans, &COMPACT.settings, &RelevanceOptions::DEFAULT, String::new()).unwrap();
        assert_eq!(learned.observations[0], 40 * 50);
        assert!(learned.unplaced == 0);
        // Nodes of the column nearest to x = 3.2 m.
        let table = learned.supports.table();
        for node in 0..7 {
            let Some(AnySupport::GaussianSupport(support)) = table.get(&[6, node]) else { panic!("data at {node}") };
            let s = support.covariance_m2();
            assert!(s[(1, 1)] > 2.0 * s[(0, 0)], "{s}");
        }
        // Behind the wall nothing was seen.
        assert_eq!(table.get(&[9, 3]), Some(&AnySupport::default()));
    }

    #[test]
    fn what_says_nothing_or_reaches_too_far_is_refused() {
        let learn = |scans: &[ScanRecord], settings: &Settings| {
            learn_relevance(|| scans, settings, &RelevanceOptions::DEFAULT, String::new())
        };
        assert_eq!(learn(&[], &COMPACT.settings), Err(RelevanceError::Nothing));
        let fine = Settings { spacing_m: 1e-3, ..COMPACT.settings };
        let mut far = scans();
        far[0].header.map_from_sensor = Pose::new(-60.0, -60.0, 0.0);
        assert!(matches!(learn(&far, &fine), Err(RelevanceError::TooLarge { .. })));
        let bad = Settings { spacing_m: f32::NAN, ..COMPACT.settings };
        assert!(matches!(learn(&scans(), &bad), Err(RelevanceError::Settings(_))));
    }
}
