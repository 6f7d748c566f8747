//! Lines of text in two fixed fonts.

use embedded_graphics::{
    mono_font::{
        MonoFont, MonoTextStyle,
        iso_8859_1::{FONT_9X15, FONT_10X20},
    },
    prelude::*,
    text::{Alignment, Baseline, Text, TextStyleBuilder},
};

use super::{canvas::Canvas, colour::INK};

/// Labels, captions, ticks.
pub(crate) const SMALL: &MonoFont<'_> = &FONT_9X15;
/// The title.
pub(crate) const LARGE: &MonoFont<'_> = &FONT_10X20;

pub(crate) fn width_px(font: &MonoFont<'_>, text: &str) -> u32 {
    text.chars().count() as u32 * (font.character_size.width + font.character_spacing)
}

/// One line whose upper edge is at `at`, which is its left end, middle or right end.
pub(crate) fn line(canvas: &mut Canvas, font: &MonoFont<'_>, text: &str, at: Point, alignment: Alignment) {
    let style = TextStyleBuilder::new().alignment(alignment).baseline(Baseline::Top).build();
    let Ok(_end) = Text::with_text_style(text, at, MonoTextStyle::new(font, INK), style).draw(canvas);
}

/// As much of the text as fits into `width_px`, on one line.
pub(crate) fn shortened(font: &MonoFont<'_>, text: &str, available_px: u32) -> String {
    const ELLIPSIS: &str = "...";
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if width_px(font, &text) <= available_px {
        return text;
    }
    let room_px = available_px.saturating_sub(width_px(font, ELLIPSIS));
    let kept = (room_px / width_px(font, "x")) as usize;
    text.chars().take(kept).chain(ELLIPSIS.chars()).collect()
}

/// The extent of a label beside others.
pub(crate) fn label_width(label: &str) -> u32 {
    width_px(SMALL, label)
}

/// The extent of a label above others: these need no room for their width.
pub(crate) fn label_height(_label: &str) -> u32 {
    SMALL.character_size.height
}
