use std::path::{Path, PathBuf};

use bhm_plot::{
    chart::{Chart, Figure, Layout},
    folder::PictureFolder,
    picture::Canvas,
};

use crate::text::markdown;

/// The one page of a report, in Markdown, and the pictures beside it.
pub(super) struct Page {
    pictures: PictureFolder,
    text: String,
}

impl Page {
    /// Makes the folder at once, before anything is measured in vain.
    pub(super) fn into(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self { pictures: PictureFolder::into(folder)?, text: String::new() })
    }

    /// What the page is.
    pub(super) fn heading(&mut self, has_log: bool, quick: bool, every: &[usize; 2], deadlines_s: &[f64; 2]) {
        self.text("# Building Continuous Occupancy Maps with Moving Robots, reproduced\n");
        self.text(&format!(
            "Every system that the paper (Senanayake and Ramos, AAAI 2018) compares, on its three datasets, with its protocol \
             and harder ones, by bhm {}. Datasets 1 (a stationary lidar of 180° and 80 m among moving vehicles) and 2 (a site \
             of 600 × 300 m, a moving robot with a lidar of 60 m) are not public: they are simulated here, seeded, after the \
             paper's description. Dataset 3 is the log of the Intel Research Lab{}.\n",
            env!("CARGO_PKG_VERSION"),
            if has_log { "" } else { ", which was not given: it is missing below" }
        ));
        self.text(&format!(
            "One scan in {} of datasets 1 and 2 is used, which overlap much, and one in {} of dataset 3. A contestant may learn for \
             {} s of processor time on a task of datasets 1 and 2, {} s of dataset 3.\n",
            every[0], every[1], deadlines_s[0], deadlines_s[1]
        ));
        if quick {
            self.text(
                "**This is the quick form**: few scans and short deadlines. It shows that everything runs; its figures are \
                 not to be quoted.\n",
            );
        }
        self.text(
            "How to read it: *points* held out is the paper's protocol (10 % of randomly chosen points); whole *beams* and \
             whole *scans* are harder, since neighbours of a held-out point on the same beam are not learned either. Every \
             contestant is shown the same beams, or the same points sampled from them. Lengths after a name are those for a \
             building; on datasets 1 and 2 everything is twice as coarse. Times are those of the processor, for one update with \
             one scan, on one thread; *growth* is the median time of the last quarter of the run relative to the first. A \
             contestant that reached its deadline is scored only on what it had seen, and has no rank.\n",
        );
    }

    pub(super) fn text(&mut self, text: &str) {
        self.text += text;
        self.text.push('\n');
    }

    pub(super) fn section(&mut self, title: &str) {
        self.text(&format!("## {title}\n"));
    }

    pub(super) fn table(&mut self, rows: &[Vec<String>]) {
        let table = markdown(rows);
        self.text(&table);
    }

    /// Charts, with what they show.
    pub(super) fn figure(&mut self, file: &str, figure: &Figure<'_>) -> anyhow::Result<()> {
        let canvas = figure.render()?;
        self.canvas(file, figure.title, &canvas)
    }

    /// One chart.
    pub(super) fn chart(&mut self, file: &str, title: &str, chart: Chart<'_>) -> anyhow::Result<()> {
        self.figure(file, &Figure { title, bars: "", layout: Layout::SideBySide, charts: &[chart] })
    }

    pub(super) fn canvas(&mut self, file: &str, title: &str, canvas: &Canvas) -> anyhow::Result<()> {
        self.pictures.canvas(file, canvas)?;
        self.text(&format!("![{title}]({file})\n"));
        Ok(())
    }

    /// Writes it; the page, and its pictures.
    pub(super) fn finish(mut self) -> anyhow::Result<(PathBuf, Vec<PathBuf>)> {
        self.pictures.text("report.md", &self.text)?;
        let mut files = self.pictures.files;
        Ok((files.pop().unwrap_or_default(), files))
    }
}
