use std::sync::Arc;

use bhm_core::{
    geometry::Pose,
    posterior::{Band, Posterior, PosteriorView},
    settings::{ENCODED_BYTES, Model, Settings, SettingsError},
    tile::{MapView, TileIndex, TileSource},
};
use iceoryx2::prelude::ZeroCopySend;

use super::{PosteriorNews, PosteriorRejected, SourceTile, SupportsRejected, layout::Layout, wire::PlainNumbers};
use crate::{
    map::zeroed_box,
    supports::{LearnedSupports, table_of},
};

/// What stands before the tiles of a posterior: whose it is, how new, and everything needed to ask it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("bhm.posterior.v3")]
pub struct PosteriorHeader {
    /// [`PosteriorHeader::MAGIC`].
    pub magic: u64,
    /// [`PosteriorHeader::VERSION`].
    pub version: u32,
    /// [`PosteriorHeader::ENDED`] or 0.
    pub flags: u32,
    /// Which run of the mapper; never 0.
    pub mapper: u64,
    /// The mapper's count of publications, from 1.
    pub sequence: u64,
    /// Which run of which source the mapper heard last; 0 before the first.
    pub source: u64,
    /// Sequence number of the newest scan of that source that is dealt with.
    pub scan_sequence: u64,
    /// Stamp of the newest scan integrated, nanoseconds on its source's clock.
    pub stamp_ns: u64,
    /// Scans integrated since the map began.
    pub scans: u64,
    /// Tiles that follow.
    pub resident: u64,
    /// Tiles that the mapper keeps elsewhere and does not publish.
    pub archived: u64,
    /// Tiles that were evicted and not kept.
    pub lost: u64,
    /// Where the sensor stood at the newest scan integrated, metres.
    pub x_m: f32,
    /// Where the sensor stood at the newest scan integrated, metres.
    pub y_m: f32,
    /// Where the sensor's x axis pointed, radians.
    pub theta_rad: f32,
    /// Supports of a tile, `M`.
    pub supports: u32,
    /// Width of a tile's band, `B`.
    pub band: u32,
    /// The [digest](crate::supports::LearnedSupports::digest) of the supports of their own that nodes have; 0 for none.
    pub supports_digest: u32,
    /// How many bytes of [`Self::settings`] are meant.
    pub settings_bytes: u32,
    /// What the map was made with: [`Settings`] in their postcard encoding.
    pub settings: EncodedSettings,
}

/// Room for what a map was made with.
#[repr(C)]
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("bhm.settings.v1")]
pub struct EncodedSettings(pub [u8; ENCODED_BYTES]);

// SAFETY: integers, floating-point numbers, and arrays of them.
unsafe impl PlainNumbers for PosteriorHeader {}

/// A tile: what queries need of it, and how new it is.
#[repr(C)]
#[derive(Debug, ZeroCopySend)]
#[type_name("bhm.posterior-tile.v1")]
pub struct PosteriorTile<const M: usize, const B: usize> {
    /// The mapper's scan count when the tile was last touched.
    pub touched_at: u64,
    /// Number of updates that the tile has learned from.
    pub updates: u64,
    /// The tile's place in the grid of tiles.
    pub index: TileIndex<2>,
    /// `Σ` and `μ` of the bias. Without bias: 1 and 0.
    pub bias_covariance: f32,
    /// See [`Self::bias_covariance`].
    pub bias_mean: f32,
    /// `μ` of the weights.
    pub mean: [f32; M],
    /// `Σ` between the bias and each weight.
    pub border_covariance: [f32; M],
    /// The band of `Σ`: `[i][j]` is the entry `(i, i + j)`.
    pub covariance: Band<M, B>,
}

// SAFETY: integers, floating-point numbers, and arrays of them.
unsafe impl<const M: usize, const B: usize> PlainNumbers for PosteriorTile<M, B> {}

/// The model of the posterior before, and what it follows from: nearly always it is the next one's too, and to build one
/// looks at every support.
pub(super) type KnownModel<const M: usize, const B: usize> = Option<(Settings, u32, PosteriorModel<M, B>)>;

/// What a posterior's tiles are asked by: the functions that it was made with, and its prior.
#[derive(Clone, Debug, PartialEq)]
pub struct PosteriorModel<const M: usize, const B: usize> {
    /// The functions that follow from the settings.
    pub model: Model<'static, 2>,
    /// What is believed of a tile where nothing was observed, shared by every posterior of the same settings.
    pub prior: Arc<Posterior<M, B>>,
}

impl<const M: usize, const B: usize> PosteriorModel<M, B> {
    fn of(model: Model<'static, 2>) -> Result<Self, SettingsError> {
        model.tiling.check(M, B)?;
        let mut prior = zeroed_box();
        model.prior.write::<M, B>(&mut prior, &mut zeroed_box())?;
        Ok(Self { model, prior: prior.into() })
    }

    /// The map that these tiles are.
    #[must_use]
    pub fn view<T: TileSource<2, M, B>>(&self, tiles: T) -> MapView<'_, T, 2, M, B> {
        self.model.view(&self.prior, tiles)
    }
}

impl Default for EncodedSettings {
    fn default() -> Self {
        Self([0; ENCODED_BYTES])
    }
}

impl PosteriorHeader {
    /// What a posterior begins with.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"BHM post");
    /// The layout described here, of header and tiles.
    pub const VERSION: u32 = 3;
    /// Flag: the source has ended, and its last scan is dealt with.
    pub const ENDED: u32 = 1;
    const LAYOUT: Layout =
        Layout { what: "posterior message", magic: Self::MAGIC, version: Self::VERSION, flags: Self::ENDED };

    /// Where the sensor stood at the newest scan integrated.
    #[must_use]
    pub fn map_from_sensor(&self) -> Pose {
        Pose::new(self.x_m, self.y_m, self.theta_rad)
    }

    /// Whether the source has ended, and its last scan is dealt with.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.flags & Self::ENDED != 0
    }

    pub(super) fn write(
        &mut self,
        settings: &Settings,
        supports: Option<&LearnedSupports>,
        shape: (usize, usize),
        news: &PosteriorNews,
    ) {
        let (source, scan_sequence) = news.handled.unwrap_or((0, 0));
        let mut encoded = [0; ENCODED_BYTES];
        // They fit: a test of the core's encodes every variant. A header without settings would be refused by every reader.
        let settings_bytes = postcard::to_slice(settings, &mut encoded).map_or(0, |used| used.len()) as u32;
        *self = Self {
            magic: Self::MAGIC,
            version: Self::VERSION,
            flags: if news.ended { Self::ENDED } else { 0 },
            source,
            scan_sequence,
            archived: news.archived,
            lost: news.lost,
            x_m: news.map_from_sensor.x_m,
            y_m: news.map_from_sensor.y_m,
            theta_rad: news.map_from_sensor.theta_rad,
            supports: shape.0 as u32,
            band: shape.1 as u32,
            supports_digest: supports.map_or(0, LearnedSupports::digest),
            settings_bytes,
            settings: EncodedSettings(encoded),
            ..Self::default()
        };
    }

    /// What the posterior's tiles are asked by, if header and tiles can be used and `supports` are those that the
    /// header names.
    ///
    /// What is inside a tile is not looked at: numbers that are not finite give answers that are not, and nothing worse.
    ///
    /// # Errors
    /// The first fault found in the header or the tiles.
    pub fn check<const M: usize, const B: usize>(
        &self,
        tiles: &[PosteriorTile<M, B>],
        supports: Option<&LearnedSupports>,
    ) -> Result<PosteriorModel<M, B>, PosteriorRejected> {
        self.check_knowing(tiles, supports, &mut None)
    }

    /// As [`check`](Self::check), for a reader of one posterior after the other.
    pub(super) fn check_knowing<const M: usize, const B: usize>(
        &self,
        tiles: &[PosteriorTile<M, B>],
        supports: Option<&LearnedSupports>,
        known: &mut KnownModel<M, B>,
    ) -> Result<PosteriorModel<M, B>, PosteriorRejected> {
        Self::LAYOUT.check(self.magic, self.version, self.flags)?;
        if self.mapper == 0 || self.sequence == 0 {
            return Err(PosteriorRejected::Unnumbered);
        }
        let settings = self.settings()?;
        // Before anything multiplies them: the product of widths is then the product of two small numbers.
        let nodes = settings.tile.width.iter().try_fold(1_usize, |nodes, width| nodes.checked_mul(*width));
        if (self.supports as usize, self.band as usize) != (M, B) || nodes != Some(M) {
            return Err(PosteriorRejected::Shape { supports: self.supports, band: self.band });
        }
        if self.resident != tiles.len() as u64 {
            return Err(PosteriorRejected::Count { claimed: self.resident, arrived: tiles.len() });
        }
        if let Some(before) = tiles.windows(2).position(|pair| pair[0].index >= pair[1].index) {
            return Err(PosteriorRejected::Order { at: before + 1 });
        }
        if !self.map_from_sensor().is_finite() {
            return Err(PosteriorRejected::Pose);
        }
        if let Some((.., model)) = known.as_ref().filter(|known| (known.0, known.1) == (settings, self.supports_digest))
        {
            return Ok(model.clone());
        }
        let supports = match (self.supports_digest, supports) {
            (0, _) => None,
            (digest, Some(supports)) if supports.digest() == digest => Some(supports),
            (digest, _) => return Err(PosteriorRejected::SupportsMissing { digest }),
        };
        supports.map_or(Ok(()), |supports| supports.matches(&settings)).map_err(SupportsRejected::from)?;
        let model = PosteriorModel::of(settings.model_with(table_of(supports))?)?;
        *known = Some((settings, self.supports_digest, model.clone()));
        Ok(model)
    }

    /// What the map was made with.
    ///
    /// # Errors
    /// [`PosteriorRejected::Settings`] or [`PosteriorRejected::SettingsEncoding`].
    pub fn settings(&self) -> Result<Settings, PosteriorRejected> {
        let encoded = self.settings.0.get(..self.settings_bytes as usize).ok_or(PosteriorRejected::SettingsEncoding)?;
        match postcard::take_from_bytes(encoded) {
            Ok((settings, [])) => Ok(settings),
            _ => Err(PosteriorRejected::SettingsEncoding),
        }
    }
}

impl<const M: usize, const B: usize> PosteriorTile<M, B> {
    /// Writes a tile over whatever was here, array by array.
    pub fn write(&mut self, tile: &SourceTile<'_, M, B>) {
        let PosteriorView { mean, covariance, border_covariance, bias_covariance, bias_mean } = tile.view;
        self.touched_at = tile.touched_at;
        self.updates = tile.updates;
        self.index = tile.index;
        self.bias_covariance = bias_covariance;
        self.bias_mean = bias_mean;
        self.mean.copy_from_slice(mean);
        self.border_covariance.copy_from_slice(border_covariance);
        self.covariance.copy_from_slice(covariance);
    }

    /// The part that queries read.
    #[must_use]
    pub fn view(&self) -> PosteriorView<'_, M, B> {
        PosteriorView {
            mean: &self.mean,
            covariance: &self.covariance,
            border_covariance: &self.border_covariance,
            bias_covariance: self.bias_covariance,
            bias_mean: self.bias_mean,
        }
    }
}
