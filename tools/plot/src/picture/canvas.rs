//! A picture in memory.

use std::{convert::Infallible, fs, io, path::Path};

use embedded_graphics::{
    pixelcolor::{Rgb888, raw::ToBytes},
    prelude::*,
    primitives::Rectangle,
};

use super::colour::{self, BACKGROUND};

/// A finished picture, or one being drawn: `embedded-graphics` can draw on it too.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    size: Size,
    map_area: Rectangle,
    pixels: Vec<Rgb888>,
}

impl Canvas {
    pub(crate) fn new(size: Size, map_area: Rectangle) -> Self {
        Self { size, map_area, pixels: vec![BACKGROUND; size.width as usize * size.height as usize] }
    }

    /// The pixels that show the map: from edge to edge its bounds, without the frame around them. In a
    /// [figure](crate::chart::Figure) the first chart's.
    #[must_use]
    pub fn map_area(&self) -> Rectangle {
        self.map_area
    }

    /// The colour of a pixel, counted from the top left; `None` outside of the picture.
    #[must_use]
    pub fn pixel(&self, at: Point) -> Option<Rgb888> {
        self.index(at).map(|index| self.pixels[index])
    }

    /// Writes the picture as PNG (8 bits per channel, RGB).
    ///
    /// # Errors
    /// If `to` cannot be written to.
    pub fn encode_png(&self, to: impl io::Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(to, self.size.width, self.size.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let bytes: Vec<u8> = self.pixels.iter().flat_map(|pixel| pixel.to_be_bytes()).collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&bytes)?;
        writer.finish()?;
        Ok(())
    }

    /// Writes the picture to a PNG file, replacing one that is there.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_png(&self, file: impl AsRef<Path>) -> io::Result<()> {
        let mut bytes = Vec::new();
        self.encode_png(&mut bytes)?;
        fs::write(file, bytes)
    }

    /// Lays `colour` over a pixel; `coverage` 0 leaves the pixel as it is, 1 replaces it.
    pub(super) fn blend(&mut self, at: Point, colour: Rgb888, coverage: f32) {
        if let Some(index) = self.index(at) {
            self.pixels[index] = colour::mix(self.pixels[index], colour, coverage);
        }
    }

    /// Colours an area row by row from its top left.
    pub(super) fn fill(&mut self, area: &Rectangle, colours: impl IntoIterator<Item = Rgb888>) {
        let Ok(()) = self.fill_contiguous(area, colours);
    }

    pub(crate) fn rectangle(&mut self, corner: Point, size: Size, colour: Rgb888) {
        let Ok(()) = self.fill_solid(&Rectangle::new(corner, size), colour);
    }

    fn index(&self, at: Point) -> Option<usize> {
        let inside = Rectangle::new(Point::zero(), self.size).contains(at);
        inside.then(|| at.y as usize * self.size.width as usize + at.x as usize)
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        self.size
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            if let Some(index) = self.index(at) {
                self.pixels[index] = colour;
            }
        }
        Ok(())
    }
}
