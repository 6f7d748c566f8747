//! PNG pictures of a function of the plane: the field itself, axes and a scale bar in metres, a colour bar, the
//! path the robot took, and shapes over it.
//!
//! Nothing here knows a map: a picture asks a closure for the value at each pixel's centre. y points up, as on paper.
//! The same values, title, shapes and path give the same bytes: no clock, no fonts of the machine, one PNG encoder.
//!
//! ```
//! use bhm_plot::picture::{Bounds, Field, FieldPicture};
//!
//! let picture = FieldPicture {
//!     bounds_m: Bounds { min: [-5.0, -5.0], max: [5.0, 5.0] },
//!     pixels_per_metre: None,
//!     title: "A round pillar",
//!     field: Field::PROBABILITY,
//!     overlays: &[],
//!     path_m: &[[-4.0, -4.0], [4.0, -4.0]],
//! };
//! let canvas = picture.render(|x, y| if x.hypot(y) < 1.0 { 0.9 } else { 0.1 })?;
//! let mut png = Vec::new();
//! canvas.encode_png(&mut png)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub(crate) mod axes;
pub(crate) mod canvas;
pub(crate) mod colour;
mod footer;
mod frame;
mod overlay;
#[cfg(test)]
mod overlay_tests;
pub(crate) mod path;
pub(crate) mod step;
#[cfg(test)]
mod tests;
pub(crate) mod text;

use bhm_core::geometry::Point as Position;
use embedded_graphics::{prelude::*, text::Alignment};

use self::axes::Axes;
pub use self::canvas::Canvas;
pub use self::colour::{ColourMap, NOT_A_NUMBER, PATH};
use self::footer::{ColourBar, Footer, NoValue, OverlayKey, PathKey, ScaleBar};
pub use self::frame::Bounds;
use self::frame::Frame;
pub use self::overlay::{Overlay, Shape};
pub use embedded_graphics::pixelcolor::Rgb888;

/// The longest side of a map drawn without a given scale.
pub const AUTOMATIC_SIDE_PX: u32 = 1200;

/// The shortest and the longest side, in pixels, that a map may have.
pub const SIDE_LIMITS_PX: (u32, u32) = (16, 8192);

/// The blank border around everything.
const MARGIN_PX: u32 = 20;
/// The title, with the gap below.
const TITLE_PX: u32 = 26;

/// The blank space between the x axis and the footer.
const FOOTER_GAP_PX: u32 = 14;

/// What a value means and how it is coloured. A new kind of field is one more constant or constructor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// What the values are, with their unit if they have one: the heading of the colour bar.
    pub caption: &'static str,
    /// The colours of the values.
    pub colours: &'static ColourMap,
    /// The values drawn in the first and in the last colour; values beyond them are drawn like them.
    pub range: [f32; 2],
}

impl Field {
    /// The probability of occupancy, in `[0, 1]`.
    pub const PROBABILITY: Self = Self { caption: "p(occupied)", colours: &ColourMap::OCCUPANCY, range: [0.0, 1.0] };

    /// The standard deviation of the log-odds, from 0 to `max`; natural for `max` is the prior's.
    #[must_use]
    pub const fn standard_deviation(max: f32) -> Self {
        Self { caption: "standard deviation of the log-odds", colours: &ColourMap::VIRIDIS, range: [0.0, max] }
    }

    /// The colour of a value; NaN is [`NOT_A_NUMBER`].
    #[must_use]
    pub fn colour(&self, value: f32) -> Rgb888 {
        let [low, high] = self.range;
        self.colours.at((value - low) / (high - low))
    }
}

/// A picture to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldPicture<'a> {
    /// The part of the plane to draw.
    pub bounds_m: Bounds,
    /// The scale; `None` makes the longest side [`AUTOMATIC_SIDE_PX`].
    pub pixels_per_metre: Option<f32>,
    /// The heading. Characters beyond Latin-1 are drawn as `?`; what does not fit in one line is cut off with `...`.
    pub title: &'a str,
    /// What the values mean.
    pub field: Field,
    /// Shapes over the field, below the path, the later above the earlier; empty draws none.
    pub overlays: &'a [Overlay<'a>],
    /// Where the robot was, in order; empty draws none. What lies outside the bounds is not drawn.
    pub path_m: &'a [[f32; 2]],
}

/// Why a picture cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// The bounds are not finite, too far away for `f32` to resolve a metre, or there is nothing between them.
    #[error("cannot draw from {:?} to {:?} m: each side must be 1 mm to 10 000 km, within 10 000 km of the origin", .0.min, .0.max)]
    Bounds(Bounds),
    /// The scale is zero, negative or not finite.
    #[error("{0} pixels per metre is not a usable scale")]
    Scale(f32),
    /// A side of the map is outside [`SIDE_LIMITS_PX`].
    #[error("a map of {width_px:.0} x {height_px:.0} pixels: each side must be {} to {}", SIDE_LIMITS_PX.0, SIDE_LIMITS_PX.1)]
    Size {
        /// The width asked for.
        width_px: f64,
        /// The height asked for.
        height_px: f64,
    },
    /// The field's range is empty, or too small or great to be written beside a colour bar.
    #[error("cannot colour values from {} to {}", .0[0], .0[1])]
    Range([f32; 2]),
    /// A point of the path is NaN or infinite.
    #[error("point {index} of the path is not finite")]
    Path {
        /// Its position in the path.
        index: usize,
    },
    /// A shape is not finite, or has a negative length or a covariance that is not positive semidefinite.
    #[error(
        "shape {index} of overlay {overlay} cannot be drawn: it must be finite, its lengths not negative, a covariance positive semidefinite"
    )]
    Shape {
        /// The position of its overlay.
        overlay: usize,
        /// Its position in the overlay.
        index: usize,
    },
}

impl FieldPicture<'_> {
    /// Draws the values `value_at(x_m, y_m)`, asked for once per pixel, at its centre, row by row from the top left.
    ///
    /// NaN is drawn as [`NOT_A_NUMBER`], and explained beside the colour bar.
    ///
    /// # Errors
    /// If the bounds, the scale, the size, the field's range, a shape or the path cannot be drawn. `value_at` is then not called.
    pub fn render(&self, mut value_at: impl FnMut(f32, f32) -> f32) -> Result<Canvas, PictureError> {
        self.render_all(|points_m| points_m.iter().map(|point_m| value_at(point_m.x, point_m.y)).collect())
    }

    /// [`render`](Self::render) with the values of all pixels' centres, metres, at once.
    ///
    /// # Errors
    /// Those of [`render`](Self::render).
    pub fn render_all(&self, values_at: impl FnOnce(&[Position<2>]) -> Vec<f32>) -> Result<Canvas, PictureError> {
        let map_px = self.map_size()?;
        self.check_inputs()?;
        let axes = Axes::new(&self.bounds_m, map_px);
        let unplaced = Frame::new(self.bounds_m, Point::zero(), map_px);
        let centres_m: Vec<_> = unplaced.centres_m().map(Position::<2>::from).collect();
        let values = values_at(&centres_m);

        let footer = self.footer(map_px, values.iter().any(|value| value.is_nan()));

        let content_px = map_px.width.max(footer.width_px());
        let left = MARGIN_PX + axes.left_px();
        let top = MARGIN_PX + TITLE_PX + axes.above_px();
        let footer_top = top + map_px.height + axes.below_px() + FOOTER_GAP_PX;
        let size =
            Size::new(left + content_px + axes.right_px() + MARGIN_PX, footer_top + Footer::HEIGHT_PX + MARGIN_PX);

        let corner = Point::new((left + (content_px - map_px.width) / 2) as i32, top as i32);
        let frame = Frame::new(self.bounds_m, corner, map_px);
        let mut canvas = Canvas::new(size, frame.area());
        canvas.fill(&frame.area(), values.iter().map(|&value| self.field.colour(value)));
        for overlay in self.overlays {
            overlay.draw(&mut canvas, &frame);
        }
        let path_px: Vec<[f64; 2]> = self.path_m.iter().map(|&point| frame.pixel_of(point)).collect();
        path::draw(&mut canvas, &frame.area(), &path_px);
        axes.draw(&mut canvas, &frame);
        let title = text::shortened(text::LARGE, self.title, content_px);
        text::line(&mut canvas, text::LARGE, &title, Point::new(left as i32, MARGIN_PX as i32), Alignment::Left);
        footer.draw(&mut canvas, Point::new(left as i32, footer_top as i32), content_px);
        Ok(canvas)
    }

    fn footer(&self, map_px: Size, some_are_nan: bool) -> Footer<'_> {
        let mut footer = Footer::default();
        // Of the longer side, where rounding to whole pixels matters least.
        let [longest_px, longest_m] =
            [f64::from(map_px.width.max(map_px.height)), self.bounds_m.width().max(self.bounds_m.height())];
        footer.add(ScaleBar::new(longest_px / longest_m));
        if !self.path_m.is_empty() {
            footer.add(PathKey);
        }
        for overlay in self.overlays.iter().filter(|overlay| !overlay.shapes.is_empty()) {
            footer.add(OverlayKey::new(overlay));
        }
        if some_are_nan {
            footer.add(NoValue);
        }
        footer.add(ColourBar::new(&self.field));
        footer
    }

    /// How large the map itself will be, in pixels, without what is written around it.
    fn map_size(&self) -> Result<Size, PictureError> {
        if !self.bounds_m.are_drawable() {
            return Err(PictureError::Bounds(self.bounds_m));
        }
        let [width_m, height_m] = [self.bounds_m.width(), self.bounds_m.height()];
        let pixels_per_metre = match self.pixels_per_metre {
            Some(scale) if scale.is_finite() && scale > 0.0 => f64::from(scale),
            Some(scale) => return Err(PictureError::Scale(scale)),
            None => f64::from(AUTOMATIC_SIDE_PX) / width_m.max(height_m),
        };
        let [width_px, height_px] = [width_m, height_m].map(|side_m| (side_m * pixels_per_metre).round());
        let possible = f64::from(SIDE_LIMITS_PX.0)..=f64::from(SIDE_LIMITS_PX.1);
        if !(possible.contains(&width_px) && possible.contains(&height_px)) {
            return Err(PictureError::Size { width_px, height_px });
        }
        Ok(Size::new(width_px as u32, height_px as u32))
    }

    fn check_inputs(&self) -> Result<(), PictureError> {
        if !frame::is_drawable(self.field.range) {
            return Err(PictureError::Range(self.field.range));
        }
        for (overlay, Overlay { shapes, .. }) in self.overlays.iter().enumerate() {
            if let Some(index) = shapes.iter().position(|shape| !shape.is_drawable()) {
                return Err(PictureError::Shape { overlay, index });
            }
        }
        match self.path_m.iter().position(|[x, y]| !(x.is_finite() && y.is_finite())) {
            Some(index) => Err(PictureError::Path { index }),
            None => Ok(()),
        }
    }
}
