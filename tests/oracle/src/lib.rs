//! What tests compare with: recorded data, and the oracle, the same mathematics, dense, in `f64`, and as naive as can be.
//!
//! Written from the formulas, which each item states, and not from the core, and sharing no code with it: no band, no sparse
//! rows, no rearranged sums, no re-parametrised bias. What the core computes is compared with what this computes.
//!
//! ```
//! use bhm_oracle::{DenseMap, DensePosterior, Features, Kernel, Rule, Safeguard};
//!
//! let features = Features {
//!     origin_m: [0.0, 0.0],
//!     spacing_m: 0.5,
//!     width: [8, 8],
//!     stencil: 4,
//!     kernel: Kernel::CubicBSpline { spacing_m: 0.5 },
//!     bias: false,
//! };
//! let mut map = DenseMap::new(features, DensePosterior::prior(&[1e-4; 64]));
//! let rule = Rule::GaussianVariational { xi_cap: 4.0, safeguard: Safeguard::NONE };
//! map.learn(&[([1.6, 1.7], true)], &rule, 3).unwrap();
//! assert!(map.predict(&[1.6, 1.7]).unwrap().probability > 0.6);
//! ```

mod blend;
mod convolution;
mod features;
mod kernel;
mod logistic;
mod map;
mod matrix;
mod posterior;
pub mod prior;
mod quadrature;
mod recorded;

pub use blend::TileBlend;
pub use convolution::{Average, Bump, Extent};
pub use features::Features;
pub use kernel::Kernel;
pub use logistic::{expected_ln_sigmoid, lambda, ln_sigmoid, sigmoid};
pub use map::DenseMap;
pub use matrix::{Factor, Matrix, quadratic, times};
pub use posterior::{DensePosterior, Observation, Prediction, Rule, Safeguard, Trace, XiStart};
pub use quadrature::Square;
pub use recorded::recorded;
