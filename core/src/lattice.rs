//! Where supports sit, in which order they are counted, and which `M` and `B` follow.
//!
//! The lattice is unbounded: every support has an integer node. A [`Window`] is the box of nodes that one tile holds, in
//! lexicographic order, the last axis fastest: that order is what makes the information matrix banded.

use crate::{
    geometry::Point,
    posterior::{Pattern, PatternError},
};

/// Most nodes a stencil may have: 8² in the plane, 4³ in space.
pub const MAX_STENCIL_NODES: usize = 64;

/// Nodes further from the origin than this are refused: beyond it an `f32` no longer resolves a hundredth of a cell.
pub const MAX_NODE: i32 = 1 << 17;

/// A node of the lattice, counted in spacings from the origin along each axis.
pub type Node<const D: usize> = [i32; D];

/// Supports at `origin + spacing · node`, and the width of the stencil a point sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice<const D: usize> {
    /// Where node 0 sits, metres.
    pub origin_m: Point<D>,
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// Supports a side that a point sees, an even number.
    pub stencil: usize,
}

/// The stencil that one point sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stencil<const D: usize> {
    /// The node at the stencil's lowest corner.
    pub first: Node<D>,
    /// The point's displacement from that node, metres.
    pub from_first_m: Point<D>,
}

impl<const D: usize> Lattice<D> {
    /// The stencil of a point; `None` if the point is not finite or further than [`MAX_NODE`] nodes from the origin.
    #[inline]
    #[must_use]
    pub fn stencil_at(&self, point_m: &Point<D>) -> Option<Stencil<D>> {
        let cells = (point_m - self.origin_m) / self.spacing_m;
        if !cells.iter().all(|c| c.abs() < MAX_NODE as f32) {
            return None;
        }
        let below = self.stencil as i32 / 2 - 1;
        let mut first = [0; D];
        let mut from_first_m = Point::zeros();
        for axis in 0..D {
            let whole = floor(cells[axis]);
            first[axis] = whole - below;
            from_first_m[axis] = (cells[axis] - whole as f32 + below as f32) * self.spacing_m;
        }
        Some(Stencil { first, from_first_m })
    }

    /// Cuts a segment where it enters another cell, so that every point of a piece sees the same stencil.
    ///
    /// A piece may stick out of its cell by at most 1/128 of a spacing, where a kernel that ends with its stencil is below
    /// 1.2e-7, so that corners are not cut into slivers that would each count as an observation. A segment that the lattice
    /// cannot place stays whole. The pieces number at most `1 + Σ |Δᵢ|/h + D`.
    pub fn cut(&self, from_m: Point<D>, to_m: Point<D>) -> impl Iterator<Item = (Point<D>, Point<D>)> + use<D> {
        const SLIVER: f32 = 1.0 / 128.0;
        let placed = self.stencil_at(&from_m).is_some() && self.stencil_at(&to_m).is_some();
        let start = (from_m - self.origin_m) / self.spacing_m;
        let along = (to_m - from_m) / self.spacing_m;
        let sliver = SLIVER / along.iter().fold(0.0, |longest: f32, d| longest.max(d.abs()));
        // The next lattice line along each axis.
        let mut line = [0; D];
        for axis in 0..D {
            line[axis] = floor(start[axis]) + i32::from(along[axis] > 0.0);
        }
        let mut t = if placed { 0.0_f32 } else { -1.0 };
        core::iter::from_fn(move || {
            if t < 0.0 {
                t = 1.0;
                return Some((from_m, to_m));
            }
            if t >= 1.0 {
                return None;
            }
            let begin = t;
            // Lines met within a sliver of the piece's begin are the cell that it enters anyway.
            while t <= begin + sliver && t < 1.0 {
                let crossing = |axis: usize| (line[axis] as f32 - start[axis]) / along[axis];
                let mut next = 1.0;
                let mut of = None;
                for axis in (0..D).filter(|axis| along[*axis] != 0.0) {
                    if crossing(axis) < next {
                        (next, of) = (crossing(axis), Some(axis));
                    }
                }
                if let Some(axis) = of {
                    line[axis] += if along[axis] > 0.0 { 1 } else { -1 };
                }
                t = if next + sliver >= 1.0 { 1.0 } else { next.max(t) };
            }
            let at = |t: f32| if t >= 1.0 { to_m } else { from_m + (to_m - from_m) * t };
            Some((at(begin), at(t)))
        })
    }

    /// Number of nodes of a stencil, `Sᴰ`.
    #[must_use]
    pub const fn stencil_nodes(&self) -> usize {
        self.stencil.pow(D as u32)
    }

    /// Where a node sits, metres.
    #[must_use]
    pub fn position_m(&self, node: &Node<D>) -> Point<D> {
        Point::from_fn(|axis, _| self.origin_m[axis] + node[axis] as f32 * self.spacing_m)
    }
}

/// Greatest integer not above `x`, for |x| ≤ 2³⁰ (`f32::floor` needs `std`).
#[inline]
fn floor(x: f32) -> i32 {
    let truncated = x as i32;
    truncated - i32::from(x < truncated as f32)
}

/// The displacement of a point from the node at that offset from the stencil's first, metres.
#[inline(always)]
pub(crate) fn displaced<const D: usize>(from_first_m: &Point<D>, offset: [usize; D], spacing_m: f32) -> Point<D> {
    Point::from_fn(|axis, _| from_first_m[axis] - offset[axis] as f32 * spacing_m)
}

/// Offsets of a stencil's (or window's) nodes from its first, in lexicographic order, the last axis fastest.
#[inline]
pub fn offsets<const D: usize>(width: [usize; D]) -> impl Iterator<Item = [usize; D]> {
    let total: usize = width.iter().product();
    let mut next = [0_usize; D];
    (0..total).map(move |_| {
        let current = next;
        for axis in (0..D).rev() {
            next[axis] += 1;
            if next[axis] < width[axis] {
                break;
            }
            next[axis] = 0;
        }
        current
    })
}

/// A box of nodes and the order in which they are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window<const D: usize> {
    /// The node at the lowest corner.
    pub first: Node<D>,
    /// Nodes along each axis.
    pub width: [usize; D],
}

impl<const D: usize> Window<D> {
    /// Number of supports, the `M` of the posterior over this window; `usize::MAX` if there are more than can be counted.
    #[must_use]
    pub fn supports(&self) -> usize {
        self.width.iter().fold(1, |supports: usize, width| supports.saturating_mul(*width))
    }

    /// The band `B` that holds every pair of one stencil: half-bandwidth `(S − 1)·(1 + W + …)`, and the diagonal.
    #[must_use]
    pub fn band(&self, stencil: usize) -> usize {
        (stencil - 1) * self.strides().iter().sum::<usize>() + 1
    }

    /// How far apart in the order two neighbours along each axis are.
    #[inline]
    #[must_use]
    pub fn strides(&self) -> [usize; D] {
        let mut strides = [1; D];
        for axis in (0..D.saturating_sub(1)).rev() {
            strides[axis] = strides[axis + 1] * self.width[axis + 1];
        }
        strides
    }

    /// Where the supports of a stencil stand in the order, counted from its first: a run for each line along the last axis.
    ///
    /// # Errors
    /// [`PatternError`] if the stencil has no nodes or more lines than a pattern holds.
    pub fn pattern(&self, stencil: usize) -> Result<Pattern, PatternError> {
        let strides = self.strides();
        let mut lines = [stencil; D];
        if let Some(last) = lines.last_mut() {
            *last = 1;
        }
        let start = |offset: [usize; D]| offset.iter().zip(strides).map(|(o, stride)| o * stride).sum();
        Pattern::new(stencil, offsets(lines).map(start))
    }

    /// The index of a stencil's first node if the whole stencil lies in the window.
    #[inline]
    #[must_use]
    pub fn index_of_whole(&self, first: &Node<D>, stencil: usize) -> Option<usize> {
        let strides = self.strides();
        let mut index = 0;
        for axis in 0..D {
            let at = first[axis] - self.first[axis];
            if at < 0 || at as usize + stencil > self.width[axis] {
                return None;
            }
            index += at as usize * strides[axis];
        }
        Some(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Every pair of one stencil, placed anywhere in the window, must lie in the band, and one pair must reach its edge.
    fn band_is_exact<const D: usize>(width: [usize; D], stencil: usize) {
        let window = Window { first: [0; D], width };
        let strides = window.strides();
        let mut widest = 0;
        for corner in offsets(width.map(|w| w - stencil + 1)) {
            let at: Vec<usize> = offsets([stencil; D])
                .map(|o| (0..D).map(|axis| (corner[axis] + o[axis]) * strides[axis]).sum())
                .collect();
            let first = corner.map(|c| c as i32);
            assert_eq!(window.index_of_whole(&first, stencil), at.first().copied());
            widest = widest.max(at.iter().max().unwrap() - at.iter().min().unwrap());
        }
        assert_eq!(widest + 1, window.band(stencil));
    }

    #[test]
    fn the_band_holds_every_stencil_and_no_more() {
        band_is_exact([12, 12], 4);
        band_is_exact([5, 9], 4);
        band_is_exact([14, 14], 6);
        band_is_exact([6, 5, 7], 4);
    }

    #[test]
    fn a_stencil_surrounds_its_point() {
        let lattice = Lattice::<2> { origin_m: [0.3, -0.1].into(), spacing_m: 0.25, stencil: 4 };
        for i in -500..500 {
            let point = Point::<2>::new(i as f32 * 0.0371, i as f32 * -0.0219);
            let stencil = lattice.stencil_at(&point).unwrap();
            for axis in 0..2 {
                let cells = stencil.from_first_m[axis] / 0.25;
                assert!((1.0..=2.0).contains(&cells), "between the second and third node, not {cells}");
            }
            let back = lattice.position_m(&stencil.first) + stencil.from_first_m;
            assert!((back - point).iter().all(|d| d.abs() < 1e-5));
        }
    }

    #[test]
    fn a_cut_segment_is_whole_and_each_piece_keeps_to_its_cell() {
        let lattice = Lattice::<2> { origin_m: [0.3, -0.1].into(), spacing_m: 0.25, stencil: 4 };
        let mut state = 12_345_u32;
        let mut random = |range: f32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 8) as f32 / (1 << 24) as f32 - 0.5) * range
        };
        for case in 0..20_000 {
            let from = Point::<2>::new(random(20.0), random(20.0));
            let reach = [0.01, 0.3, 5.0][case % 3];
            // Every tenth along an axis, every eleventh from a node.
            let mut to = from + Point::<2>::new(random(reach), random(reach));
            if case % 10 == 0 {
                to.x = from.x;
            }
            let from = if case % 11 == 0 { lattice.position_m(&[case as i32 % 40, 7]) } else { from };
            let pieces: Vec<_> = lattice.cut(from, to).collect();
            assert_eq!(pieces.first().unwrap().0, from);
            assert_eq!(pieces.last().unwrap().1, to);
            assert!(pieces.windows(2).all(|pair| pair[0].1 == pair[1].0));
            for (a, b) in &pieces {
                let cell = lattice.stencil_at(&((a + b) * 0.5)).unwrap().first;
                for end in [a, b] {
                    let cells = (end - lattice.origin_m) / lattice.spacing_m;
                    for axis in 0..2 {
                        let into = cells[axis] - (cell[axis] + 1) as f32;
                        assert!((-0.0079..=1.0079).contains(&into), "{into} of {from:?} to {to:?}: {pieces:?}");
                    }
                }
            }
            let lines = (to - from).abs().sum() / 0.25;
            assert!(pieces.len() <= lines as usize + 3, "{} pieces of {from:?} to {to:?}", pieces.len());
        }
    }

    #[test]
    fn a_segment_without_length_or_place_stays_whole() {
        let lattice = Lattice::<2> { origin_m: Point::zeros(), spacing_m: 0.25, stencil: 4 };
        let here = Point::<2>::new(1.0, 2.0);
        assert_eq!(lattice.cut(here, here).collect::<Vec<_>>(), [(here, here)]);
        for far in [1e30, f32::NAN] {
            assert_eq!(lattice.cut(here, Point::<2>::new(far, 0.0)).count(), 1);
        }
    }

    #[test]
    fn what_cannot_be_placed_is_refused() {
        let lattice = Lattice::<2> { origin_m: Point::zeros(), spacing_m: 0.25, stencil: 4 };
        for bad in [f32::NAN, f32::INFINITY, 1e30, MAX_NODE as f32 * 0.25] {
            assert!(lattice.stencil_at(&[bad, 0.0].into()).is_none());
        }
    }
}
