use bhm_core::{
    geometry::Pose,
    kernel::{Averaging, KernelChoice},
    posterior::{Band, PosteriorView},
    profile,
    settings::{Model, Settings, SettingsError},
    support::SupportChoice,
    tile::TileIndex,
};
use iceoryx2::prelude::ZeroCopySend;

use super::{
    PosteriorNews, PosteriorRejected, SourceTile, SupportsRejected,
    wire::{Name, PlainNumbers, name_of, text_of},
};
use crate::supports::{LearnedSupports, table_of};

/// What stands before the tiles of a posterior: whose it is, how new, and everything needed to ask it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("bhm.posterior.v2")]
pub struct PosteriorHeader {
    /// [`PosteriorHeader::MAGIC`].
    pub magic: u64,
    /// [`PosteriorHeader::VERSION`].
    pub version: u32,
    /// [`PosteriorHeader::ENDED`], [`PosteriorHeader::BIAS`], [`PosteriorHeader::BOUNDED`].
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
    /// Where lattice node 0 sits, metres.
    pub origin_m: [f32; 2],
    /// Distance between supports, metres.
    pub spacing_m: f32,
    /// The kernel's shape, in units of spacing².
    pub kernel_shape: f32,
    /// Size of a support's area, in spacings.
    pub support_size: f32,
    /// Samples a side by which the kernel is averaged over a support's area; 0 where the average is in closed form.
    pub support_samples: u32,
    /// Prior precision of each weight.
    pub prior_precision: f32,
    /// Prior precision of the bias.
    pub bias_precision: f32,
    /// Supports of a tile, `M`.
    pub supports: u32,
    /// Width of a tile's band, `B`.
    pub band: u32,
    /// Supports a side that a point sees.
    pub stencil: u32,
    /// Supports of a tile along each axis.
    pub tile_width: [u32; 2],
    /// Supports from one tile to the next along each axis.
    pub tile_stride: [u32; 2],
    /// With [`PosteriorHeader::BOUNDED`], how many tiles there are along each axis; else 0.
    pub tile_count: [u32; 2],
    /// The [digest](crate::supports::LearnedSupports::digest) of the supports of their own that nodes have; 0 for none.
    pub supports_digest: u32,
    /// Zero.
    pub reserved: u32,
    /// The kernel's name, UTF-8, filled up with zeros.
    pub kernel: Name,
    /// The support's name, UTF-8, filled up with zeros.
    pub support: Name,
}

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
pub(super) type KnownModel = Option<(Settings, u32, Model<'static>)>;

impl PosteriorHeader {
    /// What a posterior begins with.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"BHM post");
    /// The layout described here, of header and tiles.
    pub const VERSION: u32 = 2;
    /// Flag: the source has ended, and its last scan is dealt with.
    pub const ENDED: u32 = 1;
    /// Flag: there is a bias.
    pub const BIAS: u32 = 2;
    /// Flag: the plane is bounded.
    pub const BOUNDED: u32 = 4;

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
        let flag = |set, flag| if set { flag } else { 0 };
        let (source, scan_sequence) = news.handled.unwrap_or((0, 0));
        *self = Self {
            magic: Self::MAGIC,
            version: Self::VERSION,
            flags: flag(news.ended, Self::ENDED)
                | flag(settings.bias, Self::BIAS)
                | flag(settings.tile_count.is_some(), Self::BOUNDED),
            source,
            scan_sequence,
            archived: news.archived,
            lost: news.lost,
            x_m: news.map_from_sensor.x_m,
            y_m: news.map_from_sensor.y_m,
            theta_rad: news.map_from_sensor.theta_rad,
            origin_m: settings.origin_m,
            spacing_m: settings.spacing_m,
            kernel_shape: settings.kernel_shape,
            support_size: settings.support_size,
            support_samples: match settings.support_averaging {
                Averaging::Exact => 0,
                Averaging::Samples(count) => count,
            },
            prior_precision: settings.prior_precision,
            bias_precision: settings.bias_precision,
            supports: shape.0 as u32,
            band: shape.1 as u32,
            stencil: settings.stencil as u32,
            tile_width: settings.tile_width.map(|width| width as u32),
            tile_stride: settings.tile_stride.map(|stride| stride as u32),
            tile_count: settings.tile_count.unwrap_or([0; 2]).map(|count| count as u32),
            supports_digest: supports.map_or(0, LearnedSupports::digest),
            kernel: name_of(settings.kernel.name()),
            support: name_of(settings.support.name()),
            ..Self::default()
        };
    }

    /// The functions that the posterior was made with, if header and tiles can be used and `supports` are those that the
    /// header names.
    ///
    /// What is inside a tile is not looked at: numbers that are not finite give answers that are not, and nothing worse.
    ///
    /// # Errors
    /// The first fault found in the header or the tiles.
    pub fn check<const M: usize, const B: usize>(
        &self,
        tiles: &[PosteriorTile<M, B>],
        supports: Option<&'static LearnedSupports>,
    ) -> Result<Model<'static>, PosteriorRejected> {
        self.check_knowing(tiles, supports, &mut None)
    }

    /// As [`check`](Self::check), for a reader of one posterior after the other.
    pub(super) fn check_knowing<const M: usize, const B: usize>(
        &self,
        tiles: &[PosteriorTile<M, B>],
        supports: Option<&'static LearnedSupports>,
        known: &mut KnownModel,
    ) -> Result<Model<'static>, PosteriorRejected> {
        if self.magic != Self::MAGIC {
            return Err(PosteriorRejected::Magic { found: self.magic });
        }
        if self.version != Self::VERSION {
            return Err(PosteriorRejected::Version { found: self.version });
        }
        if self.flags & !(Self::ENDED | Self::BIAS | Self::BOUNDED) != 0 {
            return Err(PosteriorRejected::Flags { found: self.flags });
        }
        if self.reserved != 0 {
            return Err(PosteriorRejected::Flags { found: self.reserved });
        }
        if self.mapper == 0 || self.sequence == 0 {
            return Err(PosteriorRejected::Unnumbered);
        }
        // Before anything multiplies them: the product of widths is then the product of two small numbers.
        let [width, height] = self.tile_width.map(u64::from);
        if (self.supports as usize, self.band as usize) != (M, B) || width * height != M as u64 {
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
        let settings = self.settings()?;
        if let Some((_, _, model)) = known.filter(|known| (known.0, known.1) == (settings, self.supports_digest)) {
            return Ok(model);
        }
        let supports = match (self.supports_digest, supports) {
            (0, _) => None,
            (digest, Some(supports)) if supports.digest() == digest => Some(supports),
            (digest, _) => return Err(PosteriorRejected::SupportsMissing { digest }),
        };
        supports.map_or(Ok(()), |supports| supports.matches(&settings)).map_err(SupportsRejected::from)?;
        let model = settings.model_with(table_of(supports))?;
        model.tiling.check(M, B).map_err(SettingsError::from)?;
        *known = Some((settings, self.supports_digest, model));
        Ok(model)
    }

    /// The settings that queries depend on; what only learning needs is a profile's, not the mapper's.
    fn settings(&self) -> Result<Settings, PosteriorRejected> {
        let kernel = text_of(&self.kernel).and_then(|name| KernelChoice::ALL.iter().find(|k| k.name() == name));
        let support = text_of(&self.support).and_then(|name| SupportChoice::ALL.iter().find(|s| s.name() == name));
        let sizes = |of: [u32; 2]| of.map(|size| size as usize);
        Ok(Settings {
            origin_m: self.origin_m,
            spacing_m: self.spacing_m,
            kernel: *kernel.ok_or(PosteriorRejected::Kernel)?,
            kernel_shape: self.kernel_shape,
            support: *support.ok_or(PosteriorRejected::Support)?,
            support_size: self.support_size,
            support_averaging: if self.support_samples == 0 {
                Averaging::Exact
            } else {
                Averaging::Samples(self.support_samples)
            },
            stencil: self.stencil as usize,
            tile_width: sizes(self.tile_width),
            tile_stride: sizes(self.tile_stride),
            tile_count: (self.flags & Self::BOUNDED != 0).then(|| sizes(self.tile_count)),
            prior_precision: self.prior_precision,
            bias_precision: self.bias_precision,
            bias: self.flags & Self::BIAS != 0,
            ..profile::INDOOR.settings
        })
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
