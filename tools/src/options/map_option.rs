//! Every map option: its flag, its environment variable, and where its value stands in a configuration.
//!
//! A setting is defined, checked, encoded and documented by the core alone; here stands only what a command line calls it. A
//! setting without a flag is set by a configuration file.

/// A map option.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapOption {
    /// The flag without its dashes.
    pub(crate) flag: &'static str,
    /// The environment variable.
    pub(crate) variable: &'static str,
    /// Where the value stands in a configuration, key by key with dots between them; [`VARIANT`] stands for whichever is chosen there.
    pub(crate) path: &'static str,
    /// What kind of value it is.
    pub(crate) kind: Kind,
    /// What help calls the value.
    pub(crate) value_name: &'static str,
    /// What the option means, with its unit and effect.
    pub(crate) help: &'static str,
}

/// What kind of value an option takes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// A number.
    Number,
    /// A number of things.
    Count,
    /// One of these names.
    Choice,
    /// On or off.
    Switch,
    /// The name of a file.
    File,
}

/// In a path: the variant that is chosen, such as the beam rule's name below `settings.beam`.
pub(crate) const VARIANT: &str = "*";

/// One line for each option: flag, variable, path, kind, name of the value, help.
macro_rules! map_options {
    ($($flag:literal $variable:literal $path:literal $kind:expr, $value:literal, $help:literal;)*) => {
        /// Every map option. Choices stand before the settings of what is chosen, which are set in this order.
        pub(crate) const MAP_OPTIONS: &[MapOption] = &[
            $(MapOption {
                flag: $flag,
                variable: $variable,
                path: $path,
                kind: $kind,
                value_name: $value,
                help: $help,
            }),*
        ];
    };
}

use Kind::{Choice, Count, File, Number, Switch};

map_options! {
    "profile" "BHM_PROFILE" "profile" Choice, "NAME",
        "Named defaults for everything below [default: indoor]";
    "spacing" "BHM_SPACING" "settings.spacing_m" Number, "M",
        "Distance between supports, metres: the finest detail. Half of it needs four times as many tiles; lengths of the \
         sensor (--gap, --free-spacing, ranges) stay as they are, and a bounded area (profile paper) shrinks with it";
    "kernel" "BHM_KERNEL" "settings.kernel" Choice, "NAME",
        "How strongly a support is correlated with a point";
    "kernel-shape" "BHM_KERNEL_SHAPE" "settings.kernel.*.shape" Number, "X",
        "Square of a kernel's width, in units of spacing^2: the g of exp(-d^2/g). Of kernels of free width \
         (squared-exponential, two-scales) alone";
    "support" "BHM_SUPPORT" "settings.support" Choice, "NAME",
        "What a support is centred on: a point, or an area that it averages the kernel over";
    "support-size" "BHM_SUPPORT_SIZE" "settings.support.*.size" Number, "X",
        "How large the area of a support is, in spacings: a Gaussian's standard deviation, a rectangle's side";
    "support-samples" "BHM_SUPPORT_SAMPLES" "settings.support.*.samples" Count, "N",
        "Samples a side by which a rectangle averages the kernel; 0 for the closed form";
    "supports" "BHM_SUPPORTS" "supports" File, "FILE",
        "File of learned supports: nodes in it have a support of their own, of whatever shape the file says";
    "beam-rule" "BHM_BEAM_RULE" "settings.beam" Choice, "NAME",
        "Which observations a beam gives: free points and the hit, or a chain of line segments and the hit";
    "segment-length" "BHM_SEGMENT_LENGTH" "settings.beam.*.length" Number, "X",
        "Longest line segment, in spacings";
    "segment-samples" "BHM_SEGMENT_SAMPLES" "settings.beam.*.samples" Count, "N",
        "Samples by which the kernel is averaged along a segment; 0 for the closed form";
    "free-spacing" "BHM_FREE_SPACING" "settings.beam.*.free_spacing_m" Number, "M",
        "Longest piece of a beam for which one free point stands, metres";
    "gap" "BHM_GAP" "settings.beam.*.gap_m" Number, "M",
        "Length before a hit that is left unlabelled, metres: two or three standard deviations of the range noise";
    "rule" "BHM_RULE" "settings.rule" Choice, "NAME",
        "How observations are weighed";
    "passes" "BHM_PASSES" "settings.passes" Count, "N",
        "Passes over each scan: more gain accuracy and take time";
    "prior" "BHM_PRIOR" "settings.prior" Choice, "NAME",
        "What is believed before any scan: a matern field, in which neighbouring places are alike (of the cubic-b-spline alone), \
         or independent (white) weights";
    "prior-deviation" "BHM_PRIOR_DEVIATION" "settings.prior.*.deviation" Number, "X",
        "Standard deviation of the log-odds before any scan; smaller makes the map cautious. Of the matern prior";
    "prior-range" "BHM_PRIOR_RANGE" "settings.prior.*.range_m" Number, "M",
        "Distance over which places are believed to be alike, metres. Of the matern prior";
    "prior-precision" "BHM_PRIOR_PRECISION" "settings.prior.*.precision" Number, "X",
        "Precision of each weight before any scan; smaller lets a single beam decide more. Of the white prior";
    "bias" "BHM_BIAS" "settings.bias" Switch, "ON|OFF",
        "Whether the map has a bias, one weight common to all places: on or off";
    "forgetting" "BHM_FORGETTING" "settings.forgetting" Number, "X",
        "Part of what a tile knows that it keeps when new data arrives in it; 1 forgets nothing";
    "max-range" "BHM_MAX_RANGE" "max_range_m" Number, "M",
        "The sensor's maximum range, metres: readings at and beyond it mean that nothing returned [default: stated by the \
         data, or found from the log and printed]";
    "range-limit" "BHM_RANGE_LIMIT" "settings.limits.range_max_m" Number, "M",
        "Longest range that is believed, metres: a hit beyond it says that the beam was free up to here";
    "no-return-free" "BHM_NO_RETURN_FREE" "settings.limits.no_return_free_m" Number, "M",
        "Range up to which a beam without return says \"free\", metres; 0 learns nothing from it";
    "pose-deviation" "BHM_POSE_DEVIATION" "pose_deviation_m" Number, "M",
        "Standard deviation of the position in the scans' poses along each axis, metres, where the scans do not say; 0 if they \
         are exact";
    "heading-deviation" "BHM_HEADING_DEVIATION" "heading_deviation_rad" Number, "RAD",
        "Standard deviation of the heading in the scans' poses, radians, where the scans do not say; 0 if it is exact";
    "slots" "BHM_SLOTS" "capacities.tiles" Count, "N",
        "Tiles in the store; others wait in an archive and come back as they were, so that the map does not depend on it";
}

impl MapOption {
    /// The option of that flag.
    pub(crate) fn named(flag: &str) -> Option<&'static Self> {
        MAP_OPTIONS.iter().find(|option| option.flag == flag)
    }

    /// Whether the option decides which observations are learned.
    pub(crate) fn changes_observations(&self) -> bool {
        self.path.starts_with("settings.beam") || self.path.starts_with("settings.limits")
    }
}
