use bhm_core::settings::SettingsError;

use super::{LayoutError, SupportsRejected};

/// A posterior that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PosteriorRejected {
    /// The message is no posterior, or has another layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The number of the mapper's run or the sequence number is 0.
    #[error("posterior message with mapper or sequence number 0")]
    Unnumbered,
    /// The posterior's tiles have another shape than the reader's.
    #[error("posterior with tiles of {supports} supports in a band of {band}, another shape than this reader's")]
    Shape {
        /// `M`.
        supports: u32,
        /// `B`.
        band: u32,
    },
    /// The number of tiles is not the one that arrived.
    #[error("posterior of {claimed} tiles, {arrived} arrived")]
    Count {
        /// What the header says.
        claimed: u64,
        /// What arrived.
        arrived: usize,
    },
    /// Tiles are not in ascending order of index.
    #[error("posterior: the index of tile {at} is not above that of the tile before")]
    Order {
        /// Position of the first that is not above the one before.
        at: usize,
    },
    /// The settings in the header cannot be decoded: they are another version's, or damaged.
    #[error("posterior with settings that cannot be decoded")]
    SettingsEncoding,
    /// The learned supports that the header names have not arrived, perhaps only not yet.
    #[error("the posterior's supports ({digest:08x}) have not arrived")]
    SupportsMissing {
        /// The digest of the supports.
        digest: u32,
    },
    /// The posterior's learned supports arrived and cannot be used.
    #[error("the posterior's supports: {0}")]
    Supports(#[from] SupportsRejected),
    /// The sensor's pose is not finite.
    #[error("posterior with a sensor pose that is not finite")]
    Pose,
    /// The settings in the header contradict each other.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}
