use embedded_graphics::{prelude::*, primitives::Rectangle};

use super::style::Style;
use super::{Axis, Chart, ChartError, Figure, Layout, Sample, Scale, Series};
use crate::picture::{Canvas, Rgb888};

const LINEAR: Axis<'_> = Axis { label: "value", scale: Scale::Linear };
const LOGARITHMIC: Axis<'_> = Axis { label: "value", scale: Scale::Logarithmic };
/// Of the first and of the second series.
const BLUE: Rgb888 = Rgb888::new(0, 114, 178);
const ORANGE: Rgb888 = Rgb888::new(213, 94, 0);

const fn sample(x: f64, y: f64) -> Sample {
    Sample { x, y, error: None }
}

fn chart<'a>(x: Axis<'a>, y: Axis<'a>, series: &'a [Series<'a>]) -> Chart<'a> {
    Chart { title: "chart", x, y, series }
}

fn figure<'a>(charts: &'a [Chart<'a>]) -> Figure<'a> {
    Figure { title: "figure", bars: "mean ± 2 sigma", layout: Layout::SideBySide, charts }
}

fn drawn(x: Axis<'_>, y: Axis<'_>, points: &[Sample]) -> Result<Canvas, ChartError> {
    figure(&[chart(x, y, &[Series { name: "first", points }])]).render()
}

/// The colour at shares of the chart's width (from the left) and height (from below).
fn colour_at(canvas: &Canvas, right: f64, up: f64) -> Rgb888 {
    let Rectangle { top_left, size } = canvas.map_area();
    let column = (right * f64::from(size.width)).floor() as i32;
    let row = ((1.0 - up) * f64::from(size.height)).floor() as i32;
    canvas.pixel(top_left + Point::new(column, row)).unwrap()
}

/// Whether a pixel is rather of this colour than white.
fn is_mostly(pixel: Rgb888, colour: Rgb888) -> bool {
    let distance = |other: Rgb888| {
        let apart = |a: u8, b: u8| u32::from(a.abs_diff(b));
        apart(pixel.r(), other.r()) + apart(pixel.g(), other.g()) + apart(pixel.b(), other.b())
    };
    distance(colour) < distance(Rgb888::WHITE)
}

fn pixels_of(canvas: &Canvas, colour: Rgb888) -> Vec<Point> {
    canvas.bounding_box().points().filter(|&at| canvas.pixel(at) == Some(colour)).collect()
}

#[test]
fn points_and_lines_are_where_their_values_say() {
    // 10 wide with half a unit blank at each end: a value v is (v + 0.5) / 11 along its axis.
    let points = [sample(0.0, 0.0), sample(2.0, 8.0), sample(10.0, 10.0)];
    let canvas = drawn(LINEAR, LINEAR, &points).unwrap();
    for (x, y) in [(0.0, 0.0), (2.0, 8.0), (10.0, 10.0), (1.0, 4.0), (6.0, 9.0)] {
        assert!(is_mostly(colour_at(&canvas, (x + 0.5) / 11.0, (y + 0.5) / 11.0), BLUE), "{x} {y}");
    }
    assert!(!is_mostly(colour_at(&canvas, 6.5 / 11.0, 9.3 / 11.0), BLUE));
    assert!(!is_mostly(colour_at(&canvas, 6.5 / 11.0, 9.7 / 11.0), BLUE));
    // 4 and 2 decades, a twentieth of them blank at each end; a line between is straight in logarithms.
    let points = [sample(0.1, 1.0), sample(1000.0, 100.0)];
    let canvas = drawn(LOGARITHMIC, LOGARITHMIC, &points).unwrap();
    for share in [0.2 / 4.4, 0.5, 2.7 / 4.4, 4.2 / 4.4] {
        assert!(is_mostly(colour_at(&canvas, share, share), BLUE), "{share}");
    }
}

#[test]
fn bars_reach_as_far_as_the_error() {
    // From 2 to 12: again half a unit blank at each end, (v - 1.5) / 11.
    let points = [Sample { x: 0.0, y: 7.0, error: Some(5.0) }, Sample { x: 10.0, y: 7.0, error: Some(2.0) }];
    let canvas = drawn(LINEAR, LINEAR, &points).unwrap();
    let is_blank = |y| {
        let colour = colour_at(&canvas, 10.5 / 11.0, (y - 1.5) / 11.0);
        // Not the bar's colour nor a mix with it: the background or the grid.
        colour.r() > 200
    };
    assert!([5.1, 8.0, 8.9].into_iter().all(|y| !is_blank(y)));
    assert!([2.0, 4.8, 9.2, 12.0].into_iter().all(is_blank));

    // What is not positive has no place on a logarithmic axis: the bar goes down to its end.
    let points = [Sample { x: 0.0, y: 1.0, error: Some(3.0) }, sample(1.0, 1.0)];
    let canvas = drawn(LINEAR, LOGARITHMIC, &points).unwrap();
    let Rectangle { top_left, size } = canvas.map_area();
    let column = top_left.x + (0.05 / 1.1 * f64::from(size.width)) as i32;
    let lowest = Point::new(column, top_left.y + size.height as i32 - 1);
    assert!(canvas.pixel(lowest).unwrap().r() < 200);
}

#[test]
fn nothing_of_a_series_is_drawn_over_what_is_written() {
    let points = [sample(-3.0, 1e-3), sample(5.0, 1.0), sample(5.0, 1e5)];
    let canvas = drawn(LINEAR, LOGARITHMIC, &points).unwrap();
    let area = canvas.map_area();
    let below = area.top_left.y + area.size.height as i32 + 60;
    let (inside, outside): (Vec<Point>, Vec<Point>) =
        pixels_of(&canvas, BLUE).into_iter().partition(|&at| area.contains(at));
    assert!(inside.len() > 500);
    // The legend, and only the legend.
    assert!(!outside.is_empty() && outside.iter().all(|at| at.y > below));
}

#[test]
fn a_name_looks_the_same_in_every_chart() {
    let [low, high] = [[sample(0.0, 0.0), sample(1.0, 0.0)], [sample(0.0, 1.0), sample(1.0, 1.0)]];
    let both = [Series { name: "first", points: &low }, Series { name: "second", points: &high }];
    let second = [Series { name: "second", points: &high }];
    let charts = [chart(LINEAR, LINEAR, &both), chart(LINEAR, LINEAR, &second)];
    for layout in [Layout::SideBySide, Layout::Stacked] {
        let (canvas, plots) = Figure { layout, ..figure(&charts) }.drawn().unwrap();
        let areas: Vec<Rectangle> = plots.iter().map(super::plot::Plot::area).collect();
        assert_eq!(areas[0], canvas.map_area());
        assert!(areas[0].intersection(&areas[1]).is_zero_sized());
        assert!(areas.iter().all(|area| canvas.bounding_box().intersection(area) == *area));
        let is_beside = areas[0].top_left.y == areas[1].top_left.y;
        assert_eq!(is_beside, layout == Layout::SideBySide);
        assert_eq!(areas[0].top_left.x == areas[1].top_left.x, !is_beside);
        let count =
            |colour, area: &Rectangle| pixels_of(&canvas, colour).into_iter().filter(|&at| area.contains(at)).count();
        assert!(count(BLUE, &areas[0]) > 500 && count(ORANGE, &areas[0]) > 500);
        assert!(count(BLUE, &areas[1]) == 0 && count(ORANGE, &areas[1]) > 500);
    }
}

#[test]
fn markers_are_told_apart_without_their_colours() {
    let area = Rectangle::new(Point::zero(), Size::new(21, 21));
    let covered: Vec<Vec<bool>> = (0..super::MOST_SERIES)
        .map(|i| {
            let mut canvas = Canvas::new(area.size, area);
            Style::of(Some(i)).draw(&mut canvas, &area, &[], &[[10.5, 10.5]]);
            area.points().map(|at| is_mostly(canvas.pixel(at).unwrap(), Style::of(Some(i)).colour)).collect()
        })
        .collect();
    for (i, one) in covered.iter().enumerate() {
        assert!(one.iter().filter(|&&is_covered| is_covered).count() >= 15, "marker {i}");
        for (j, other) in covered.iter().enumerate().skip(i + 1) {
            let different = one.iter().zip(other).filter(|(a, b)| a != b).count();
            assert!(different >= 15, "markers {i} and {j} differ in {different} pixels");
        }
    }
}

#[test]
fn the_same_figure_is_the_same_file() {
    let points: Vec<Sample> =
        (1..500_u32).map(|i| Sample { x: f64::from(i), y: f64::from(i).sqrt(), error: Some(0.1) }).collect();
    let encode = || {
        let mut bytes = Vec::new();
        drawn(LOGARITHMIC, LINEAR, &points).unwrap().encode_png(&mut bytes).unwrap();
        bytes
    };
    assert_eq!(encode(), encode());
}

#[test]
fn odd_values_make_sensible_pictures() {
    let huge = [sample(-1e100, 1e100), sample(1e100, 1e-100)];
    let lone = [Sample { x: 3.0, y: 0.0, error: Some(0.0) }];
    let flat = [sample(0.0, 0.7), sample(0.0, 0.7), sample(0.0, 0.7)];
    let hardly = [sample(1e9, 1.0), sample(1e9 + 1e-6, 1.0 + f64::EPSILON)];
    for (points, name) in [(&huge[..], "huge"), (&lone, "lone"), (&flat, "flat"), (&hardly, "hardly")] {
        let canvas = drawn(LINEAR, LINEAR, points).unwrap();
        let area = canvas.map_area();
        assert!(pixels_of(&canvas, BLUE).into_iter().any(|at| area.contains(at)), "{name}");
    }
    assert!(drawn(LINEAR, LOGARITHMIC, &huge).is_ok());
    // One value stands in the middle.
    assert_eq!(colour_at(&drawn(LINEAR, LOGARITHMIC, &flat).unwrap(), 0.5, 0.5), BLUE);
    assert_eq!(colour_at(&drawn(LINEAR, LINEAR, &flat).unwrap(), 0.5, 0.5), BLUE);
    // A series without points is in the legend all the same.
    let series = [Series { name: "none", points: &[] }, Series { name: "some", points: &flat }];
    let canvas = figure(&[chart(LINEAR, LINEAR, &series)]).render().unwrap();
    assert!(!pixels_of(&canvas, BLUE).is_empty());
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let fine = sample(1.0, 1.0);
    let bar = |error| Sample { x: 1.0, y: 1.0, error: Some(error) };
    let nan = f64::NAN;
    for bad in [sample(nan, 1.0), sample(1.0, f64::INFINITY), sample(1e101, 1.0), bar(nan), bar(-1.0), bar(1e300)] {
        let error = drawn(LINEAR, LINEAR, &[fine, bad]).unwrap_err();
        assert!(matches!(error, ChartError::Sample { index: 1, .. }), "{error}");
    }
    for (x, y, bad) in [
        (LOGARITHMIC, LINEAR, sample(0.0, 1.0)),
        (LINEAR, LOGARITHMIC, sample(1.0, -1.0)),
        (LINEAR, LOGARITHMIC, sample(1.0, 1e-300)),
    ] {
        let error = drawn(x, y, &[fine, bad]).unwrap_err();
        assert!(matches!(error, ChartError::NotPositive { index: 1, .. }), "{error}");
    }
    assert_eq!(drawn(LINEAR, LINEAR, &[]), Err(ChartError::NoPoints { chart: "chart".to_owned() }));
    assert_eq!(figure(&[]).render(), Err(ChartError::NoCharts));
    let series = ["1", "2", "3", "4", "5", "6", "7", "8", "9"].map(|name| Series { name, points: &[] });
    let error = figure(&[chart(LINEAR, LINEAR, &series)]).render();
    assert_eq!(error, Err(ChartError::TooManySeries { count: 9 }));
}

#[test]
fn long_and_strange_texts_fit() {
    let points = [sample(0.0, 0.0), Sample { x: 1.0, y: 1.0, error: Some(0.5) }];
    let plain = drawn(LINEAR, LINEAR, &points).unwrap();
    for text in ["", "x".repeat(1000).as_str(), "two\nlines\tand \u{1f916} \u{e9}"] {
        let axis = Axis { label: text, ..LINEAR };
        let series = [Series { name: text, points: &points }];
        let charts = [Chart { title: text, x: axis, y: axis, series: &series }];
        let canvas = Figure { title: text, bars: text, ..figure(&charts) }.render().unwrap();
        assert_eq!(canvas.size().width, plain.size().width);
        let area = plain.map_area();
        assert!(area.points().all(|at| canvas.pixel(at) == plain.pixel(at)), "{text:?}");
    }
}
