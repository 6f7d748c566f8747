//! Supports for tests.

use bhm_core::{
    kernel::{Averaging, KernelSettings},
    lattice::Window,
    support::{GaussianSettings, PointSettings, RectangleSettings, SupportSettings},
};

use super::{LearnedSupports, LearnedWith};

/// Every kind of support there is, in several sizes, over a window of 3 by 4 nodes at 0.5 m.
pub(crate) fn some() -> LearnedSupports {
    over(0.5, Window { first: [-1, 2], width: [3, 4] })
}

/// The same kinds over every node that a robot in the simulated building sees, and beyond.
pub(crate) fn over_a_building(spacing_m: f32) -> LearnedSupports {
    let nodes = (30.0 / spacing_m) as i32;
    over(spacing_m, Window { first: [-nodes; 2], width: [2 * nodes as usize; 2] })
}

fn over(spacing_m: f32, window: Window<2>) -> LearnedSupports {
    let supports = (0..window.supports()).map(|number| {
        let samples = if number % 2 == 0 { Averaging::Exact } else { Averaging::Samples(3) };
        // So small that the spline's own stencil holds them.
        let size = 0.1 + 0.005 * (number % 12) as f32;
        let kinds = [
            SupportSettings::PointSupport(PointSettings::DEFAULT),
            SupportSettings::GaussianSupport(GaussianSettings { size }),
            SupportSettings::RectangularSupport(RectangleSettings { size, samples }),
        ];
        kinds[number % kinds.len()].build(spacing_m)
    });
    let learned_with = LearnedWith { kernel: KernelSettings::ALL[0], source: "a test".to_owned() };
    LearnedSupports::new([0.0; 2], spacing_m, window, supports.collect(), Some(learned_with)).expect("good supports")
}
