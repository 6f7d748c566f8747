//! Shapes over the field: supports as ellipses and rectangles, beams as segments, places as crosses.
//!
//! Outlines are one pixel wide and all shapes of an overlay are painted at once: thousands of them overlap without
//! their soft edges adding up, and between them the field stays visible.

use embedded_graphics::{pixelcolor::Rgb888, primitives::Rectangle};

use super::{canvas::Canvas, frame::Frame, path::Mask};

/// A little more than half a pixel: a line between two pixels' centres must not fade.
const LINE_RADIUS_PX: f64 = 0.6;

/// How far the arms of a cross reach along each axis.
const CROSS_PX: f64 = 4.0;

/// How far a polygon may run inside the ellipse it stands for.
const ELLIPSE_ERROR_PX: f64 = 0.1;

/// Corners per quarter of an ellipse: enough to be round where it is small, bounded where it is huge.
const QUARTER_CORNERS: (f64, f64) = (4.0, 1024.0);

/// Shapes of one kind of thing, in one colour, explained below the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlay<'a> {
    /// What the shapes are: a line in the footer; cut off with `...` where it is longer than 40 characters.
    pub legend: &'a str,
    /// The colour of the outlines. [`ColourMap::OCCUPANCY`](super::ColourMap::OCCUPANCY) contains no red, green or violet.
    pub colour: Rgb888,
    /// The shapes; none draws none, and no legend. What lies outside the bounds is not drawn.
    pub shapes: &'a [Shape],
}

/// A shape in the map's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Where a normal distribution's Mahalanobis distance is `sigmas`.
    Ellipse {
        /// The mean, metres.
        centre_m: [f32; 2],
        /// The covariance's entries xx, xy, yy, square metres; positive semidefinite.
        covariance_m2: [f32; 3],
        /// How many standard deviations from the mean.
        sigmas: f32,
    },
    /// An upright rectangle.
    Rectangle {
        /// Its middle, metres.
        centre_m: [f32; 2],
        /// Its width and height, metres.
        sides_m: [f32; 2],
    },
    /// A place, as a small cross of fixed size.
    Point {
        /// Where, metres.
        at_m: [f32; 2],
    },
    /// A straight line.
    Segment {
        /// One end, metres.
        from_m: [f32; 2],
        /// The other end, metres.
        to_m: [f32; 2],
    },
}

impl Shape {
    /// Whether its numbers are finite and describe the shape.
    pub(super) fn is_drawable(&self) -> bool {
        let are_finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        let are_lengths = |values: &[f32]| values.iter().all(|&value| value.is_finite() && value >= 0.0);
        match self {
            Self::Ellipse { centre_m, covariance_m2, sigmas } => {
                are_finite(centre_m) && are_lengths(&[*sigmas]) && factor(*covariance_m2).is_some()
            }
            Self::Rectangle { centre_m, sides_m } => are_finite(centre_m) && are_lengths(sides_m),
            Self::Point { at_m } => are_finite(at_m),
            Self::Segment { from_m, to_m } => are_finite(from_m) && are_finite(to_m),
        }
    }

    /// Its outline on the canvas, as lines through points in continuous pixel coordinates.
    fn outlines(&self, frame: &Frame) -> Vec<Vec<[f64; 2]>> {
        match *self {
            Self::Ellipse { centre_m, covariance_m2, sigmas } => {
                let Some(factor) = factor(covariance_m2) else { return Vec::new() };
                vec![ellipse(frame, centre_m, factor, f64::from(sigmas))]
            }
            Self::Rectangle { centre_m, sides_m } => {
                let corner = |right: f64, up: f64| {
                    let along =
                        |axis: usize, side: f64| f64::from(centre_m[axis]) + side * f64::from(sides_m[axis]) / 2.0;
                    [frame.column_of(along(0, right)), frame.row_of(along(1, up))]
                };
                let first = corner(-1.0, -1.0);
                vec![vec![first, corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), first]]
            }
            Self::Point { at_m } => cross(frame.pixel_of(at_m)),
            Self::Segment { from_m, to_m } => vec![vec![frame.pixel_of(from_m), frame.pixel_of(to_m)]],
        }
    }

    /// Its picture in the legend, around a middle in continuous pixel coordinates.
    fn key(&self, [x, y]: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
        let [a, b] = [KEY_WIDTH_PX / 2.0 - 1.0, 6.0];
        match self {
            Self::Ellipse { .. } => vec![unit_circle(16).map(|[right, up]| [x + a * right, y - b * up]).collect()],
            Self::Rectangle { .. } => {
                vec![vec![[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b], [x - a, y - b]]]
            }
            Self::Point { .. } => cross([x, y]),
            Self::Segment { .. } => vec![vec![[x - a, y + b], [x + a, y - b]]],
        }
    }
}

/// The width of a shape's picture in the legend.
pub(super) const KEY_WIDTH_PX: f64 = 28.0;

impl Overlay<'_> {
    /// The first shape of each kind there is.
    pub(super) fn kinds(&self) -> Vec<&Shape> {
        let mut kinds: Vec<&Shape> = Vec::new();
        for shape in self.shapes {
            if !kinds.iter().any(|kind| std::mem::discriminant(*kind) == std::mem::discriminant(shape)) {
                kinds.push(shape);
            }
        }
        kinds
    }

    /// Draws the shapes where they are, within the map.
    pub(super) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let outlines = self.shapes.iter().flat_map(|shape| shape.outlines(frame));
        self.paint(canvas, &frame.area(), outlines);
    }

    /// Draws one picture of each kind of shape, side by side, within `area`.
    pub(super) fn draw_key(&self, canvas: &mut Canvas, area: &Rectangle) {
        let middle = f64::from(area.top_left.y) + f64::from(area.size.height) / 2.0;
        let kinds = self.kinds().into_iter().enumerate();
        let outlines = kinds
            .flat_map(|(i, kind)| kind.key([f64::from(area.top_left.x) + (i as f64 + 0.5) * KEY_WIDTH_PX, middle]));
        self.paint(canvas, area, outlines);
    }

    fn paint(&self, canvas: &mut Canvas, area: &Rectangle, outlines: impl Iterator<Item = Vec<[f64; 2]>>) {
        let mut mask = Mask::new(area);
        for outline in outlines {
            mask.add_line(&outline, LINE_RADIUS_PX);
        }
        mask.paint(canvas, area, self.colour);
    }
}

/// The lower Cholesky factor `[l₁₁, l₂₁, l₂₂]` of a covariance, `None` if that is not finite or not positive
/// semidefinite. A correlation of ±1, and beyond by what `f32` rounds, is a line.
fn factor(covariance: [f32; 3]) -> Option<[f64; 3]> {
    let [xx, xy, yy] = covariance.map(f64::from);
    let slack = 4.0 * f64::from(f32::EPSILON);
    if !(covariance.iter().all(|entry| entry.is_finite()) && xx >= 0.0 && yy >= 0.0) {
        return None;
    }
    if xy * xy > xx * yy * (1.0 + slack) {
        return None;
    }
    let l11 = xx.sqrt();
    let l21 = if l11 > 0.0 { xy / l11 } else { 0.0 };
    Some([l11, l21, (yy - l21 * l21).max(0.0).sqrt()])
}

/// The closed polygon of `centre + sigmas · L u` with `u` on the unit circle.
fn ellipse(frame: &Frame, centre_m: [f32; 2], [l11, l21, l22]: [f64; 3], sigmas: f64) -> Vec<[f64; 2]> {
    let [x, y] = centre_m.map(f64::from);
    let at = |[u, v]: [f64; 2]| [frame.column_of(x + sigmas * l11 * u), frame.row_of(y + sigmas * (l21 * u + l22 * v))];
    // No radius is greater than half the diagonal of the box around the ellipse, sigmas · (√xx, √yy).
    let [left, right] = [-1.0, 1.0].map(|side| frame.column_of(x + side * sigmas * l11));
    let [low, high] = [-1.0, 1.0].map(|side| frame.row_of(y + side * sigmas * l21.hypot(l22)));
    let radius_px = (right - left).hypot(high - low) / 2.0;
    // An arc of angle a runs r a²/8 away from its chord; the widest of a quarter's n arcs is 2/n (see `unit_circle`).
    let corners = (radius_px / (2.0 * ELLIPSE_ERROR_PX)).sqrt().ceil();
    unit_circle(corners.clamp(QUARTER_CORNERS.0, QUARTER_CORNERS.1) as u32).map(at).collect()
}

/// Around the unit circle and back to the start, in `4 · quarter` steps, by `((1 − t²), 2t) / (1 + t²)`: unlike sine
/// and cosine, the same bits on every machine.
fn unit_circle(quarter: u32) -> impl Iterator<Item = [f64; 2]> {
    let arc = move |i: u32| {
        let t = f64::from(i) / f64::from(quarter);
        [(1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)]
    };
    let around = (0..4 * quarter).map(move |i| {
        let [u, v] = arc(i % quarter);
        [[u, v], [-v, u], [-u, -v], [v, -u]][(i / quarter) as usize]
    });
    around.chain([[1.0, 0.0]])
}

fn cross([x, y]: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    let arm = |down: f64| vec![[x - CROSS_PX, y - down], [x + CROSS_PX, y + down]];
    vec![arm(CROSS_PX), arm(-CROSS_PX)]
}
