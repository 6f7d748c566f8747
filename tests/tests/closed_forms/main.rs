//! Every closed form and every quadrature of kernel × support × observation against quadrature in `f64`.
//!
//! The oracle shares no formula with the core: the convolution with a Gaussian is a sum over its places, an average over a
//! box or a segment a composite Gauss–Legendre sum. It sees the inputs as rounded to `f32`. Worst errors are printed.
#![allow(unreachable_pub, reason = "there is nobody outside a test program")]

mod composition;
mod cubic_b_spline;
mod draw;
mod gradients;
mod limits;
mod oracle;
mod squared_exponential;
#[path = "../../../core/tests/common/stream.rs"]
mod stream;
mod tally;
