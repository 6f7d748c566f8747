//! PNG pictures of line charts: series with markers and error bars, linear and logarithmic axes, several charts beside or
//! above each other with one legend below them.
//!
//! They are drawn on the canvas of [`picture`](crate::picture). `plotters`, the obvious library, writes text on a bitmap
//! with a font of the machine or one that would have to lie in this repository, and its SVG is text only where the viewer
//! has a font; the canvas brings bitmap fonts along, gives the same bytes everywhere, and already finds round ticks.
//!
//! Series of the same name look the same in every chart: one colour and one marker, which alone tells them apart in print.
//!
//! ```
//! use bhm_plot::chart::{Axis, Chart, Figure, Layout, Sample, Scale, Series};
//!
//! let points = [Sample { x: 1.0, y: 0.71, error: Some(0.02) }, Sample { x: 2.0, y: 0.84, error: None }];
//! let chart = Chart {
//!     title: "Area under the ROC curve",
//!     x: Axis { label: "scans", scale: Scale::Logarithmic },
//!     y: Axis { label: "AUC", scale: Scale::Linear },
//!     series: &[Series { name: "one map", points: &points }],
//! };
//! let figure = Figure { title: "Learning", bars: "mean ± 2 sigma", layout: Layout::SideBySide, charts: &[chart] };
//! let mut png = Vec::new();
//! figure.render()?.encode_png(&mut png)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod legend;
mod plot;
mod style;
#[cfg(test)]
mod tests;

use embedded_graphics::{prelude::*, text::Alignment};

use self::{legend::Legend, plot::Plot, style::Style};
use crate::picture::{
    Canvas,
    text::{LARGE, line, shortened},
};

/// The series a figure can tell apart.
pub const MOST_SERIES: usize = style::COUNT;

/// The greatest value an axis shows, and the inverse of the least that a logarithmic axis shows.
pub const GREATEST: f64 = 1e100;

/// The blank border around everything.
const MARGIN_PX: u32 = 20;
const TITLE_PX: u32 = 34;
/// Between two charts.
const GAP_PX: u32 = 30;

/// How values are spaced along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    Linear,
    /// Equal ratios are equally long; every value must be positive.
    Logarithmic,
}

/// What an axis shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis<'a> {
    /// What the values are, with their unit if they have one.
    pub label: &'a str,
    /// How they are spaced.
    pub scale: Scale,
}

/// One point of a series, in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where along the x axis.
    pub x: f64,
    /// The value.
    pub y: f64,
    /// How far an error bar reaches above and below the value; `None` draws none. What of it is not positive cannot be
    /// shown on a logarithmic axis: the bar then ends at the axis.
    pub error: Option<f64>,
}

/// Points in the order in which a line connects them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series<'a> {
    /// Its entry in the legend.
    pub name: &'a str,
    /// The points; one is drawn as its marker. Where they are crowded only some have a marker, but all have their bar.
    pub points: &'a [Sample],
}

/// Series over common axes, whose ranges follow from the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chart<'a> {
    /// The heading of this chart.
    pub title: &'a str,
    /// The horizontal axis.
    pub x: Axis<'a>,
    /// The vertical axis.
    pub y: Axis<'a>,
    /// The later are drawn over the earlier.
    pub series: &'a [Series<'a>],
}

/// How the charts of a figure are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// From left to right.
    SideBySide,
    /// From top to bottom.
    Stacked,
}

/// Charts of the same size with a common legend.
///
/// In all texts characters beyond Latin-1 are drawn as `?`, and what does not fit is cut off with `...`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure<'a> {
    /// The heading.
    pub title: &'a str,
    /// What an error bar shows, such as `mean ± 2 sigma`: said in the legend if there is one to explain.
    pub bars: &'a str,
    /// How the charts are arranged.
    pub layout: Layout,
    /// The charts, at least one.
    pub charts: &'a [Chart<'a>],
}

/// Why a figure cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChartError {
    /// The figure has no charts.
    #[error("a figure without charts")]
    NoCharts,
    /// No series of the chart has a point.
    #[error("chart {chart:?} has no points")]
    NoPoints {
        /// The chart's title.
        chart: String,
    },
    /// There are more than [`MOST_SERIES`].
    #[error("{count} series of different names: {MOST_SERIES} can be told apart")]
    TooManySeries {
        /// How many there are.
        count: usize,
    },
    /// A coordinate, or an error bar's end, is NaN, infinite or beyond [`GREATEST`]; or the error is negative.
    #[error("chart {chart:?}, series {series:?}: point {index} cannot be drawn: {sample:?}")]
    Sample {
        /// The chart's title.
        chart: String,
        /// The series' name.
        series: String,
        /// The point's position in the series.
        index: usize,
        /// The point.
        sample: Sample,
    },
    /// A coordinate on a logarithmic axis is not positive, or below the inverse of [`GREATEST`].
    #[error(
        "chart {chart:?}, series {series:?}: point {index} is not positive, but its axis is logarithmic: {sample:?}"
    )]
    NotPositive {
        /// The chart's title.
        chart: String,
        /// The series' name.
        series: String,
        /// The point's position in the series.
        index: usize,
        /// The point.
        sample: Sample,
    },
}

impl<'a> Figure<'a> {
    /// Draws it. The canvas' [`map_area`](Canvas::map_area) is the space between the first chart's axes.
    ///
    /// # Errors
    /// If there is nothing to draw, or a value that cannot be.
    pub fn render(&self) -> Result<Canvas, ChartError> {
        self.drawn().map(|(canvas, _plots)| canvas)
    }

    /// The picture, and where its charts are.
    fn drawn(&self) -> Result<(Canvas, Vec<Plot<'a>>), ChartError> {
        let names = self.names()?;
        let mut plots: Vec<Plot<'a>> = self.charts.iter().map(Plot::new).collect::<Result<_, _>>()?;
        // Plots stand below each other edge on edge, which is why all leave the room that one of them needs.
        let left_px = plots.iter().map(Plot::left_px).max().ok_or(ChartError::NoCharts)?;
        let chart_px = Plot::outer_px(left_px);
        let count = plots.len() as u32;
        let (columns, rows) = match self.layout {
            Layout::SideBySide => (count, 1),
            Layout::Stacked => (1, count),
        };
        let pitch = chart_px + Size::new_equal(GAP_PX);
        let content_px = columns * pitch.width - GAP_PX;
        let charts_px = rows * pitch.height - GAP_PX;

        let legend = Legend::new(&names, self.bars_explained(), content_px);
        let legend_top = MARGIN_PX + TITLE_PX + charts_px + GAP_PX;
        let size = Size::new(content_px + 2 * MARGIN_PX, legend_top + legend.height_px() + MARGIN_PX);

        for (i, plot) in (0_u32..).zip(&mut plots) {
            let (column, row) = (i % columns, i / columns);
            let corner = Size::new(MARGIN_PX + column * pitch.width, MARGIN_PX + TITLE_PX + row * pitch.height);
            plot.place(Point::zero() + corner, left_px);
        }
        let mut canvas = Canvas::new(size, plots[0].area());
        let corner = Point::new_equal(MARGIN_PX as i32);
        line(&mut canvas, LARGE, &shortened(LARGE, self.title, content_px), corner, Alignment::Left);
        for plot in &plots {
            plot.draw(&mut canvas, |name| Style::of(names.iter().position(|known| *known == name)));
        }
        legend.draw(&mut canvas, Point::new(MARGIN_PX as i32, legend_top as i32));
        Ok((canvas, plots))
    }

    /// The names of all series, in the order in which they first occur.
    fn names(&self) -> Result<Vec<&str>, ChartError> {
        let mut names = Vec::new();
        for series in self.charts.iter().flat_map(|chart| chart.series) {
            if !names.contains(&series.name) {
                names.push(series.name);
            }
        }
        if names.len() > MOST_SERIES { Err(ChartError::TooManySeries { count: names.len() }) } else { Ok(names) }
    }

    fn bars_explained(&self) -> Option<&str> {
        let mut samples = self.charts.iter().flat_map(|chart| chart.series).flat_map(|series| series.points);
        samples.any(|sample| sample.error.is_some()).then_some(self.bars)
    }
}
