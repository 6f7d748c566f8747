//! Memory that is allocated zeroed, in place: nothing large crosses the stack, and pages that are never touched are never
//! committed.

use bhm_core::{
    posterior::{Posterior, Scratch},
    tile::Tile,
};

/// A value that is plain numbers: all-zero bytes are valid.
///
/// # Safety
/// The type must be made of integers, floating-point numbers and arrays of them only.
pub(crate) unsafe trait PlainNumbers {}

// SAFETY: a tile is integers, floats and arrays of floats; its own documentation says that zero is a vacant tile.
unsafe impl<const D: usize, const M: usize, const B: usize> PlainNumbers for Tile<D, M, B> {}
// SAFETY: a posterior is floats and arrays of floats.
unsafe impl<const M: usize, const B: usize> PlainNumbers for Posterior<M, B> {}
// SAFETY: scratch is floats and arrays of floats.
unsafe impl<const M: usize, const B: usize> PlainNumbers for Scratch<M, B> {}

/// A value allocated zeroed, in place: nothing large crosses the stack.
#[must_use]
#[expect(private_bounds, reason = "the trait is this module's own list of types that may be zeroed")]
pub fn zeroed_box<T: PlainNumbers>() -> Box<T> {
    // SAFETY: the bytes are zero, which `PlainNumbers` says is a value of T.
    unsafe { Box::<T>::new_zeroed().assume_init() }
}

pub(super) fn zeroed_slice<T: PlainNumbers>(len: usize) -> Box<[T]> {
    // SAFETY: the bytes are zero, which `PlainNumbers` says is a value of T.
    unsafe { Box::<[T]>::new_zeroed_slice(len).assume_init() }
}
