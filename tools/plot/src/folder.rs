//! Folders of pictures and text.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_core::{geometry::Point, map::Occupancy};

use crate::{
    chart::Figure,
    picture::{Bounds, Canvas, Field, FieldPicture, Overlay},
};

/// A folder that is filled file by file.
pub struct PictureFolder {
    folder: PathBuf,
    /// What was written, in order.
    pub files: Vec<PathBuf>,
}

impl PictureFolder {
    /// Makes the folder if need be: at once, before anything is learned in vain.
    pub fn into(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(Self { folder: folder.to_owned(), files: Vec::new() })
    }

    /// Charts.
    pub fn figure(&mut self, name: &str, figure: &Figure<'_>) -> anyhow::Result<()> {
        self.canvas(name, &figure.render()?)
    }

    /// The probability of occupancy, with shapes over it.
    pub fn map(
        &mut self,
        name: &str,
        title: &str,
        bounds_m: Bounds,
        overlays: &[Overlay<'_>],
        occupancy: impl Fn(&Point<2>) -> Occupancy,
    ) -> anyhow::Result<()> {
        let field = Field::PROBABILITY;
        let picture = FieldPicture { bounds_m, pixels_per_metre: None, title, field, overlays, path_m: &[] };
        let canvas = picture.render(|x, y| occupancy(&Point::<2>::new(x, y)).probability)?;
        self.canvas(name, &canvas)
    }

    /// A file of text.
    pub fn text(&mut self, name: &str, text: &str) -> anyhow::Result<()> {
        self.write(name, |file| fs::write(file, text))
    }

    /// A picture.
    pub fn canvas(&mut self, name: &str, canvas: &Canvas) -> anyhow::Result<()> {
        self.write(name, |file| canvas.write_png(file))
    }

    fn write(&mut self, name: &str, write: impl FnOnce(&Path) -> io::Result<()>) -> anyhow::Result<()> {
        let file = self.folder.join(name);
        write(&file).with_context(|| format!("cannot write {}", file.display()))?;
        self.files.push(file);
        Ok(())
    }
}

/// The names of files in a line each.
#[must_use]
pub fn list(files: &[PathBuf]) -> String {
    files.iter().map(|file| format!("written  {}\n", file.display())).collect()
}
