use embedded_graphics::{prelude::*, primitives::Rectangle};

use super::tests::{BLACK, PICTURE, pixel_at};
use super::{Bounds, Canvas, FieldPicture, Overlay, PictureError, Rgb888, Shape};

const RED: Rgb888 = Rgb888::new(220, 0, 0);

fn drawn(shapes: &[Shape]) -> Canvas {
    let overlays = [Overlay { legend: "supports", colour: RED, shapes }];
    FieldPicture { overlays: &overlays, ..PICTURE }.render(|_, _| 1.0).unwrap()
}

/// The centres, in metres, of all pixels of the map of [`PICTURE`] that a shape touched, and how much.
fn touched(canvas: &Canvas) -> Vec<([f64; 2], f64)> {
    let map = canvas.map_area();
    let redness = |at| f64::from(canvas.pixel(at).unwrap().r() - BLACK.r()) / f64::from(RED.r() - BLACK.r());
    let centre_m = |at: Point| {
        let from_corner = at - map.top_left;
        [(f64::from(from_corner.x) + 0.5) / 100.0 - 2.0, 3.0 - (f64::from(from_corner.y) + 0.5) / 100.0]
    };
    map.points().filter(|&at| canvas.pixel(at) != Some(BLACK)).map(|at| (centre_m(at), redness(at))).collect()
}

#[test]
fn an_ellipse_is_where_its_quadratic_form_says() {
    // Correlated, long and thin, a circle, and with a reach of 2 sigmas.
    for (covariance_m2, sigmas) in
        [([0.5, 0.3, 0.4], 1.0), ([1.2, 0.0, 0.01], 1.0), ([0.25, 0.0, 0.25], 2.0), ([0.3, -0.25, 0.4], 1.5)]
    {
        let [a, b] = [2.0, 1.0];
        let canvas = drawn(&[Shape::Ellipse { centre_m: [2.0, 1.0], covariance_m2, sigmas }]);
        let [xx, xy, yy] = covariance_m2.map(f64::from);
        let determinant = xx * yy - xy * xy;
        // Mahalanobis distance and, by its gradient, the distance from the ellipse in metres, to first order.
        let distance_m = |[x, y]: [f64; 2]| {
            let [dx, dy] = [x - a, y - b];
            let gradient = [(yy * dx - xy * dy) / determinant, (xx * dy - xy * dx) / determinant];
            let mahalanobis = (dx * gradient[0] + dy * gradient[1]).sqrt();
            (mahalanobis - f64::from(sigmas)).abs() * mahalanobis / gradient[0].hypot(gradient[1])
        };
        let touched = touched(&canvas);
        // 0.6 pixels of line, half a pixel of soft edge, and what the first order misses where the thin one bends.
        let farthest = touched.iter().map(|&(at, _)| distance_m(at)).fold(0.0, f64::max);
        assert!(farthest < 0.025, "{farthest} m of {covariance_m2:?}");
        // And nothing of it is missing: what is nearer than a pixel's third is painted nearly in full.
        let map = canvas.map_area();
        let on_it = map.points().filter(|&at| {
            let from_corner = at - map.top_left;
            let centre =
                [(f64::from(from_corner.x) + 0.5) / 100.0 - 2.0, 3.0 - (f64::from(from_corner.y) + 0.5) / 100.0];
            distance_m(centre) < 0.003
        });
        let near: Vec<Point> = on_it.collect();
        assert!(near.len() > 100);
        assert!(near.iter().all(|&at| canvas.pixel(at).unwrap().r() > RED.r() / 2), "{covariance_m2:?}");
    }
}

#[test]
fn rectangles_crosses_and_segments_are_where_they_should_be() {
    let canvas = drawn(&[Shape::Rectangle { centre_m: [2.005, 1.005], sides_m: [2.0, 1.0] }]);
    for on_it in [[1.005, 1.0], [3.005, 1.3], [2.0, 0.505], [2.0, 1.505], [1.005, 0.505], [3.005, 1.505]] {
        assert_eq!(pixel_at(&canvas, on_it[0], on_it[1]), RED, "{on_it:?}");
    }
    assert_eq!(pixel_at(&canvas, 2.0, 1.0), BLACK);
    // Two sides of 200 and two of 100 pixels, their edges one pixel and a tenth to each side.
    let painted: f64 = touched(&canvas).iter().map(|&(_, redness)| redness).sum();
    assert!((600.0..=600.0 * 1.3).contains(&painted), "{painted}");

    let canvas = drawn(&[Shape::Segment { from_m: [-1.0, 0.005], to_m: [5.0, 0.005] }]);
    for x_m in [-0.995, 2.0, 4.995] {
        assert_eq!(pixel_at(&canvas, x_m, 0.005), RED);
    }
    assert_eq!([-1.025, 5.025].map(|x_m| pixel_at(&canvas, x_m, 0.005)), [BLACK; 2]);

    let canvas = drawn(&[Shape::Point { at_m: [2.005, 1.005] }]);
    for (dx, dy) in [(0.0, 0.0), (0.03, 0.03), (0.03, -0.03), (-0.03, 0.03), (-0.03, -0.03)] {
        assert_eq!(pixel_at(&canvas, 2.005 + dx, 1.005 + dy), RED);
    }
    assert!(touched(&canvas).iter().all(|([x, y], _)| (x - 2.005).abs() < 0.06 && (y - 1.005).abs() < 0.06));
}

#[test]
fn shapes_out_of_the_picture_stay_inside_the_map() {
    let far = f32::MAX;
    let shapes = [
        Shape::Ellipse { centre_m: [2.0, 1.0], covariance_m2: [far, 0.0, far], sigmas: far },
        Shape::Ellipse { centre_m: [6.0, 3.0], covariance_m2: [1.0, 0.0, 1.0], sigmas: 1.0 },
        Shape::Rectangle { centre_m: [2.0, 1.0], sides_m: [8.4, 4.4] },
        Shape::Rectangle { centre_m: [far, far], sides_m: [far, far] },
        Shape::Segment { from_m: [-far, 1.005], to_m: [far, 1.005] },
        Shape::Point { at_m: [-2.0, -1.0] },
    ];
    let canvas = drawn(&shapes);
    let map = canvas.map_area();
    let legend_top = map.top_left.y + map.size.height as i32 + 60;
    let is_around = |at: &Point| !map.contains(*at) && at.y < legend_top;
    let is_red = |at: Point| canvas.pixel(at).is_some_and(|c| i16::from(c.r()) > i16::from(c.g()) + 40);
    assert!(!canvas.bounding_box().points().filter(is_around).any(is_red));
    assert_eq!(pixel_at(&canvas, 2.0, 1.005), RED);
    // The quarter of the circle around the upper right corner: it passes one metre to the left of it and below.
    assert!(is_red(map.top_left + Point::new(700, 0)) || is_red(map.top_left + Point::new(699, 0)));
    assert!(touched(&canvas).iter().all(|&([x, y], _)| x > -2.0 && x < 6.0 && y > -1.0 && y < 3.0));
}

#[test]
fn a_legend_explains_what_there_is() {
    let plain = PICTURE.render(|_, _| 1.0).unwrap();
    let unused = [Overlay { legend: "nothing", colour: RED, shapes: &[] }];
    assert_eq!(FieldPicture { overlays: &unused, ..PICTURE }.render(|_, _| 1.0).unwrap(), plain);

    // Out of sight on the map, in the legend nevertheless.
    let canvas = drawn(&[Shape::Segment { from_m: [50.0, 50.0], to_m: [60.0, 50.0] }]);
    assert!(touched(&canvas).is_empty());
    let map = canvas.map_area();
    let below = Rectangle::new(Point::new(0, map.top_left.y + map.size.height as i32), canvas.size());
    assert!(below.points().any(|at| canvas.pixel(at) == Some(RED)), "the key is missing");

    let long = "x".repeat(1000);
    let shapes = [Shape::Point { at_m: [0.0, 0.0] }];
    let overlays = [Overlay { legend: &long, colour: RED, shapes: &shapes }; 2];
    let canvas = FieldPicture { overlays: &overlays, ..PICTURE }.render(|_, _| 1.0).unwrap();
    assert!(canvas.size().width < 2 * plain.size().width);
}

#[test]
fn thousands_of_ellipses_leave_the_field_visible_and_are_drawn_the_same_again() {
    let shapes: Vec<Shape> = (0_u8..=99)
        .flat_map(|row| (0_u8..=99).map(move |column| (row, column)))
        .map(|(row, column)| Shape::Ellipse {
            centre_m: [f32::from(column) * 0.08 - 1.96, f32::from(row) * 0.04 - 0.98],
            covariance_m2: [4e-4, 0.0, 1e-4],
            sigmas: 1.0,
        })
        .collect();
    let canvas = drawn(&shapes);
    assert_eq!(canvas, drawn(&shapes));
    // Circumference by Ramanujan of semi-axes 2 and 1 pixels: 9.7 pixels of 32 that each ellipse has.
    let map = canvas.map_area();
    let share =
        touched(&canvas).iter().map(|&(_, redness)| redness).sum::<f64>() / (map.size.width * map.size.height) as f64;
    assert!((0.25..0.45).contains(&share), "{share}");
}

#[test]
fn what_is_no_shape_is_an_error() {
    let ellipse = |covariance_m2, sigmas| Shape::Ellipse { centre_m: [0.0, 0.0], covariance_m2, sigmas };
    let fine = Shape::Point { at_m: [0.0, 0.0] };
    for bad in [
        ellipse([1.0, 2.0, 1.0], 1.0),
        ellipse([-1.0, 0.0, 1.0], 1.0),
        ellipse([1.0, 0.1, 0.0], 1.0),
        ellipse([1.0, f32::NAN, 1.0], 1.0),
        ellipse([1.0, 0.0, 1.0], -1.0),
        Shape::Ellipse { centre_m: [f32::NAN, 0.0], covariance_m2: [1.0, 0.0, 1.0], sigmas: 1.0 },
        Shape::Rectangle { centre_m: [0.0, 0.0], sides_m: [1.0, -1.0] },
        Shape::Point { at_m: [f32::INFINITY, 0.0] },
        Shape::Segment { from_m: [0.0, 0.0], to_m: [0.0, f32::NAN] },
    ] {
        let shapes = [fine, bad];
        let overlays =
            [Overlay { legend: "", colour: RED, shapes: &[] }, Overlay { legend: "", colour: RED, shapes: &shapes }];
        let picture = FieldPicture { overlays: &overlays, ..PICTURE };
        assert_eq!(picture.render(|_, _| panic!()), Err(PictureError::Shape { overlay: 1, index: 1 }), "{bad:?}");
    }
}

#[test]
fn flat_shapes_are_lines_and_dots() {
    // Along the diagonal, along y, a point.
    for (covariance_m2, end) in [([1.0, 1.0, 1.0], [1.0, 1.0]), ([0.0, 0.0, 1.0], [0.0, 1.0]), ([0.0; 3], [0.0, 0.0])] {
        let canvas = drawn(&[Shape::Ellipse { centre_m: [1.005, 1.005], covariance_m2, sigmas: 1.0 }]);
        assert_eq!(pixel_at(&canvas, 1.005, 1.005), RED);
        assert_eq!(pixel_at(&canvas, 1.005 + 0.98 * end[0], 1.005 + 0.98 * end[1]), RED);
        let off_the_line = |&([x, y], _): &([f64; 2], f64)| {
            ((x - 1.005) * f64::from(end[1]) - (y - 1.005) * f64::from(end[0])).abs() > 0.025
        };
        assert!(!touched(&canvas).iter().any(off_the_line));
    }
    // A map as large as a point is resolved in f32: nothing divides by zero.
    let bounds_m = Bounds { min: [0.0, 0.0], max: [0.001, 0.001] };
    let shapes = [Shape::Rectangle { centre_m: [0.0, 0.0], sides_m: [0.0, 0.0] }];
    let overlays = [Overlay { legend: "dot", colour: RED, shapes: &shapes }];
    assert!(
        FieldPicture { bounds_m, pixels_per_metre: None, overlays: &overlays, ..PICTURE }.render(|_, _| 0.0).is_ok()
    );
}
