use embedded_graphics::{prelude::*, primitives::Rectangle};

use super::colour::INK;
use super::{Bounds, Canvas, ColourMap, Field, FieldPicture, NOT_A_NUMBER, PATH, PictureError, Rgb888};

const WHITE: Rgb888 = Rgb888::WHITE;
pub(super) const BLACK: Rgb888 = Rgb888::new(12, 14, 20);
const UNKNOWN: Rgb888 = Rgb888::new(144, 168, 194);

/// 8 × 4 m at 100 pixels per metre, wide enough that the footer does not set the width.
pub(super) const PICTURE: FieldPicture<'_> = FieldPicture {
    bounds_m: Bounds { min: [-2.0, -1.0], max: [6.0, 3.0] },
    pixels_per_metre: Some(100.0),
    title: "test",
    field: Field::PROBABILITY,
    overlays: &[],
    path_m: &[],
};

/// The pixel of [`PICTURE`] that contains a point of the plane.
pub(super) fn pixel_at(canvas: &Canvas, x_m: f32, y_m: f32) -> Rgb888 {
    let corner = canvas.map_area().top_left;
    let column = ((x_m + 2.0) * 100.0).floor() as i32;
    let row = ((3.0 - y_m) * 100.0).floor() as i32;
    canvas.pixel(corner + Point::new(column, row)).unwrap()
}

#[test]
fn y_points_up_and_x_right() {
    let canvas = PICTURE.render(|x, y| if x > 2.0 && y > 1.0 { 1.0 } else { 0.0 }).unwrap();
    assert_eq!(canvas.map_area().size, Size::new(800, 400));
    assert_eq!(pixel_at(&canvas, 5.0, 2.0), BLACK);
    assert_eq!(pixel_at(&canvas, 5.0, 0.0), WHITE);
    assert_eq!(pixel_at(&canvas, -1.0, 2.0), WHITE);
    // The border is where it belongs, to the pixel.
    assert_eq!([pixel_at(&canvas, 1.995, 1.005), pixel_at(&canvas, 2.005, 1.005)], [WHITE, BLACK]);
    assert_eq!([pixel_at(&canvas, 2.005, 0.995), pixel_at(&canvas, 2.005, 1.005)], [WHITE, BLACK]);
}

#[test]
fn the_map_fills_its_area_and_is_framed() {
    let canvas = PICTURE.render(|_, _| 0.5).unwrap();
    let map = canvas.map_area();
    assert!(map.points().all(|at| canvas.pixel(at) == Some(UNKNOWN)));
    let framed = map.offset(1);
    let mut frame = framed.points().filter(|&at| !map.contains(at));
    assert!(frame.all(|at| canvas.pixel(at) == Some(INK)));
}

#[test]
fn values_are_asked_for_at_the_centres_of_the_pixels() {
    let mut points = Vec::new();
    let _ = PICTURE.render(|x, y| {
        points.push([x, y]);
        0.5
    });
    assert_eq!(points.len(), 800 * 400);
    // Coordinates up to 6 in f32.
    let is_near = |found: [f32; 2], x: f32, y: f32| (found[0] - x).abs() < 1e-6 && (found[1] - y).abs() < 1e-6;
    assert!(is_near(points[0], -1.995, 2.995));
    assert!(is_near(points[799], 5.995, 2.995));
    assert!(is_near(points[799 * 400 + 399], 5.995, -0.995));
}

#[test]
fn known_values_have_known_colours() {
    let probability = Field::PROBABILITY;
    assert_eq!([0.0, 0.5, 1.0].map(|p| probability.colour(p)), [WHITE, UNKNOWN, BLACK]);
    assert_eq!([-1.0, f32::NEG_INFINITY, 7.0].map(|p| probability.colour(p)), [WHITE, WHITE, BLACK]);
    assert_eq!(probability.colour(f32::NAN), NOT_A_NUMBER);
    let deviation = Field::standard_deviation(4.0);
    assert_eq!(deviation.colour(0.0), Rgb888::new(68, 1, 84));
    assert_eq!(deviation.colour(4.0), Rgb888::new(253, 231, 37));
    // Viridis at 128 of 255 is (33, 145, 140); straight lines between every 17th colour miss it by less than 2.
    let middle = deviation.colour(4.0 * 128.0 / 255.0);
    for (found, published) in [(middle.r(), 33), (middle.g(), 145), (middle.b(), 140)] {
        assert!(found.abs_diff(published) < 2, "{middle:?}");
    }
}

#[test]
fn lightness_never_turns_back() {
    /// CIE L* of an sRGB colour, 0 (black) to 100 (white).
    fn lightness(colour: Rgb888) -> f64 {
        let linear = |channel: u8| {
            let c = f64::from(channel) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let y = 0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b());
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }
    let along = |map: &ColourMap| (0_u8..=100).map(|i| lightness(map.at(f32::from(i) / 100.0))).collect::<Vec<_>>();
    let occupancy = along(&ColourMap::OCCUPANCY);
    assert!(occupancy.is_sorted_by(|a, b| a > b));
    // Unknown is at least a quarter of the scale away from free and from occupied.
    assert!(occupancy[0] - occupancy[50] > 25.0 && occupancy[50] - occupancy[100] > 25.0);
    assert!(along(&ColourMap::VIRIDIS).is_sorted_by(|a, b| a < b));
}

#[test]
fn the_scale_bar_is_as_long_as_it_says() {
    // 200 pixels at most: 2 m at 100 pixels per metre, 1 m (not 1.8 m) at 110.
    for (scale, bar_px) in [(100.0, 200), (110.0, 110)] {
        let canvas = FieldPicture { pixels_per_metre: Some(scale), ..PICTURE }.render(|_, _| 0.5).unwrap();
        let Point { x: left, y: top } = canvas.map_area().top_left;
        let below = top + canvas.map_area().size.height as i32 + 60;
        let ink_from_left = |row: i32| (left..).take_while(|&x| canvas.pixel(Point::new(x, row)) == Some(INK)).count();
        let longest = (below..canvas.size().height as i32).map(ink_from_left).max();
        assert_eq!(longest, Some(bar_px));
    }
}

#[test]
fn nan_is_drawn_and_explained() {
    let count = |canvas: &Canvas| {
        let pixels = canvas.bounding_box().points();
        pixels.filter(|&at| canvas.pixel(at) == Some(NOT_A_NUMBER)).count()
    };
    assert_eq!(count(&PICTURE.render(|_, _| 0.5).unwrap()), 0);
    let canvas = PICTURE.render(|x, y| if x < -1.9 && y < -0.9 { f32::NAN } else { 0.5 }).unwrap();
    assert_eq!(pixel_at(&canvas, -1.95, -0.95), NOT_A_NUMBER);
    assert!(count(&canvas) > 10 * 10, "the key beside the colour bar is missing");
}

#[test]
fn the_path_is_where_the_robot_was() {
    let path_m = [[-1.0, 0.0], [5.0, 0.0], [5.0, 2.0]];
    let canvas = FieldPicture { path_m: &path_m, ..PICTURE }.render(|_, _| 1.0).unwrap();
    for on_the_path in [[0.0, 0.0], [3.0, -0.005], [5.0, 1.0], [4.995, 0.5], [5.0, 2.0]] {
        assert_eq!(pixel_at(&canvas, on_the_path[0], on_the_path[1]), PATH, "{on_the_path:?}");
    }
    // The start is an open ring, and five pixels beside the line the map is untouched.
    assert_eq!(pixel_at(&canvas, -1.0, 0.0), WHITE);
    assert_eq!(pixel_at(&canvas, -1.065, -0.005), PATH);
    assert_eq!(pixel_at(&canvas, 2.0, 0.05), BLACK);
    assert_eq!(pixel_at(&canvas, 2.0, -0.05), BLACK);
}

#[test]
fn a_path_out_of_the_picture_stays_inside_the_map() {
    let far = f32::MAX;
    let path_m = [[-far, -far], [far, far], [1e9, 1.0], [-1e9, 1.0], [1.0, -1e9], [1.0, 1e9]];
    let canvas = FieldPicture { path_m: &path_m, ..PICTURE }.render(|_, _| 1.0).unwrap();
    assert_eq!(pixel_at(&canvas, 4.0, 1.0), PATH);
    let map = canvas.map_area();
    let rows_above = Rectangle::new(Point::zero(), Size::new(canvas.size().width, map.top_left.y as u32));
    assert!(rows_above.points().all(|at| canvas.pixel(at) != Some(PATH)));
}

#[test]
fn png_decodes_to_what_was_drawn() {
    let canvas = PICTURE.render(|x, y| (x * y).sin()).unwrap();
    let mut bytes = Vec::new();
    canvas.encode_png(&mut bytes).unwrap();
    let mut again = Vec::new();
    PICTURE.render(|x, y| (x * y).sin()).unwrap().encode_png(&mut again).unwrap();
    assert_eq!(bytes, again);

    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut decoded).unwrap();
    assert_eq!(Size::new(info.width, info.height), canvas.size());
    for (at, rgb) in canvas.bounding_box().points().zip(decoded.chunks(3)) {
        assert_eq!(canvas.pixel(at), Some(Rgb888::new(rgb[0], rgb[1], rgb[2])));
    }
}

#[test]
fn automatic_scale_and_odd_shapes() {
    for (width_m, height_m) in [(600.0, 300.0), (5.0, 5.0), (600.0, 8.0), (8.0, 600.0), (0.001, 0.001), (1e7, 1e7)] {
        let bounds_m = Bounds { min: [0.0, 0.0], max: [width_m, height_m] };
        let picture = FieldPicture { bounds_m, pixels_per_metre: None, path_m: &[[0.0, 0.0]], ..PICTURE };
        let map = picture.render(|_, _| 0.0).unwrap().map_area();
        assert_eq!(map.size.width.max(map.size.height), 1200);
        let ratio = f64::from(map.size.width) / f64::from(map.size.height);
        // Half a pixel of the shorter side, 16 pixels, is 3 %.
        assert!((ratio / f64::from(width_m / height_m) - 1.0).abs() < 0.04);
    }
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let error = |picture: FieldPicture<'_>| picture.render(|_, _| panic!("asked for a value")).unwrap_err();
    let corners = [([0.0, 0.0], [f32::NAN, 1.0]), ([0.0, 0.0], [1.0, f32::INFINITY]), ([0.0, 0.0], [0.0, 1.0])];
    for (min, max) in corners.into_iter().chain([([3.0, 0.0], [1.0, 1.0]), ([2e7, 0.0], [3e7, 1e6])]) {
        let bounds_m = Bounds { min, max };
        assert!(matches!(error(FieldPicture { bounds_m, ..PICTURE }), PictureError::Bounds(_)), "{bounds_m:?}");
    }
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let picture = FieldPicture { pixels_per_metre: Some(scale), ..PICTURE };
        assert!(matches!(error(picture), PictureError::Scale(_)), "{scale}");
    }
    let huge = FieldPicture { pixels_per_metre: Some(1e6), ..PICTURE };
    assert_eq!(error(huge), PictureError::Size { width_px: 8e6, height_px: 4e6 });
    let line = Bounds { min: [0.0, 0.0], max: [600.0, 0.1] };
    let thin = FieldPicture { bounds_m: line, pixels_per_metre: None, ..PICTURE };
    assert!(matches!(error(thin), PictureError::Size { width_px: 1200.0, .. }));
    for max in [0.0, -1.0, f32::NAN, 1e30] {
        let picture = FieldPicture { field: Field::standard_deviation(max), ..PICTURE };
        assert!(matches!(error(picture), PictureError::Range(_)), "{max}");
    }
    let lost = FieldPicture { path_m: &[[0.0, 0.0], [f32::NAN, 0.0]], ..PICTURE };
    assert_eq!(error(lost), PictureError::Path { index: 1 });
}

#[test]
fn long_and_strange_titles_fit() {
    let plain = PICTURE.render(|_, _| 0.0).unwrap();
    for title in ["", "x".repeat(1000).as_str(), "two\nlines\tand \u{1f916} \u{e9}"] {
        let canvas = FieldPicture { title, ..PICTURE }.render(|_, _| 0.0).unwrap();
        assert_eq!(canvas.size(), plain.size());
        let from_map_on = plain.map_area().top_left.y - 10;
        let rest = Rectangle::new(Point::new(0, from_map_on), canvas.size());
        assert!(rest.points().all(|at| canvas.pixel(at) == plain.pixel(at)), "{title:?}");
    }
}
