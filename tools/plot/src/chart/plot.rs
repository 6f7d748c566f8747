//! One chart: its axes, grid, and series.

use embedded_graphics::{
    mono_font::iso_8859_1::FONT_9X15_BOLD, pixelcolor::Rgb888, prelude::*, primitives::Rectangle, text::Alignment,
};

use super::{
    Chart, ChartError, Sample, Scale,
    axis::Ruler,
    style::{Style, add_bar},
};
use crate::picture::{
    Canvas,
    axes::{outline, pixel_containing, widest_px},
    colour::{BACKGROUND, INK, mix},
    path::Mask,
    step::Tick,
    text::{SMALL, label_height, label_width, line, shortened},
};

const AREA_PX: Size = Size::new(600, 400);
const GRID: Rgb888 = Rgb888::new(226, 228, 232);
const TICK_PX: u32 = 6;
const MINOR_TICK_PX: u32 = 3;
const GAP_PX: u32 = 5;
const LINE_PX: u32 = SMALL.character_size.height;
/// The title and, below it, the caption of the y axis, clear of a label at the upper edge.
const ABOVE_PX: u32 = 2 * LINE_PX + 4 * GAP_PX;
const BELOW_PX: u32 = TICK_PX + 2 * (GAP_PX + LINE_PX);
/// Half the width of the longest label of an x axis.
const RIGHT_PX: u32 = 45;
/// Markers nearer to each other would hide the line and themselves.
const MARKER_DISTANCE_PX: f64 = 14.0;

/// A chart whose ranges are known, and its place on the canvas once it has one.
pub(super) struct Plot<'a> {
    chart: &'a Chart<'a>,
    x: Ruler,
    y: Ruler,
    x_ticks: Vec<Tick>,
    y_ticks: Vec<Tick>,
    corner: Point,
}

impl<'a> Plot<'a> {
    pub(super) fn new(chart: &'a Chart<'a>) -> Result<Self, ChartError> {
        check(chart)?;
        let samples = || chart.series.iter().flat_map(|series| series.points);
        let none = || ChartError::NoPoints { chart: chart.title.to_owned() };
        let x = Ruler::new(chart.x.scale, range(samples().map(|sample| sample.x)).ok_or_else(none)?);
        let y = Ruler::new(chart.y.scale, range(samples().flat_map(|sample| shown(chart, sample))).ok_or_else(none)?);
        let x_ticks = x.ticks(AREA_PX.width, label_width);
        let y_ticks = y.ticks(AREA_PX.height, label_height);
        Ok(Self { chart, x, y, x_ticks, y_ticks, corner: Point::zero() })
    }

    /// What the labels of the y axis need.
    pub(super) fn left_px(&self) -> u32 {
        (TICK_PX + GAP_PX + widest_px(&self.y_ticks)).max(RIGHT_PX)
    }

    /// The whole of a chart whose area begins `left_px` from the left.
    pub(super) fn outer_px(left_px: u32) -> Size {
        AREA_PX + Size::new(left_px + RIGHT_PX, ABOVE_PX + BELOW_PX)
    }

    /// Gives it a place, with everything that is written around it.
    pub(super) fn place(&mut self, corner: Point, left_px: u32) {
        self.corner = corner + Point::new(left_px as i32, ABOVE_PX as i32);
    }

    /// What the axes enclose.
    pub(super) fn area(&self) -> Rectangle {
        Rectangle::new(self.corner, AREA_PX)
    }

    /// Where a point lies on the canvas, in continuous pixel coordinates.
    pub(super) fn pixel_of(&self, x: f64, y: f64) -> [f64; 2] {
        [self.column_of(x), self.row_of(y)]
    }

    fn column_of(&self, x: f64) -> f64 {
        f64::from(self.corner.x) + self.x.share(x) * f64::from(AREA_PX.width)
    }

    fn row_of(&self, y: f64) -> f64 {
        f64::from(self.corner.y) + (1.0 - self.y.share(y)) * f64::from(AREA_PX.height)
    }

    /// Draws everything; `style_of` knows the looks of a series of this name.
    pub(super) fn draw(&self, canvas: &mut Canvas, style_of: impl Fn(&str) -> Style) {
        self.draw_axes(canvas);
        let area = self.area();
        // Bars below all lines: they are what may be covered.
        for series in self.chart.series {
            let marked = self.marked(series.points);
            let [mut between, mut bars] = [Mask::new(&area), Mask::new(&area)];
            for (sample, error) in series.points.iter().filter_map(|sample| Some((sample, sample.error?))) {
                let is_marked = marked.contains(&self.pixel_at(sample));
                let ends = [sample.y - error, sample.y + error].map(|end| self.row_of(end));
                add_bar(if is_marked { &mut bars } else { &mut between }, self.column_of(sample.x), ends, is_marked);
            }
            let colour = style_of(series.name).colour;
            // Those of crowded points together are a band, on which the line must stay visible.
            between.paint(canvas, &area, mix(BACKGROUND, colour, 0.3));
            bars.paint(canvas, &area, colour);
        }
        for series in self.chart.series {
            let points: Vec<[f64; 2]> = series.points.iter().map(|sample| self.pixel_at(sample)).collect();
            style_of(series.name).draw(canvas, &area, &points, &self.marked(series.points));
        }
        // What lies at an edge is cut by the frame, not over it.
        outline(canvas, &area.offset(1));
    }

    fn pixel_at(&self, sample: &Sample) -> [f64; 2] {
        self.pixel_of(sample.x, sample.y)
    }

    /// The pixels of the points that have a marker: the first, and those far enough from the one before.
    fn marked(&self, points: &[Sample]) -> Vec<[f64; 2]> {
        let mut marked: Vec<[f64; 2]> = Vec::new();
        for at in points.iter().map(|sample| self.pixel_at(sample)) {
            let is_far = |last: &[f64; 2]| (at[0] - last[0]).hypot(at[1] - last[1]) >= MARKER_DISTANCE_PX;
            if marked.last().is_none_or(is_far) {
                marked.push(at);
            }
        }
        marked
    }

    fn draw_axes(&self, canvas: &mut Canvas) {
        let area = self.area();
        let [left, top] = [area.top_left.x, area.top_left.y];
        let bottom = top + AREA_PX.height as i32;
        let away = (TICK_PX + GAP_PX) as i32;
        let row_of = |y| pixel_containing(self.row_of(y));
        let column_of = |x| pixel_containing(self.column_of(x));

        for tick in &self.y_ticks {
            let row = row_of(tick.value);
            canvas.rectangle(Point::new(left, row), Size::new(AREA_PX.width, 1), GRID);
            canvas.rectangle(Point::new(left - TICK_PX as i32, row), Size::new(TICK_PX, 1), INK);
            line(canvas, SMALL, &tick.label, Point::new(left - away, row - LINE_PX as i32 / 2), Alignment::Right);
        }
        for tick in &self.x_ticks {
            let column = column_of(tick.value);
            canvas.rectangle(Point::new(column, top), Size::new(1, AREA_PX.height), GRID);
            canvas.rectangle(Point::new(column, bottom), Size::new(1, TICK_PX), INK);
            line(canvas, SMALL, &tick.label, Point::new(column, bottom + away), Alignment::Center);
        }
        for row in self.y.minor().into_iter().map(row_of) {
            canvas.rectangle(Point::new(left - MINOR_TICK_PX as i32, row), Size::new(MINOR_TICK_PX, 1), INK);
        }
        for column in self.x.minor().into_iter().map(column_of) {
            canvas.rectangle(Point::new(column, bottom), Size::new(1, MINOR_TICK_PX), INK);
        }

        let title_top = top - ABOVE_PX as i32;
        let title = shortened(&FONT_9X15_BOLD, self.chart.title, AREA_PX.width);
        line(canvas, &FONT_9X15_BOLD, &title, Point::new(area.center().x, title_top), Alignment::Center);
        // Above the axis, as text that is read from left to right; the labels' column is where it begins.
        let y_caption = shortened(SMALL, &self.y.caption(&self.chart.y), AREA_PX.width);
        let y_caption_left = left - (away + label_width("0.00") as i32).min(RIGHT_PX as i32);
        let y_caption_top = title_top + (LINE_PX + GAP_PX) as i32;
        line(canvas, SMALL, &y_caption, Point::new(y_caption_left, y_caption_top), Alignment::Left);
        let x_caption = shortened(SMALL, &self.x.caption(&self.chart.x), AREA_PX.width);
        let x_caption_top = bottom + away + (LINE_PX + GAP_PX) as i32;
        line(canvas, SMALL, &x_caption, Point::new(area.center().x, x_caption_top), Alignment::Center);
    }
}

fn check(chart: &Chart<'_>) -> Result<(), ChartError> {
    for series in chart.series {
        for (index, &sample) in series.points.iter().enumerate() {
            let named = || (chart.title.to_owned(), series.name.to_owned());
            let Sample { x, y, error } = sample;
            let reach = error.unwrap_or(0.0);
            if !(reach >= 0.0 && Ruler::can_show_linearly(&[x, y - reach, y + reach])) {
                let (chart, series) = named();
                return Err(ChartError::Sample { chart, series, index, sample });
            }
            if !(Ruler::can_show(chart.x.scale, x) && Ruler::can_show(chart.y.scale, y)) {
                let (chart, series) = named();
                return Err(ChartError::NotPositive { chart, series, index, sample });
            }
        }
    }
    Ok(())
}

/// The values of a sample that the y axis must reach.
fn shown(chart: &Chart<'_>, &Sample { y, error, .. }: &Sample) -> [f64; 2] {
    let error = error.unwrap_or(0.0);
    let low = match chart.y.scale {
        Scale::Linear => y - error,
        // The end of a bar may come near zero: a decade of it says enough.
        Scale::Logarithmic => (y - error).max(y / 10.0),
    };
    [low, y + error]
}

/// From the least to the greatest.
fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |range, value| match range {
        None => Some([value; 2]),
        Some([min, max]) => Some([value.min(min), value.max(max)]),
    })
}
