//! What stands below the charts: each series' name beside its looks, as many in a row as fit.

use embedded_graphics::{prelude::*, primitives::Rectangle, text::Alignment};

use super::style::{Style, add_bar};
use crate::picture::{
    Canvas,
    colour::INK,
    path::Mask,
    text::{SMALL, line, shortened, width_px},
};

const SYMBOL_PX: u32 = 44;
const ROW_PX: u32 = 24;
const TEXT_GAP_PX: u32 = 8;
const ENTRY_GAP_PX: u32 = 30;

/// Entries in rows.
pub(super) struct Legend {
    entries: Vec<Entry>,
    rows: u32,
}

struct Entry {
    symbol: Symbol,
    text: String,
    /// From the legend's corner.
    at: Point,
}

enum Symbol {
    Series(Style),
    Bar,
}

impl Legend {
    pub(super) fn new(names: &[&str], bars: Option<&str>, width_px_available: u32) -> Self {
        let series = names.iter().enumerate().map(|(i, &name)| (Symbol::Series(Style::of(Some(i))), name));
        let bars = bars.map(|meaning| (Symbol::Bar, meaning));
        let mut entries = Vec::new();
        let (mut left, mut row) = (0, 0);
        for (symbol, text) in series.chain(bars) {
            let text = shortened(SMALL, text, width_px_available - SYMBOL_PX - TEXT_GAP_PX);
            let entry_px = SYMBOL_PX + TEXT_GAP_PX + width_px(SMALL, &text);
            if left > 0 && left + entry_px > width_px_available {
                (left, row) = (0, row + 1);
            }
            entries.push(Entry { symbol, text, at: Point::new(left as i32, (row * ROW_PX) as i32) });
            left += entry_px + ENTRY_GAP_PX;
        }
        Self { entries, rows: row + 1 }
    }

    pub(super) fn height_px(&self) -> u32 {
        self.rows * ROW_PX
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, corner: Point) {
        for Entry { symbol, text, at } in &self.entries {
            let area = Rectangle::new(corner + *at, Size::new(SYMBOL_PX, ROW_PX));
            let [left, top] = [f64::from(area.top_left.x), f64::from(area.top_left.y)];
            let [middle, row] = [left + f64::from(SYMBOL_PX) / 2.0, top + f64::from(ROW_PX) / 2.0];
            match symbol {
                Symbol::Series(style) => {
                    let ends = [[left + 1.0, row], [left + f64::from(SYMBOL_PX) - 1.0, row]];
                    style.draw(canvas, &area, &ends, &[[middle, row]]);
                }
                Symbol::Bar => {
                    let mut bar = Mask::new(&area);
                    add_bar(&mut bar, middle, [row - 9.0, row + 9.0], true);
                    bar.paint(canvas, &area, INK);
                }
            }
            let text_top = area.top_left.y + (ROW_PX as i32 - SMALL.character_size.height as i32) / 2;
            let text_left = area.top_left.x + (SYMBOL_PX + TEXT_GAP_PX) as i32;
            line(canvas, SMALL, text, Point::new(text_left, text_top), Alignment::Left);
        }
    }
}
