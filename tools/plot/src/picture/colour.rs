//! The colours of values and of everything else.

use embedded_graphics::{pixelcolor::Rgb888, prelude::*};

/// The colour of a value that is NaN: magenta, which no colour map contains.
pub const NOT_A_NUMBER: Rgb888 = Rgb888::new(255, 0, 255);

/// The colour of the robot's path: told apart from all colours of the maps, by the colour-blind too.
pub const PATH: Rgb888 = Rgb888::new(224, 72, 0);

pub(crate) const BACKGROUND: Rgb888 = Rgb888::WHITE;
pub(crate) const INK: Rgb888 = Rgb888::new(40, 44, 52);

/// Colours from the least to the greatest value: equally spaced anchors, straight lines in sRGB between them.
#[derive(Debug, PartialEq)]
pub struct ColourMap {
    anchors: &'static [[u8; 3]],
}

impl ColourMap {
    /// From white (free) to black (occupied), as the field draws maps, but with a lightness that falls evenly and with
    /// a blue tint in the middle, by which the unknown is neither a light wall nor a dark floor.
    pub const OCCUPANCY: Self =
        Self::new(&[[255, 255, 255], [205, 219, 233], [144, 168, 194], [72, 87, 112], [12, 14, 20]]);

    /// Viridis, of equal perceptual steps (van der Walt and Smith, 2015, public domain): every 17th of its 256 colours.
    pub const VIRIDIS: Self = Self::new(&[
        [68, 1, 84],
        [72, 26, 108],
        [71, 47, 125],
        [65, 68, 135],
        [57, 86, 140],
        [49, 104, 142],
        [42, 120, 142],
        [35, 136, 142],
        [31, 152, 139],
        [34, 168, 132],
        [53, 183, 121],
        [84, 197, 104],
        [122, 209, 81],
        [165, 219, 54],
        [210, 226, 27],
        [253, 231, 37],
    ]);

    /// A map through these anchors, in sRGB.
    ///
    /// # Panics
    /// If there are fewer than two; in a constant that is a compile-time error.
    #[must_use]
    pub const fn new(anchors: &'static [[u8; 3]]) -> Self {
        assert!(anchors.len() >= 2, "a colour map runs between at least two colours");
        Self { anchors }
    }

    /// The colour at `position` 0 (first anchor) to 1 (last); beyond, that of the nearer end; [`NOT_A_NUMBER`] for NaN.
    #[must_use]
    pub fn at(&self, position: f32) -> Rgb888 {
        if position.is_nan() {
            return NOT_A_NUMBER;
        }
        let last = self.anchors.len() - 1;
        let place = position.clamp(0.0, 1.0) * last as f32;
        let below = (place as usize).min(last - 1);
        let [from, to] = [below, below + 1].map(|i| {
            let [r, g, b] = self.anchors[i];
            Rgb888::new(r, g, b)
        });
        mix(from, to, place - below as f32)
    }
}

/// `from` at `share` 0, `to` at 1.
pub(crate) fn mix(from: Rgb888, to: Rgb888, share: f32) -> Rgb888 {
    let channel = |from: u8, to: u8| (f32::from(from) + share * (f32::from(to) - f32::from(from))).round() as u8;
    Rgb888::new(channel(from.r(), to.r()), channel(from.g(), to.g()), channel(from.b(), to.b()))
}
