//! How series are told apart.

use embedded_graphics::{pixelcolor::Rgb888, primitives::Rectangle};

use crate::picture::{
    Canvas,
    colour::BACKGROUND,
    path::{Mask, stroke},
};

pub(super) const COUNT: usize = 8;

/// How far a marker reaches, without its light edge.
pub(super) const MARKER_PX: f64 = 5.0;

const LINE_RADIUS_PX: f64 = 1.0;

/// The colours of Okabe and Ito (2008), told apart by the colour-blind too, those first that are darkest and most unlike;
/// grey in the place of yellow, which is hardly seen on white.
const COLOURS: [Rgb888; COUNT] = [
    Rgb888::new(0, 114, 178),
    Rgb888::new(213, 94, 0),
    Rgb888::new(0, 158, 115),
    Rgb888::new(0, 0, 0),
    Rgb888::new(204, 121, 167),
    Rgb888::new(230, 159, 0),
    Rgb888::new(86, 180, 233),
    Rgb888::new(120, 120, 120),
];

/// In the order of [`COLOURS`].
const MARKERS: [Marker; COUNT] = [
    Marker { corners: &[[0.0, 0.0]], radius_px: MARKER_PX, is_filled: true },
    Marker { corners: &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]], radius_px: 0.65, is_filled: true },
    Marker { corners: &[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]], radius_px: 0.65, is_filled: true },
    Marker {
        corners: &[[0.0, -1.0], [0.0, 1.0], [0.0, 0.0], [-1.0, 0.0], [1.0, 0.0]],
        radius_px: 1.2,
        is_filled: false,
    },
    Marker { corners: &[[0.0, -1.25], [1.25, 0.0], [0.0, 1.25], [-1.25, 0.0]], radius_px: 0.65, is_filled: true },
    Marker {
        corners: &[[-0.9, -0.9], [0.9, 0.9], [0.0, 0.0], [-0.9, 0.9], [0.9, -0.9]],
        radius_px: 1.2,
        is_filled: false,
    },
    Marker { corners: &[[0.0, 1.2], [1.1, -0.8], [-1.1, -0.8]], radius_px: 0.65, is_filled: true },
    Marker {
        corners: &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9], [-0.9, -0.9]],
        radius_px: 0.9,
        is_filled: false,
    },
];

/// A line through corners, in units of [`MARKER_PX`], or what they enclose.
struct Marker {
    corners: &'static [[f64; 2]],
    radius_px: f64,
    is_filled: bool,
}

impl Marker {
    fn lines_px(&self, [x, y]: [f64; 2]) -> Vec<[f64; 2]> {
        let at = |[right, down]: [f64; 2], share: f64| [x + share * MARKER_PX * right, y + share * MARKER_PX * down];
        if self.is_filled && self.corners.len() > 1 {
            // Outlines from outside to inside, so near to each other that a thin line leaves nothing blank.
            let rings = (0_u8..=20).rev().map(|i| f64::from(i) / 20.0);
            let closed = || self.corners.iter().chain(self.corners.first());
            rings.flat_map(|share| closed().map(move |&corner| at(corner, share))).collect()
        } else {
            self.corners.iter().map(|&corner| at(corner, 1.0)).collect()
        }
    }
}

/// The looks of a series.
#[derive(Clone, Copy)]
pub(super) struct Style {
    pub(super) colour: Rgb888,
    marker: usize,
}

impl Style {
    /// Of the series at a position in the legend.
    pub(super) fn of(position: Option<usize>) -> Self {
        let marker = position.unwrap_or(0) % COUNT;
        Self { colour: COLOURS[marker], marker }
    }

    /// A line and its markers, in continuous pixel coordinates, within `area`.
    pub(super) fn draw(self, canvas: &mut Canvas, area: &Rectangle, points: &[[f64; 2]], marked: &[[f64; 2]]) {
        stroke(canvas, area, points, LINE_RADIUS_PX, self.colour);
        // The light edge tells markers of different series apart where they overlap.
        for (edge_px, colour) in [(1.5, BACKGROUND), (0.0, self.colour)] {
            let mut markers = Mask::new(area);
            let marker = &MARKERS[self.marker];
            for &at in marked {
                markers.add_line(&marker.lines_px(at), marker.radius_px + edge_px);
            }
            markers.paint(canvas, area, colour);
        }
    }
}

/// An error bar from `low` to `high` rows; with caps where there is room for them.
pub(super) fn add_bar(mask: &mut Mask, column: f64, [low, high]: [f64; 2], has_caps: bool) {
    const RADIUS_PX: f64 = 0.5;
    const CAP_PX: f64 = 4.0;
    mask.add_line(&[[column, low], [column, high]], RADIUS_PX);
    for row in [low, high].into_iter().filter(|_| has_caps) {
        mask.add_line(&[[column - CAP_PX, row], [column + CAP_PX, row]], RADIUS_PX);
    }
}
