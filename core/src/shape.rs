//! The shapes of tiles that programs are compiled for, and how one that is known at run time becomes const generics.

use core::fmt;

/// What is done with tiles of `M` supports in a band of `B`, whichever shape that is.
pub trait ShapeVisitor {
    /// What comes of it.
    type Output;

    /// Does it for the shape.
    fn visit<const M: usize, const B: usize>(self) -> Self::Output;
}

macro_rules! shapes {
    ($(($m:literal, $b:literal)),* $(,)?) => {
        /// Supports and band of every tile that programs are compiled for.
        pub const SHAPES: [(usize, usize); [$($m),*].len()] = [$(($m, $b)),*];

        /// Has the visitor do its work for tiles of that many supports in a band that wide.
        ///
        /// # Errors
        /// [`NotCompiled`] if that is none of [`SHAPES`].
        pub fn visit<V: ShapeVisitor>((supports, band): (usize, usize), visitor: V) -> Result<V::Output, NotCompiled> {
            match (supports, band) {
                $(($m, $b) => Ok(visitor.visit::<$m, $b>()),)*
                _ => Err(NotCompiled { supports, band }),
            }
        }
    };
}

// Those of the profiles, and of wider kernels on their lattices.
shapes! { (144, 40), (196, 76), (256, 120), (5751, 361) }

/// No program is compiled for tiles of this shape.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotCompiled {
    /// Supports of a tile.
    pub supports: usize,
    /// Width of its band.
    pub band: usize,
}

impl fmt::Display for NotCompiled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { supports, band } = self;
        write!(f, "tiles of {supports} supports in a band of {band} are not compiled in; compiled are {SHAPES:?}")
    }
}

impl core::error::Error for NotCompiled {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_visited_as_itself_and_no_other() {
        struct Name;
        impl ShapeVisitor for Name {
            type Output = (usize, usize);
            fn visit<const M: usize, const B: usize>(self) -> (usize, usize) {
                (M, B)
            }
        }
        for shape in SHAPES {
            assert_eq!(visit(shape, Name), Ok(shape));
        }
        assert_eq!(visit((144, 41), Name), Err(NotCompiled { supports: 144, band: 41 }));
    }
}
