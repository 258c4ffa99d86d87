//! Pictures of the study: grey, 0 to 255, from PNG files.

use std::path::Path;

/// A picture in floating point.
pub struct Picture {
    pub name: String,
    pub width: usize,
    pub height: usize,
    values: Vec<f32>,
}

/// All PNG pictures of a folder, by name.
pub fn read(folder: &Path) -> Vec<Picture> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("a folder can be read to its end").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "png"))
        .collect();
    files.sort();
    files.iter().map(|file| one(file)).collect()
}

fn one(file: &Path) -> Picture {
    let grey = image::open(file).unwrap_or_else(|error| panic!("{}: {error}", file.display())).into_luma8();
    let name = file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let (width, height) = (sensel::num::index(grey.width()), sensel::num::index(grey.height()));
    Picture { name, width, height, values: grey.into_raw().into_iter().map(f32::from).collect() }
}

impl Picture {
    /// The value at a position, between pixels bilinear; none outside.
    pub fn at(&self, x_px: f64, y_px: f64) -> Option<f64> {
        let (left, top) = (x_px.floor(), y_px.floor());
        let inside = |position: f64, side: usize| position >= 0.0 && position + 1.0 < sensel::num::f64_from_usize(side);
        if !inside(left, self.width) || !inside(top, self.height) {
            return None;
        }
        let index = |position: f64| sensel::num::index(sensel::num::u32_truncated(position));
        let (x, y) = (index(left), index(top));
        let value = |dx: usize, dy: usize| f64::from(self.values[(y + dy) * self.width + x + dx]);
        let (right, down) = (x_px - left, y_px - top);
        let upper = value(0, 0) * (1.0 - right) + value(1, 0) * right;
        let lower = value(0, 1) * (1.0 - right) + value(1, 1) * right;
        Some(upper * (1.0 - down) + lower * down)
    }
}
