//! The robot's path: smooth lines and markers, readable on any colour.

use embedded_graphics::{pixelcolor::Rgb888, prelude::*, primitives::Rectangle};

use super::{
    canvas::Canvas,
    colour::{BACKGROUND, PATH},
};

/// How far the start marker reaches; the end marker fits into it, so that both show where a path closes.
pub(super) const MARKER_RADIUS_PX: f64 = 8.0;

const LINE_RADIUS_PX: f64 = 1.0;

/// The light edge of lines and markers.
const EDGE_PX: f64 = 1.0;

/// Draws a path through `points`, in continuous pixel coordinates, with its start and end, within `area`.
pub(super) fn draw(canvas: &mut Canvas, area: &Rectangle, points: &[[f64; 2]]) {
    let (Some(&start), Some(&end)) = (points.first(), points.last()) else { return };
    let mut layer = |points: &[[f64; 2]], radius_px, colour| stroke(canvas, area, points, radius_px, colour);
    // A line with light edges, a ring, a disc.
    layer(points, LINE_RADIUS_PX + EDGE_PX, BACKGROUND);
    layer(points, LINE_RADIUS_PX, PATH);
    layer(&[start], MARKER_RADIUS_PX + EDGE_PX, BACKGROUND);
    layer(&[start], MARKER_RADIUS_PX, PATH);
    layer(&[start], MARKER_RADIUS_PX - 2.0, BACKGROUND);
    layer(&[end], MARKER_RADIUS_PX - 2.0, BACKGROUND);
    layer(&[end], MARKER_RADIUS_PX - 3.5, PATH);
}

/// Everything within `radius_px` of the points and of the straight lines between them. Coverage is gathered before it
/// is painted: where short segments overlap, their soft edges must not add up.
pub(crate) fn stroke(canvas: &mut Canvas, area: &Rectangle, points: &[[f64; 2]], radius_px: f64, colour: Rgb888) {
    let mut mask = Mask::new(area);
    mask.add_line(points, radius_px);
    mask.paint(canvas, area, colour);
}

/// How much of each pixel of an area is covered, 0 to 255.
pub(crate) struct Mask {
    left: f64,
    top: f64,
    columns: usize,
    rows: usize,
    coverage: Vec<u8>,
}

impl Mask {
    pub(crate) fn new(area: &Rectangle) -> Self {
        let [columns, rows] = [area.size.width as usize, area.size.height as usize];
        let [left, top] = [f64::from(area.top_left.x), f64::from(area.top_left.y)];
        Self { left, top, columns, rows, coverage: vec![0; columns * rows] }
    }

    /// Covers what is within `radius` of the points and of the straight lines between them.
    pub(crate) fn add_line(&mut self, points: &[[f64; 2]], radius: f64) {
        if let &[only] = points {
            self.add(only, only, radius);
        }
        for pair in points.windows(2) {
            self.add(pair[0], pair[1], radius);
        }
    }

    /// Lays a colour over what is covered; `area` is the one it was made for.
    pub(crate) fn paint(&self, canvas: &mut Canvas, area: &Rectangle, colour: Rgb888) {
        for (at, &coverage) in area.points().zip(&self.coverage) {
            if coverage > 0 {
                canvas.blend(at, colour, f32::from(coverage) / f32::from(u8::MAX));
            }
        }
    }

    /// Covers what is within `radius` of the segment. Only pixels near it are visited, in the area's coordinates.
    fn add(&mut self, from: [f64; 2], to: [f64; 2], radius: f64) {
        let [from, to] = [from, to].map(|[x, y]| [x - self.left, y - self.top]);
        // Half a pixel of soft edge, half a pixel from a centre to the pixel's border.
        let reach = radius + 1.0;
        // Of shapes larger than the area most segments pass it by.
        if from[0].max(to[0]) + reach < 0.0 || from[0].min(to[0]) - reach > self.columns as f64 {
            return;
        }
        for row in pixels(from[1].min(to[1]) - reach, from[1].max(to[1]) + reach, self.rows) {
            let y = row as f64 + 0.5;
            let ends = [y - reach, y + reach].map(|y| column_at(from, to, y));
            let (first, last) = (ends[0].min(ends[1]) - reach, ends[0].max(ends[1]) + reach);
            for column in pixels(first, last, self.columns) {
                let distance = distance_to_segment([column as f64 + 0.5, y], from, to);
                let coverage = ((radius + 0.5 - distance).clamp(0.0, 1.0) * f64::from(u8::MAX)).round() as u8;
                let covered = &mut self.coverage[row * self.columns + column];
                *covered = coverage.max(*covered);
            }
        }
    }
}

/// The pixels of an axis that an interval touches. (Casts saturate: an interval may lie far outside.)
fn pixels(min: f64, max: f64, count: usize) -> std::ops::Range<usize> {
    (min.floor() as usize).min(count)..(max.ceil() as usize).min(count)
}

/// The x of the segment's point nearest in height to `y`.
fn column_at(from: [f64; 2], to: [f64; 2], y: f64) -> f64 {
    let share = (y - from[1]) / (to[1] - from[1]);
    // A level segment has no such point but all of them: y − reach and y + reach then give its two ends.
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    from[0] + share * (to[0] - from[0])
}

fn distance_to_segment(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let ahead = [point[0] - from[0], point[1] - from[1]];
    let length_squared = along[0] * along[0] + along[1] * along[1];
    let share = if length_squared > 0.0 {
        ((ahead[0] * along[0] + ahead[1] * along[1]) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let [dx, dy] = [ahead[0] - share * along[0], ahead[1] - share * along[1]];
    (dx * dx + dy * dy).sqrt()
}
