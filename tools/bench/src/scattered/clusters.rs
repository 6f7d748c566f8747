//! Where data lies: weighted k-means over a log that streams by.
//!
//! Written here since the crates for it hold all data as one matrix, and bring one along: this one keeps a reservoir of
//! [`SEEDS_PER_CLUSTER`] observations a cluster to begin with (k-means++, Arthur and Vassilvitskii 2007) and the sums of
//! Lloyd's algorithm, whatever the length of the log.

use anyhow::ensure;
use bhm_core::{geometry::Point, settings::Settings, support::SupportTable};
use bhm_host::{ScanRecord, supports::observe};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Cluster;
use crate::reservoir::{Reservoir, put};

/// Most clusters that are looked for: each observation asks every one of them.
pub const MAX_CLUSTERS: usize = 4_096;

/// Observations that the first centres are drawn from, a cluster.
pub const SEEDS_PER_CLUSTER: usize = 64;

/// How clusters are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterOptions {
    /// How many, at most: as many as there are places observed.
    pub clusters: usize,
    /// Passes over the scans after the first, which finds where to begin.
    pub passes: u32,
    /// How many observations a hit counts as.
    pub hit_weight: f32,
    /// Seed of where they begin.
    pub seed: u64,
}

impl ClusterOptions {
    /// The hit weight is that of [`RelevanceOptions`](bhm_host::supports::RelevanceOptions); after ten passes centres move little.
    pub const DEFAULT: Self = Self { clusters: 256, passes: 10, hit_weight: 15.0, seed: 1 };
}

/// Finds clusters of hits and free points in scans that may be read as often as wanted. Memory depends on the number of
/// clusters alone.
///
/// # Errors
/// Settings that contradict themselves, more than [`MAX_CLUSTERS`] clusters or none, a hit weight that is not positive, or scans
/// without a usable observation.
pub fn learn_clusters<'a, S: IntoIterator<Item = &'a ScanRecord>>(
    scans: impl Fn() -> S,
    settings: &Settings,
    options: &ClusterOptions,
) -> anyhow::Result<Vec<Cluster>> {
    let ClusterOptions { clusters, passes, hit_weight, seed } = *options;
    ensure!((1..=MAX_CLUSTERS).contains(&clusters), "{clusters} clusters, expected 1 to {MAX_CLUSTERS}");
    ensure!(hit_weight > 0.0 && hit_weight.is_finite(), "a hit cannot count as {hit_weight} observations");
    settings.fitted(&SupportTable::EMPTY).model()?;
    let each = |take: &mut dyn FnMut(Observation)| {
        for scan in scans() {
            observe(scan, settings, |observed| {
                let at_m = observed.place.middle_m();
                if at_m.iter().all(|x| x.is_finite()) {
                    take(Observation { at_m, weight: if observed.occupied { f64::from(hit_weight) } else { 1.0 } });
                }
            });
        }
    };
    let found = k_means(each, clusters, passes, seed);
    ensure!(!found.is_empty(), "the scans hold no usable observation");
    Ok(found)
}

/// Weighted k-means of any places: `each` hands every one of them, the same ones each time it is asked, to what it is given.
/// As many clusters as there are distinct places, at most `clusters`; none of nothing.
#[must_use]
pub fn k_means(each: impl Fn(&mut dyn FnMut(Observation)), clusters: usize, passes: u32, seed: u64) -> Vec<Cluster> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut reservoir, mut kept) = (Reservoir::default(), Vec::new());
    each(&mut |observation| {
        let draw = |seen| rng.random_range(0..seen as usize) as u64;
        if let Some(place) = reservoir.offer(clusters * SEEDS_PER_CLUSTER, draw) {
            put(&mut kept, place, observation);
        }
    });
    let mut found = seeds(&kept, clusters, &mut rng);
    if found.is_empty() {
        return found;
    }
    for _ in 0..passes.max(1) {
        let mut sums = vec![Sums::default(); found.len()];
        each(&mut |observation| {
            let nearest = nearest(&found, &observation.at_m);
            sums[nearest].add(&observation, &found[nearest]);
        });
        for (centre, sums) in found.iter_mut().zip(&sums) {
            *centre = sums.cluster(centre);
        }
    }
    found
}

/// A place that clusters are found in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Where, metres; finite.
    pub at_m: Point<2>,
    /// How much it counts, above zero.
    pub weight: f64,
}

/// First centres, each drawn with the probability of an observation's weight times its squared distance to the nearest
/// centre before it; fewer if there are no further places.
fn seeds(observations: &[Observation], clusters: usize, rng: &mut impl Rng) -> Vec<Cluster> {
    let mut chance: Vec<f64> = observations.iter().map(|observation| observation.weight).collect();
    let mut centres: Vec<Cluster> = Vec::new();
    while centres.len() < clusters {
        let total: f64 = chance.iter().sum();
        let mut left = rng.random::<f64>() * total;
        let drawn = chance.iter().position(|chance| {
            left -= chance;
            left < 0.0 && *chance > 0.0
        });
        // Rounding may leave a little of the sum: the last that can be drawn.
        let Some(drawn) = drawn.or_else(|| chance.iter().rposition(|chance| *chance > 0.0)) else { break };
        let at_m = observations[drawn].at_m;
        for (chance, observation) in chance.iter_mut().zip(observations) {
            let apart = observation.at_m - at_m;
            let fresh = observation.weight * f64::from(apart.dot(&apart));
            *chance = if centres.is_empty() { fresh } else { chance.min(fresh) };
        }
        centres.push(Cluster { centre_m: at_m.into(), covariance_m2: [0.0; 3], weight: 0.0 });
    }
    centres
}

/// The nearest centre; of equally near ones the first.
fn nearest(clusters: &[Cluster], at_m: &Point<2>) -> usize {
    let mut best = (f32::INFINITY, 0);
    for (index, cluster) in clusters.iter().enumerate() {
        let [x, y] = [at_m.x - cluster.centre_m[0], at_m.y - cluster.centre_m[1]];
        let distance = x * x + y * y;
        if distance < best.0 {
            best = (distance, index);
        }
    }
    best.1
}

/// Moments of the observations of a cluster about its centre, so that no difference of large numbers is taken.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    weight: f64,
    first: [f64; 2],
    /// xx, xy, yy.
    second: [f64; 3],
}

impl Sums {
    fn add(&mut self, observation: &Observation, cluster: &Cluster) {
        let [x, y] = [0, 1].map(|axis| f64::from(observation.at_m[axis]) - f64::from(cluster.centre_m[axis]));
        let weight = observation.weight;
        self.weight += weight;
        for (sum, value) in self.first.iter_mut().zip([x, y]) {
            *sum += weight * value;
        }
        for (sum, value) in self.second.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += weight * value;
        }
    }

    /// Where the cluster goes; one that lost everything stays where it is.
    fn cluster(&self, before: &Cluster) -> Cluster {
        if self.weight <= 0.0 {
            return Cluster { covariance_m2: [0.0; 3], weight: 0.0, ..*before };
        }
        let [x, y] = self.first.map(|sum| sum / self.weight);
        let [xx, xy, yy] = self.second.map(|sum| sum / self.weight);
        Cluster {
            centre_m: [(f64::from(before.centre_m[0]) + x) as f32, (f64::from(before.centre_m[1]) + y) as f32],
            covariance_m2: [(xx - x * x).max(0.0) as f32, (xy - x * y) as f32, (yy - y * y).max(0.0) as f32],
            weight: self.weight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{geometry::Pose, profile::COMPACT, scan::ScanHeader};

    /// Hits of beams in all directions at three places far from each other; one free point right at each sensor.
    fn scans() -> Vec<ScanRecord> {
        [[0.0, 0.0], [20.0, 0.0], [0.0, 30.0]]
            .into_iter()
            .enumerate()
            .map(|(i, [x, y])| ScanRecord {
                header: ScanHeader {
                    stamp_ns: i as u64,
                    map_from_sensor: Pose::new(x, y, 0.0),
                    angle_min_rad: 0.0,
                    angle_increment_rad: 0.1,
                    range_max_m: 30.0,
                    ..ScanHeader::default()
                },
                ranges_m: (0..63).map(|beam| 1.0 + 0.5 * (beam % 5) as f32).collect(),
            })
            .collect()
    }

    fn all(scans: &[ScanRecord], hit_weight: f64) -> Vec<([f64; 2], f64)> {
        let mut all = Vec::new();
        for scan in scans {
            observe(scan, &COMPACT.settings, |observed| {
                let at = observed.place.middle_m();
                all.push(([f64::from(at.x), f64::from(at.y)], if observed.occupied { hit_weight } else { 1.0 }));
            });
        }
        all
    }

    /// One step of Lloyd's algorithm as the textbook has it: groups first, then their means and covariances.
    fn naive(all: &[([f64; 2], f64)], centres: &[[f64; 2]]) -> Vec<([f64; 2], [f64; 3], f64)> {
        let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        let of = |at: &[f64; 2]| {
            (0..centres.len()).min_by(|i, j| distance(at, &centres[*i]).total_cmp(&distance(at, &centres[*j]))).unwrap()
        };
        (0..centres.len())
            .map(|index| {
                let group: Vec<_> = all.iter().filter(|(at, _)| of(at) == index).collect();
                let weight: f64 = group.iter().map(|(_, weight)| weight).sum();
                let mean = [0, 1].map(|axis| group.iter().map(|(at, w)| at[axis] * w).sum::<f64>() / weight);
                let moment = |i: usize, j: usize| {
                    group.iter().map(|(at, w)| w * (at[i] - mean[i]) * (at[j] - mean[j])).sum::<f64>() / weight
                };
                (mean, [moment(0, 0), moment(0, 1), moment(1, 1)], weight)
            })
            .collect()
    }

    #[test]
    fn a_pass_is_a_step_of_lloyds_algorithm() {
        let scans = scans();
        let options = ClusterOptions { clusters: 7, passes: 4, ..ClusterOptions::DEFAULT };
        let before = learn_clusters(|| &scans, &COMPACT.settings, &options).unwrap();
        let after = learn_clusters(|| &scans, &COMPACT.settings, &ClusterOptions { passes: 5, ..options }).unwrap();
        let centres: Vec<_> = before.iter().map(|cluster| cluster.centre_m.map(f64::from)).collect();
        let expected = naive(&all(&scans, 15.0), &centres);
        assert_eq!(after.len(), 7);
        for (cluster, (mean, covariance, weight)) in after.iter().zip(expected) {
            assert!((cluster.weight - weight).abs() < 1e-6, "{cluster:?}: {weight}");
            // What an f32 keeps of places 30 m away.
            assert!((0..2).all(|axis| (f64::from(cluster.centre_m[axis]) - mean[axis]).abs() < 1e-5), "{cluster:?}");
            assert!((0..3).all(|i| (f64::from(cluster.covariance_m2[i]) - covariance[i]).abs() < 1e-5), "{cluster:?}");
        }
        assert_eq!(learn_clusters(|| &scans, &COMPACT.settings, &options).unwrap(), before);
    }

    #[test]
    fn what_lies_apart_is_told_apart() {
        let scans = scans();
        for seed in 0..20 {
            let options = ClusterOptions { clusters: 3, seed, ..ClusterOptions::DEFAULT };
            let found = learn_clusters(|| &scans, &COMPACT.settings, &options).unwrap();
            for scan in &scans {
                let at = scan.header.map_from_sensor.position();
                let near = found.iter().filter(|c| (c.centre_m[0] - at.x).hypot(c.centre_m[1] - at.y) < 1.0).count();
                assert_eq!(near, 1, "seed {seed}: {found:?}");
            }
        }
    }

    #[test]
    fn places_that_come_from_elsewhere_are_clustered_alike() {
        let scans = scans();
        let places = all(&scans, 15.0);
        let each = |take: &mut dyn FnMut(Observation)| {
            for ([x, y], weight) in &places {
                take(Observation { at_m: Point::from([*x as f32, *y as f32]), weight: *weight });
            }
        };
        let options = ClusterOptions { clusters: 7, passes: 4, ..ClusterOptions::DEFAULT };
        let learned = learn_clusters(|| &scans, &COMPACT.settings, &options);
        assert_eq!(k_means(each, 7, 4, options.seed), learned.unwrap());
        assert!(k_means(|_| (), 7, 4, 1).is_empty());
    }

    #[test]
    fn fewer_places_are_fewer_clusters_and_none_is_refused() {
        let mut one = scans();
        one.truncate(1);
        one[0].ranges_m = vec![0.05];
        let learn = |scans: &[ScanRecord], options: &ClusterOptions| {
            learn_clusters(|| scans, &COMPACT.settings, options)
                .map(|found| found.len())
                .map_err(|error| error.to_string())
        };
        let options = ClusterOptions { clusters: 5, ..ClusterOptions::DEFAULT };
        assert_eq!(learn(&one, &options), Ok(1));
        assert_eq!(learn(&[], &options), Err("the scans hold no usable observation".to_owned()));
        let none = ClusterOptions { clusters: 0, ..options };
        assert_eq!(learn(&one, &none), Err("0 clusters, expected 1 to 4096".to_owned()));
        let weightless = ClusterOptions { hit_weight: 0.0, ..options };
        assert_eq!(learn(&one, &weightless), Err("a hit cannot count as 0 observations".to_owned()));
    }
}
