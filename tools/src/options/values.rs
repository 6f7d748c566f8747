use std::path::{Path, PathBuf};

use bhm_core::{
    beam::BeamChoice,
    kernel::{Averaging, KernelChoice},
    profile::{self, Profile},
    rule::AnyRule,
    settings::Settings,
    support::{SupportChoice, SupportTable},
};
use bhm_host::supports::{LearnedSupports, SupportsError};
use clap::{Args, builder::BoolishValueParser};
use serde::{Deserialize, Serialize};

use super::{
    Effective, Number, PoseDeviations, SupportsFile,
    choice::{Choice, parser},
};

/// Most tiles of one scan, and tile slots, that a finer spacing asks for by itself.
const MAX_SCALED_TILES: usize = 1 << 14;

/// What may be chosen: flags, and the keys of a configuration file. What is absent is the profile's.
#[derive(Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(crate) struct MapValues {
    /// Named defaults for everything below [default: indoor]
    #[arg(long, env = "BHM_PROFILE", value_parser = parser::<&'static Profile>(), value_name = "NAME")]
    profile: Option<Choice<&'static Profile>>,
    /// Distance between supports, metres: the finest detail. Half of it needs four times as many tiles; lengths of the
    /// sensor (--gap, --free-spacing, ranges) stay as they are, and a bounded area (profile paper) shrinks with it
    #[arg(long, env = "BHM_SPACING", value_name = "M")]
    spacing: Option<f32>,
    /// How far a support reaches
    #[arg(long, env = "BHM_KERNEL", value_parser = parser::<KernelChoice>(), value_name = "NAME")]
    kernel: Option<Choice<KernelChoice>>,
    /// Square of a kernel's width, in units of spacing^2: the g of exp(-d^2/g). Read by kernels of free width
    /// (squared-exponential) alone
    #[arg(long, env = "BHM_KERNEL_SHAPE", value_name = "X")]
    kernel_shape: Option<f32>,
    /// What a support is centred on: a point, or an area that it averages the kernel over
    #[arg(long, env = "BHM_SUPPORT", value_parser = parser::<SupportChoice>(), value_name = "NAME")]
    support: Option<Choice<SupportChoice>>,
    /// How large the area of a support is, in spacings: a Gaussian's standard deviation, a rectangle's side
    #[arg(long, env = "BHM_SUPPORT_SIZE", value_name = "X")]
    support_size: Option<f32>,
    /// Samples a side by which a rectangle averages the kernel; 0 for the closed form
    #[arg(long, env = "BHM_SUPPORT_SAMPLES", value_name = "N")]
    support_samples: Option<u32>,
    /// File of learned supports: nodes in it have a support of their own, of whatever shape the file says
    #[arg(long, env = "BHM_SUPPORTS", value_name = "FILE")]
    supports: Option<PathBuf>,
    /// What a beam says: free points and the hit, or a chain of line segments and the hit
    #[arg(long, env = "BHM_BEAM_RULE", value_parser = parser::<BeamChoice>(), value_name = "NAME")]
    beam_rule: Option<Choice<BeamChoice>>,
    /// Longest line segment, in spacings
    #[arg(long, env = "BHM_SEGMENT_LENGTH", value_name = "X")]
    segment_length: Option<f32>,
    /// Samples by which the kernel is averaged along a segment; 0 for the closed form
    #[arg(long, env = "BHM_SEGMENT_SAMPLES", value_name = "N")]
    segment_samples: Option<u32>,
    /// How observations are weighed
    #[arg(long, env = "BHM_RULE", value_parser = parser::<AnyRule>(), value_name = "NAME")]
    rule: Option<Choice<AnyRule>>,
    /// Passes over each scan: more gain accuracy and take time
    #[arg(long, env = "BHM_PASSES", value_name = "N")]
    passes: Option<u32>,
    /// Precision of each weight before any scan; smaller lets a single beam decide more
    #[arg(long, env = "BHM_PRIOR_PRECISION", value_name = "X")]
    prior_precision: Option<f32>,
    /// Whether the map has a bias, one weight common to all places: on or off
    #[arg(long, env = "BHM_BIAS", value_parser = BoolishValueParser::new(), value_name = "ON|OFF")]
    bias: Option<bool>,
    /// Part of what a tile knows that it keeps when new data arrives in it; 1 forgets nothing
    #[arg(long, env = "BHM_FORGETTING", value_name = "X")]
    forgetting: Option<f32>,
    /// The sensor's maximum range, metres: readings at and beyond it mean that nothing returned [default: stated by the
    /// data, or found from the log and printed]
    #[arg(long, env = "BHM_MAX_RANGE", value_name = "M")]
    max_range: Option<f32>,
    /// Longest range that is believed, metres: a hit beyond it says that the beam was free up to here
    #[arg(long, env = "BHM_RANGE_LIMIT", value_name = "M")]
    range_limit: Option<f32>,
    /// Range up to which a beam without return says "free", metres; 0 learns nothing from it
    #[arg(long, env = "BHM_NO_RETURN_FREE", value_name = "M")]
    no_return_free: Option<f32>,
    /// Longest piece of a beam for which one free point stands, metres
    #[arg(long, env = "BHM_FREE_SPACING", value_name = "M")]
    free_spacing: Option<f32>,
    /// Length before a hit that is left unlabelled, metres: two or three standard deviations of the range noise
    #[arg(long, env = "BHM_GAP", value_name = "M")]
    gap: Option<f32>,
    /// Standard deviation of the position in the scans' poses along each axis, metres, where the scans do not say; 0 if they
    /// are exact
    #[arg(long, env = "BHM_POSE_DEVIATION", value_name = "M")]
    pose_deviation: Option<f32>,
    /// Standard deviation of the heading in the scans' poses, radians, where the scans do not say; 0 if it is exact
    #[arg(long, env = "BHM_HEADING_DEVIATION", value_name = "RAD")]
    heading_deviation: Option<f32>,
    /// Tiles in the store; others wait in an archive and come back as they were, so that the map does not depend on it
    #[arg(long, env = "BHM_SLOTS", value_name = "N")]
    slots: Option<usize>,
}

impl MapValues {
    /// These, and where they are silent, `other`'s.
    pub(super) fn or(&self, other: &Self) -> Self {
        Self {
            profile: self.profile.or(other.profile),
            spacing: self.spacing.or(other.spacing),
            kernel: self.kernel.or(other.kernel),
            kernel_shape: self.kernel_shape.or(other.kernel_shape),
            support: self.support.or(other.support),
            support_size: self.support_size.or(other.support_size),
            support_samples: self.support_samples.or(other.support_samples),
            supports: self.supports.clone().or_else(|| other.supports.clone()),
            beam_rule: self.beam_rule.or(other.beam_rule),
            segment_length: self.segment_length.or(other.segment_length),
            segment_samples: self.segment_samples.or(other.segment_samples),
            rule: self.rule.or(other.rule),
            passes: self.passes.or(other.passes),
            prior_precision: self.prior_precision.or(other.prior_precision),
            bias: self.bias.or(other.bias),
            forgetting: self.forgetting.or(other.forgetting),
            max_range: self.max_range.or(other.max_range),
            range_limit: self.range_limit.or(other.range_limit),
            no_return_free: self.no_return_free.or(other.no_return_free),
            free_spacing: self.free_spacing.or(other.free_spacing),
            gap: self.gap.or(other.gap),
            pose_deviation: self.pose_deviation.or(other.pose_deviation),
            heading_deviation: self.heading_deviation.or(other.heading_deviation),
            slots: self.slots.or(other.slots),
        }
    }

    /// Where one of the numbers stands.
    pub(super) fn number_mut(&mut self, number: Number) -> &mut Option<f32> {
        match number {
            Number::Spacing => &mut self.spacing,
            Number::KernelShape => &mut self.kernel_shape,
            Number::PriorPrecision => &mut self.prior_precision,
            Number::FreeSpacing => &mut self.free_spacing,
            Number::Gap => &mut self.gap,
        }
    }

    /// Takes the profile of that name, where none is chosen.
    pub(super) fn with_default_profile(mut self, profile: &'static Profile) -> Self {
        self.profile.get_or_insert(Choice(profile));
        self
    }

    /// The file of learned supports.
    pub(super) fn supports(&self) -> Option<&Path> {
        self.supports.as_deref()
    }

    /// What they come to with these learned supports, or what is wrong with them.
    pub(super) fn effective(&self, supports: Option<&SupportsFile>) -> Result<Effective, String> {
        let mut profile = *self.profile.map_or(&profile::INDOOR, |choice| choice.0);
        let named = profile;
        let settings = &mut profile.settings;
        // A profile's own parameters of a rule are kept when the rule is named again.
        if let Some(Choice(rule)) = self.rule.filter(|choice| choice.0.name() != settings.rule.name()) {
            settings.rule = rule;
        }
        set(&mut settings.kernel, self.kernel.map(|choice| choice.0));
        set(&mut settings.support, self.support.map(|choice| choice.0));
        set(&mut settings.support_size, self.support_size);
        set(&mut settings.support_averaging, self.support_samples.map(averaging));
        set(&mut settings.beam, self.beam_rule.map(|choice| choice.0));
        set(&mut settings.segment_length, self.segment_length);
        set(&mut settings.segment_averaging, self.segment_samples.map(averaging));
        set(&mut settings.free_spacing_m, self.free_spacing);
        set(&mut settings.gap_m, self.gap);
        set(&mut settings.limits.range_max_m, self.range_limit);
        set(&mut settings.limits.no_return_free_m, self.no_return_free);
        set(&mut settings.spacing_m, self.spacing);
        set(&mut settings.kernel_shape, self.kernel_shape);
        set(&mut settings.passes, self.passes);
        set(&mut settings.prior_precision, self.prior_precision);
        set(&mut settings.bias, self.bias);
        set(&mut settings.forgetting, self.forgetting);
        let table = supports.map_or(SupportTable::EMPTY, |file| file.supports.table());
        *settings = settings.fitted(table);
        settings.model().map_err(|error| error.to_string())?;
        if let Some(SupportsFile { path, supports }) = supports {
            let file = path.display();
            supports.matches(settings).map_err(|error| format!("{file}: {error}; {}", remedy(supports, &error)))?;
            settings.model_with(table).map_err(|error| format!("{file}: {error}"))?;
        }
        let poses = PoseDeviations {
            pose_deviation: self.pose_deviation.unwrap_or_default(),
            heading_deviation: self.heading_deviation.unwrap_or_default(),
        };
        poses.check()?;
        if let Some(max_range) = self.max_range.filter(|range| !(range.is_finite() && *range > 0.0)) {
            return Err(format!("maximum range is {max_range}, expected a positive number"));
        }
        make_room(&mut profile, &named.settings);
        set(&mut profile.capacities.tiles, self.slots);
        Ok(Effective { profile, max_range_m: self.max_range, poses, supports: supports.cloned() })
    }

    /// Every value, such that [`effective`](Self::effective) gives this back with the same supports.
    pub(crate) fn of(effective: &Effective) -> Self {
        let Effective { profile, max_range_m, poses, supports } = effective;
        let settings = &profile.settings;
        Self {
            profile: profile::named(profile.name).map(Choice),
            spacing: Some(settings.spacing_m),
            kernel: Some(Choice(settings.kernel)),
            kernel_shape: Some(settings.kernel_shape),
            support: Some(Choice(settings.support)),
            support_size: Some(settings.support_size),
            support_samples: Some(samples(settings.support_averaging)),
            supports: supports.as_ref().map(|file| file.path.clone()),
            beam_rule: Some(Choice(settings.beam)),
            segment_length: Some(settings.segment_length),
            segment_samples: Some(samples(settings.segment_averaging)),
            rule: Some(Choice(settings.rule)),
            passes: Some(settings.passes),
            prior_precision: Some(settings.prior_precision),
            bias: Some(settings.bias),
            forgetting: Some(settings.forgetting),
            max_range: *max_range_m,
            range_limit: Some(settings.limits.range_max_m),
            no_return_free: Some(settings.limits.no_return_free_m),
            free_spacing: Some(settings.free_spacing_m),
            gap: Some(settings.gap_m),
            pose_deviation: Some(poses.pose_deviation),
            heading_deviation: Some(poses.heading_deviation),
            slots: Some(profile.capacities.tiles),
        }
    }
}

/// Which options make a map that these supports fit.
fn remedy(supports: &LearnedSupports, error: &SupportsError) -> String {
    let alike = profile::ALL.into_iter().filter(|profile| supports.matches(&profile.settings).is_ok());
    let names: Vec<_> = alike.map(|profile| format!("--profile {}", profile.name)).collect();
    match error {
        SupportsError::Spacing { learned_m, .. } => {
            let spacing = format!("--spacing {learned_m}");
            format!("give {}", [vec![spacing], names].concat().join(" or "))
        }
        _ if names.is_empty() => "no profile's lattice begins there".to_owned(),
        _ => format!("give {}", names.join(" or ")),
    }
}

/// As a number of samples, of which 0 is the closed form.
fn averaging(samples: u32) -> Averaging {
    if samples == 0 { Averaging::Exact } else { Averaging::Samples(samples) }
}

fn samples(averaging: Averaging) -> u32 {
    match averaging {
        Averaging::Exact => 0,
        Averaging::Samples(count) => count,
    }
}

fn set<T>(to: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *to = value;
    }
}

/// Gives a map that is finer than its profile the tiles that the same area then takes. A coarser one keeps the profile's.
fn make_room(profile: &mut Profile, named: &Settings) {
    let ratio = named.spacing_m / profile.settings.spacing_m;
    if ratio > 1.0 && profile.settings.tile_count.is_none() {
        let capacities = &mut profile.capacities;
        for tiles in [&mut capacities.tiles, &mut capacities.touched] {
            *tiles = ((*tiles as f32 * ratio * ratio).ceil() as usize).clamp(*tiles, MAX_SCALED_TILES);
        }
    }
}
