//! What stands below the map: blocks side by side, each a heading with a symbol under it. A new one is a [`Block`] and
//! the line that adds it.

use embedded_graphics::{prelude::*, primitives::Rectangle, text::Alignment};

use super::{
    Field, Overlay,
    axes::{outline, pixel_containing, widest_px},
    canvas::Canvas,
    colour::{INK, NOT_A_NUMBER},
    overlay::KEY_WIDTH_PX,
    path::{self, MARKER_RADIUS_PX},
    step::{Step, Tick, labelled_ticks},
    text::{self, SMALL, line},
};

const LINE_PX: u32 = SMALL.character_size.height;
const SYMBOL_PX: u32 = 18;
const SYMBOL_TOP_PX: u32 = LINE_PX + 6;
const TICK_PX: u32 = 5;
const TICK_LABEL_GAP_PX: u32 = 2;
const LEAST_GAP_PX: u32 = 36;

/// A part of the footer.
pub(super) trait Block {
    fn width_px(&self) -> u32;
    /// Draws the block rightwards and down from `at`, at most [`Footer::HEIGHT_PX`] high.
    fn draw(&self, canvas: &mut Canvas, at: Point);
}

/// Blocks spread over the width of the picture.
#[derive(Default)]
pub(super) struct Footer<'a> {
    blocks: Vec<Box<dyn Block + 'a>>,
}

impl<'a> Footer<'a> {
    pub(super) const HEIGHT_PX: u32 = SYMBOL_TOP_PX + SYMBOL_PX + TICK_PX + TICK_LABEL_GAP_PX + LINE_PX;

    pub(super) fn add(&mut self, block: impl Block + 'a) {
        self.blocks.push(Box::new(block));
    }

    /// The least width at which the blocks do not crowd each other.
    pub(super) fn width_px(&self) -> u32 {
        self.filled_px() + self.gaps() * LEAST_GAP_PX
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, at: Point, width_px: u32) {
        let gap_px = (width_px - self.filled_px()) / self.gaps().max(1);
        let mut corner = at;
        for block in &self.blocks {
            block.draw(canvas, corner);
            corner.x += (block.width_px() + gap_px) as i32;
        }
    }

    fn filled_px(&self) -> u32 {
        self.blocks.iter().map(|block| block.width_px()).sum()
    }

    fn gaps(&self) -> u32 {
        (self.blocks.len() as u32).saturating_sub(1)
    }
}

/// The space below a block's heading.
fn symbol(at: Point, width_px: u32) -> Rectangle {
    Rectangle::new(at + Point::new(0, SYMBOL_TOP_PX as i32), Size::new(width_px, SYMBOL_PX))
}

/// A round length on the map.
pub(super) struct ScaleBar {
    length: Step,
    length_px: u32,
}

impl ScaleBar {
    const LONGEST_PX: f64 = 200.0;

    pub(super) fn new(pixels_per_metre: f64) -> Self {
        let length = Step::at_most(Self::LONGEST_PX / pixels_per_metre);
        Self { length, length_px: (length.length() * pixels_per_metre).round() as u32 }
    }

    fn label(&self) -> String {
        format!("{} m", self.length.label(1))
    }
}

impl Block for ScaleBar {
    fn width_px(&self) -> u32 {
        self.length_px.max(text::width_px(SMALL, &self.label()))
    }

    fn draw(&self, canvas: &mut Canvas, at: Point) {
        const THICKNESS_PX: u32 = 3;
        line(canvas, SMALL, &self.label(), at, Alignment::Left);
        let symbol = symbol(at, self.length_px);
        let middle = symbol.top_left + Point::new(0, ((SYMBOL_PX - THICKNESS_PX) / 2) as i32);
        canvas.rectangle(middle, Size::new(self.length_px, THICKNESS_PX), INK);
        let cap = Size::new(2, SYMBOL_PX / 2 + 1);
        let cap_top = Point::new(0, (SYMBOL_PX / 4) as i32);
        let last = Point::new(self.length_px as i32 - cap.width as i32, 0);
        canvas.rectangle(symbol.top_left + cap_top, cap, INK);
        canvas.rectangle(symbol.top_left + cap_top + last, cap, INK);
    }
}

/// What the line and its markers mean.
pub(super) struct PathKey;

impl PathKey {
    const CAPTION: &'static str = "path of the robot";
    const START: &'static str = "start";
    const END: &'static str = "end";
    const LINE_PX: u32 = 90;
    const GAP_PX: u32 = 8;
}

impl Block for PathKey {
    fn width_px(&self) -> u32 {
        let words = text::width_px(SMALL, Self::START) + text::width_px(SMALL, Self::END);
        text::width_px(SMALL, Self::CAPTION).max(words + Self::LINE_PX + 2 * Self::GAP_PX)
    }

    fn draw(&self, canvas: &mut Canvas, at: Point) {
        line(canvas, SMALL, Self::CAPTION, at, Alignment::Left);
        let symbol = symbol(at, self.width_px());
        let text_top = symbol.top_left.y + (SYMBOL_PX as i32 - LINE_PX as i32) / 2;
        line(canvas, SMALL, Self::START, Point::new(at.x, text_top), Alignment::Left);

        let left = at.x + (text::width_px(SMALL, Self::START) + Self::GAP_PX) as i32;
        let middle = f64::from(symbol.top_left.y) + f64::from(SYMBOL_PX) / 2.0;
        let start = [f64::from(left) + MARKER_RADIUS_PX, middle];
        let end = [f64::from(left) + f64::from(Self::LINE_PX) - MARKER_RADIUS_PX, middle];
        path::draw(canvas, &symbol, &[start, end]);

        let right = left + (Self::LINE_PX + Self::GAP_PX) as i32;
        line(canvas, SMALL, Self::END, Point::new(right, text_top), Alignment::Left);
    }
}

/// What the shapes of an overlay mean.
pub(super) struct OverlayKey<'a> {
    overlay: &'a Overlay<'a>,
    legend: String,
}

impl<'a> OverlayKey<'a> {
    const MOST_CHARACTERS: usize = 40;

    pub(super) fn new(overlay: &'a Overlay<'a>) -> Self {
        let legend = text::shortened(SMALL, overlay.legend, text::width_px(SMALL, &"x".repeat(Self::MOST_CHARACTERS)));
        Self { overlay, legend }
    }

    fn symbols_px(&self) -> u32 {
        self.overlay.kinds().len() as u32 * KEY_WIDTH_PX as u32
    }
}

impl Block for OverlayKey<'_> {
    fn width_px(&self) -> u32 {
        text::width_px(SMALL, &self.legend).max(self.symbols_px())
    }

    fn draw(&self, canvas: &mut Canvas, at: Point) {
        line(canvas, SMALL, &self.legend, at, Alignment::Left);
        self.overlay.draw_key(canvas, &symbol(at, self.symbols_px()));
    }
}

/// The colour of NaN.
pub(super) struct NoValue;

impl NoValue {
    const CAPTION: &'static str = "no value";
}

impl Block for NoValue {
    fn width_px(&self) -> u32 {
        text::width_px(SMALL, Self::CAPTION)
    }

    fn draw(&self, canvas: &mut Canvas, at: Point) {
        line(canvas, SMALL, Self::CAPTION, at, Alignment::Left);
        let symbol = symbol(at, SYMBOL_PX);
        canvas.rectangle(symbol.top_left, symbol.size, NOT_A_NUMBER);
        outline(canvas, &symbol);
    }
}

/// The colours of the values.
pub(super) struct ColourBar<'a> {
    field: &'a Field,
    bar_px: u32,
    ticks: Vec<Tick>,
}

impl<'a> ColourBar<'a> {
    const SHORTEST_PX: u32 = 320;

    pub(super) fn new(field: &'a Field) -> Self {
        let bar_px = text::width_px(SMALL, field.caption).max(Self::SHORTEST_PX);
        let [low, high] = field.range.map(f64::from);
        Self { field, bar_px, ticks: labelled_ticks(low, high, bar_px, text::label_width) }
    }

    /// How far a label may reach beyond an end of the bar.
    fn overhang_px(&self) -> u32 {
        widest_px(&self.ticks) / 2
    }
}

impl Block for ColourBar<'_> {
    fn width_px(&self) -> u32 {
        self.bar_px + 2 * self.overhang_px()
    }

    fn draw(&self, canvas: &mut Canvas, at: Point) {
        let at = at + Point::new(self.overhang_px() as i32, 0);
        line(canvas, SMALL, self.field.caption, at, Alignment::Left);

        let bar = symbol(at, self.bar_px);
        let [low, high] = self.field.range.map(f64::from);
        let colour_of = |column| self.field.colours.at((f64::from(column) + 0.5) as f32 / self.bar_px as f32);
        canvas.fill(&bar, (0..SYMBOL_PX).flat_map(|_row| (0..self.bar_px).map(colour_of)));
        outline(canvas, &bar.offset(1));

        let bottom = bar.top_left.y + SYMBOL_PX as i32;
        for tick in &self.ticks {
            let share = (tick.value - low) / (high - low);
            let column = pixel_containing(f64::from(at.x) + share * f64::from(self.bar_px));
            canvas.rectangle(Point::new(column, bottom), Size::new(1, TICK_PX), INK);
            let label_top = bottom + (TICK_PX + TICK_LABEL_GAP_PX) as i32;
            line(canvas, SMALL, &tick.label, Point::new(column, label_top), Alignment::Center);
        }
    }
}
