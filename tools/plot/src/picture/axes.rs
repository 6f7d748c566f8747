//! The axes along a map.

use embedded_graphics::{
    prelude::*,
    primitives::{PrimitiveStyle, Rectangle},
    text::Alignment,
};

use super::{
    canvas::Canvas,
    colour::INK,
    frame::{Bounds, Frame},
    step::{Tick, labelled_ticks},
    text::{self, SMALL, label_height, label_width, line},
};

const TICK_PX: u32 = 6;
const LABEL_GAP_PX: u32 = 5;
const CAPTION_GAP_PX: u32 = 5;
const X_CAPTION: &str = "x [m]";
const Y_CAPTION: &str = "y [m]";

/// Ticks in metres along the left and the lower edge of a map.
pub(super) struct Axes {
    x: Vec<Tick>,
    y: Vec<Tick>,
}

impl Axes {
    pub(super) fn new(bounds_m: &Bounds, map_px: Size) -> Self {
        let [min, max] = [bounds_m.min, bounds_m.max].map(|corner| corner.map(f64::from));
        Self {
            x: labelled_ticks(min[0], max[0], map_px.width, label_width),
            y: labelled_ticks(min[1], max[1], map_px.height, label_height),
        }
    }

    /// What the axes need left of the map.
    pub(super) fn left_px(&self) -> u32 {
        let labels = widest_px(&self.y).max(text::width_px(SMALL, Y_CAPTION));
        (TICK_PX + LABEL_GAP_PX + labels).max(self.right_px())
    }

    /// How far the labels reach beyond the right edge of the map.
    pub(super) fn right_px(&self) -> u32 {
        widest_px(&self.x) / 2
    }

    /// What the axes need above the map: the caption, clear of a label at the upper edge.
    pub(super) fn above_px(&self) -> u32 {
        SMALL.character_size.height * 3 / 2 + CAPTION_GAP_PX
    }

    /// What the axes need below the map: labels and, below them, the caption.
    pub(super) fn below_px(&self) -> u32 {
        TICK_PX + LABEL_GAP_PX + CAPTION_GAP_PX + 2 * SMALL.character_size.height
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let area = frame.area();
        // Around the map, not over it.
        outline(canvas, &area.offset(1));
        let label_height = SMALL.character_size.height as i32;
        let away = (TICK_PX + LABEL_GAP_PX) as i32;

        let left = area.top_left.x;
        for tick in &self.y {
            let row = pixel_containing(frame.row_of(tick.value));
            canvas.rectangle(Point::new(left - TICK_PX as i32, row), Size::new(TICK_PX, 1), INK);
            line(canvas, SMALL, &tick.label, Point::new(left - away, row - label_height / 2), Alignment::Right);
        }
        let caption_top = area.top_left.y - self.above_px() as i32;
        line(canvas, SMALL, Y_CAPTION, Point::new(left - away, caption_top), Alignment::Right);

        let bottom = area.top_left.y + area.size.height as i32;
        for tick in &self.x {
            let column = pixel_containing(frame.column_of(tick.value));
            canvas.rectangle(Point::new(column, bottom), Size::new(1, TICK_PX), INK);
            line(canvas, SMALL, &tick.label, Point::new(column, bottom + away), Alignment::Center);
        }
        let caption = Point::new(area.center().x, bottom + away + label_height + CAPTION_GAP_PX as i32);
        line(canvas, SMALL, X_CAPTION, caption, Alignment::Center);
    }
}

/// The pixel that contains a continuous coordinate; for the far end of a map or bar, that of the outline beyond it.
pub(crate) fn pixel_containing(coordinate: f64) -> i32 {
    coordinate.floor() as i32
}

/// A line one pixel wide along the inside of a rectangle.
pub(crate) fn outline(canvas: &mut Canvas, area: &Rectangle) {
    let Ok(()) = area.into_styled(PrimitiveStyle::with_stroke(INK, 1)).draw(canvas);
}

pub(crate) fn widest_px(ticks: &[Tick]) -> u32 {
    ticks.iter().map(|tick| text::width_px(SMALL, &tick.label)).max().unwrap_or(0)
}
