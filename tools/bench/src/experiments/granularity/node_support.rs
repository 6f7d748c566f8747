//! What can stand at a node.

use bhm_core::{
    kernel::Averaging,
    settings::Settings,
    support::{GaussianSettings, PointSettings, RectangleSettings, SupportSettings},
};
use bhm_host::supports::{LearnedSupports, RelevanceOptions, learn_relevance};

use crate::evaluation::BeamSplit;

/// What stands at every node. Sizes are in spacings; a rectangle's side is one, so that rectangles tessellate the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NodeSupport {
    Points,
    /// Rectangles that so many samples a side stand for.
    Sampled(u32),
    /// Rectangles in closed form.
    Exact,
    /// Gaussians of this standard deviation.
    Isotropic(f32),
    /// Gaussians whose shape was learned from the training beams.
    Learned,
}

impl NodeSupport {
    pub(super) fn name(self) -> String {
        match self {
            Self::Points => "points".to_owned(),
            Self::Sampled(count) => format!("rectangles, {count} x {count} samples"),
            Self::Exact => "rectangles, closed form".to_owned(),
            Self::Isotropic(size) => format!("Gaussians, {size} spacings"),
            Self::Learned => "Gaussians, learned".to_owned(),
        }
    }

    /// The settings with this at every node, but for what has to be learned.
    pub(super) fn settings(self, base: &Settings) -> Settings {
        let rectangle = |samples| SupportSettings::RectangularSupport(RectangleSettings { size: 1.0, samples });
        let support = match self {
            Self::Points | Self::Learned => SupportSettings::PointSupport(PointSettings::DEFAULT),
            Self::Sampled(count) => rectangle(Averaging::Samples(count)),
            Self::Exact => rectangle(Averaging::Exact),
            Self::Isotropic(size) => SupportSettings::GaussianSupport(GaussianSettings { size }),
        };
        Settings { support, ..*base }
    }

    /// What has to be learned first.
    pub(super) fn learned(self, split: &BeamSplit, settings: &Settings) -> anyhow::Result<Option<LearnedSupports>> {
        if self != Self::Learned {
            return Ok(None);
        }
        let learned = learn_relevance(|| &split.training, settings, &RelevanceOptions::DEFAULT, String::new())?;
        Ok(Some(learned.supports))
    }
}
