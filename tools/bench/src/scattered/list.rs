use std::{
    fs::{self, File},
    io::BufReader,
    path::Path,
};

use anyhow::{Context, bail, ensure};
use bhm_core::{
    geometry::Point,
    support::{AnySupport, GaussianSupport, Support},
};
use serde::{Deserialize, Serialize};

use super::{MAX_CLUSTERS, ScatteredSupport};

/// Where observations lie close together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cluster {
    /// Their mean, metres.
    pub centre_m: [f32; 2],
    /// Their covariance, m²: of x, of x and y, of y.
    pub covariance_m2: [f32; 3],
    /// How many they are, hits counting as several.
    pub weight: f64,
}

impl Cluster {
    /// A support at its centre.
    #[must_use]
    pub fn point(&self) -> ScatteredSupport {
        ScatteredSupport { centre_m: Point::from(self.centre_m), support: AnySupport::default() }
    }

    /// A support spread as its observations are; `None` if the covariance is invalid.
    #[must_use]
    pub fn gaussian(&self) -> Option<ScatteredSupport> {
        let [xx, xy, yy] = self.covariance_m2;
        // Of clusters along a line, rounding may leave more covariance than the variances allow.
        let bound = (xx * yy).max(0.0).sqrt();
        let support = GaussianSupport::from_numbers(&[xx, xy.clamp(-bound, bound), yy, 0.0, 0.0, 0.0])?;
        Some(ScatteredSupport { centre_m: Point::from(self.centre_m), support: AnySupport::GaussianSupport(support) })
    }

    fn is_valid(&self) -> bool {
        self.centre_m.iter().all(|x| x.is_finite()) && self.weight >= 0.0 && self.gaussian().is_some()
    }
}

/// A list of scattered supports: clusters of a log, as a file holds them in JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clusters {
    /// In words, what they were found in.
    pub source: String,
    /// At least one.
    pub clusters: Vec<Cluster>,
}

impl Clusters {
    /// Writes them to a file; says how many bytes they are.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> anyhow::Result<usize> {
        let bytes = serde_json::to_vec(self)?;
        fs::write(path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(bytes.len())
    }

    /// Reads them from a file.
    ///
    /// # Errors
    /// If the file cannot be read, or holds something else.
    pub fn load(path: &Path) -> anyhow::Result<Self> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let bad = || format!("{}: expected a list of scattered supports", path.display());
        let list: Self = serde_json::from_reader(BufReader::new(file)).with_context(bad)?;
        let supports = list.clusters.len();
        ensure!((1..=MAX_CLUSTERS).contains(&supports), "{}: {supports} supports, expected 1 to {MAX_CLUSTERS}", bad());
        match list.clusters.iter().position(|cluster| !cluster.is_valid()) {
            Some(invalid) => bail!("{}: support {invalid}: invalid centre, weight or covariance", bad()),
            None => Ok(list),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Clusters {
        let cluster = |i: u8| Cluster {
            centre_m: [f32::from(i) / 3.0, -0.5],
            covariance_m2: [0.2, 0.1, 0.1 * f32::from(i + 1)],
            weight: f64::from(i),
        };
        Clusters { source: "a test".to_owned(), clusters: (0..5).map(cluster).collect() }
    }

    #[test]
    fn what_went_in_comes_out_and_what_is_no_list_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.json");
        let bytes = some().save(&path).unwrap();
        assert_eq!((Clusters::load(&path).unwrap(), fs::metadata(&path).unwrap().len()), (some(), bytes as u64));

        let refused = |damage: &dyn Fn(&mut Clusters)| {
            let mut clusters = some();
            damage(&mut clusters);
            clusters.save(&path).unwrap();
            format!("{:#}", Clusters::load(&path).unwrap_err())
        };
        let invalid = "support 2: invalid centre, weight or covariance";
        assert!(refused(&|list| list.clusters[2].covariance_m2[0] = -1.0).ends_with(invalid));
        assert!(refused(&|list| list.clusters[2].weight = -1.0).ends_with(invalid));
        // What is no number is null in JSON.
        assert!(refused(&|list| list.clusters[3].centre_m[1] = f32::NAN).contains("invalid type: null, expected f32"));
        assert!(refused(&|list| list.clusters.clear()).ends_with("0 supports, expected 1 to 4096"));

        fs::write(&path, "FLASER 3 1.0").unwrap();
        let error = format!("{:#}", Clusters::load(&path).unwrap_err());
        assert!(error.contains("expected a list of scattered supports: expected value at line 1"), "{error}");
        assert!(Clusters::load(&folder.path().join("none")).is_err());
        assert!(some().save(&folder.path().join("no/some.json")).is_err());
    }
}
