use bhm_core::profile::Capacities;

/// Most bytes that the tile slots of one map may take. What does not fit goes to the archive, which grows only with what was
/// seen.
pub const MAX_TILE_BYTES: usize = 1 << 30;

/// Largest capacities for the observations, rows and tiles of one scan: far above what any profile needs, and low enough
/// that a file or a flag that asks for them cannot exhaust a computer.
const MAX_OBSERVATIONS: usize = 1 << 18;
const MAX_ROWS: usize = 1 << 18;
const MAX_TOUCHED: usize = 1 << 16;

/// A capacity that is zero, or more memory than a map may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {value}, expected 1 to {max}")]
pub struct CapacityError {
    /// Which.
    pub name: &'static str,
    /// Its value.
    pub value: usize,
    /// The most it may be.
    pub max: usize,
}

/// Checks capacities before anything is allocated by them, for tiles of this shape (supports, band).
pub(crate) fn check(capacities: &Capacities, (supports, band): (usize, usize)) -> Result<(), CapacityError> {
    let Capacities { tiles, observations, rows, touched } = *capacities;
    // Λ and Σ are nearly all of a tile.
    let tile_bytes = supports.saturating_mul(band).saturating_mul(2 * size_of::<f32>()).max(1);
    for (name, value, max) in [
        ("number of tile slots", tiles, (MAX_TILE_BYTES / tile_bytes).max(1)),
        ("capacity for observations", observations, MAX_OBSERVATIONS),
        ("capacity for rows", rows, MAX_ROWS),
        ("capacity for touched tiles", touched, MAX_TOUCHED),
    ] {
        if !(1..=max).contains(&value) {
            return Err(CapacityError { name, value, max });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile;

    #[test]
    fn every_profile_fits_and_excess_is_named() {
        for profile in profile::ALL {
            let shape = (profile.settings.supports(), profile.settings.band());
            assert_eq!(check(&profile.capacities, shape), Ok(()), "{}", profile.name);
            for tiles in [0, usize::MAX] {
                let error = check(&Capacities { tiles, ..profile.capacities }, shape).unwrap_err();
                assert!(error.to_string().starts_with(&format!("number of tile slots is {tiles}, expected 1 to ")));
            }
        }
    }
}
