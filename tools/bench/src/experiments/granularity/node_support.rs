//! What can stand at a node.

use bhm_core::{kernel::Averaging, settings::Settings, support::SupportChoice};
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
        let (support, support_size, support_averaging) = match self {
            Self::Points | Self::Learned => (SupportChoice::PointSupport, 1.0, Averaging::Exact),
            Self::Sampled(count) => (SupportChoice::RectangularSupport, 1.0, Averaging::Samples(count)),
            Self::Exact => (SupportChoice::RectangularSupport, 1.0, Averaging::Exact),
            Self::Isotropic(size) => (SupportChoice::GaussianSupport, size, Averaging::Exact),
        };
        Settings { support, support_size, support_averaging, ..*base }
    }

    /// What has to be learned first.
    pub(super) fn learned(
        self,
        split: &BeamSplit,
        settings: &Settings,
    ) -> anyhow::Result<Option<&'static LearnedSupports>> {
        if self != Self::Learned {
            return Ok(None);
        }
        let learned = learn_relevance(|| &split.training, settings, &RelevanceOptions::DEFAULT, String::new())?;
        Ok(Some(learned.supports.interned()))
    }
}
