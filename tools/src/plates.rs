//! Folders of pictures and text that commands write.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_core::geometry::Point;
use bhm_host::map::AnyMap;
use bhm_tools::{
    chart::Figure,
    picture::{Bounds, Canvas, Field, FieldPicture, Overlay},
};

use crate::output::Usage;

/// A folder that is filled file by file.
pub(crate) struct Plates<'a> {
    folder: &'a Path,
    /// What was written, in order.
    pub(crate) files: Vec<PathBuf>,
}

impl<'a> Plates<'a> {
    /// Makes the folder if need be: at once, before anything is learned in vain.
    pub(crate) fn into(folder: &'a Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(Self { folder, files: Vec::new() })
    }

    /// Charts.
    pub(crate) fn figure(&mut self, name: &str, figure: &Figure<'_>) -> anyhow::Result<()> {
        self.canvas(name, &figure.render()?)
    }

    /// The probability of occupancy, with shapes over it.
    pub(crate) fn map(
        &mut self,
        name: &str,
        title: &str,
        bounds_m: Bounds,
        overlays: &[Overlay<'_>],
        map: &dyn AnyMap,
    ) -> anyhow::Result<()> {
        let field = Field::PROBABILITY;
        let picture = FieldPicture { bounds_m, pixels_per_metre: None, title, field, overlays, path_m: &[] };
        let canvas = picture
            .render(|x, y| map.occupancy(&Point::<2>::new(x, y)).probability)
            .map_err(|error| Usage(error.to_string()))?;
        self.canvas(name, &canvas)
    }

    /// A file of text.
    pub(crate) fn text(&mut self, name: &str, text: &str) -> anyhow::Result<()> {
        let file = self.folder.join(name);
        fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))?;
        self.files.push(file);
        Ok(())
    }

    /// A picture.
    pub(crate) fn canvas(&mut self, name: &str, canvas: &Canvas) -> anyhow::Result<()> {
        let file = self.folder.join(name);
        canvas.write_png(&file).with_context(|| format!("cannot write {}", file.display()))?;
        self.files.push(file);
        Ok(())
    }

    /// The names of the files in a line each.
    pub(crate) fn list(&self) -> String {
        self.files.iter().map(|file| format!("written  {}\n", file.display())).collect()
    }
}
