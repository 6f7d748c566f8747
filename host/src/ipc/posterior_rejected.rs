use bhm_core::settings::SettingsError;

use super::{PosteriorHeader, SupportsRejected};

/// A posterior that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PosteriorRejected {
    /// It does not begin as a posterior does.
    #[error("not a posterior: it begins with {found:#018x}")]
    Magic {
        /// What it begins with.
        found: u64,
    },
    /// It has another layout.
    #[error("posterior layout {found}, {} is understood", PosteriorHeader::VERSION)]
    Version {
        /// Its layout.
        found: u32,
    },
    /// It has flags that mean nothing.
    #[error("unknown flags {found:#x}")]
    Flags {
        /// Its flags.
        found: u32,
    },
    /// It comes from no mapper, or has no number.
    #[error("a posterior without a mapper or a number")]
    Unnumbered,
    /// Its tiles have another shape than the reader's.
    #[error("tiles of {supports} supports in a band of {band} are not this reader's")]
    Shape {
        /// `M`.
        supports: u32,
        /// `B`.
        band: u32,
    },
    /// The number of tiles is not the one that arrived.
    #[error("{claimed} tiles are announced, {arrived} arrived")]
    Count {
        /// What the header says.
        claimed: u64,
        /// What arrived.
        arrived: usize,
    },
    /// Tiles are not in ascending order of index.
    #[error("tile {at} is out of order")]
    Order {
        /// Position of the first that is not above the one before.
        at: usize,
    },
    /// The settings cannot be decoded: another version's, or damaged.
    #[error("the posterior's settings cannot be decoded")]
    SettingsEncoding,
    /// Its supports are not here (yet).
    #[error("the posterior's supports ({digest:08x}) have not arrived")]
    SupportsMissing {
        /// Their digest.
        digest: u32,
    },
    /// Its supports arrived and cannot be used.
    #[error("the posterior's supports: {0}")]
    Supports(#[from] SupportsRejected),
    /// The sensor's pose is not finite.
    #[error("the sensor's pose is not finite")]
    Pose,
    /// The geometry contradicts itself.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}
