//! Photons from pictures: the paper's down-sampling "based on the mapping function of the lens". Computes the mean photons of every pixel
//! from a stream of pictures.
//!
//! The corners of a pixel's area go through the sensor's lens to bearings and through the pictures' camera to a quadrilateral of the
//! picture, whose light is averaged exactly by area, so nothing aliases. Neighbours share their corners: no light is lost or counted twice.
//! A quadrilateral narrower than a pixel of the picture is widened to one, and the mean over a square of one pixel is bilinear
//! interpolation; so both methods agree at the limit. Every row merges the pictures of its span by the seconds that each counts.
//!
//! Corners are exact and edges between them straight, which is off by what a camera states for its bearings; within a quadrilateral the
//! light counts evenly, though the mapping's stretch changes by some thousandths across a pixel.

mod footprint;

use glam::{DVec2, DVec3};

use self::footprint::{Coverage, area, clipped, widened};
use super::bounds;
use super::camera::Camera;
use super::lens::{Lens, Mapping, Radtan};
use super::render::Exposure;
use crate::error::Error;
use crate::num::{f32_nearest, index};
use crate::parallel::over_chunks;
use crate::plane::Plane;
use crate::scene::images::{ImageStream, Picture, PictureCamera};
use crate::scene::light::BANDS;
use crate::units::{Size, Span};

/// The lens of the camera that made pictures.
fn lens_of(camera: &PictureCamera, size: Size) -> Lens {
    let [k1, k2, p1, p2] = camera.distortion;
    let mut lens = Lens::pinhole(size, 1.0);
    let intrinsics = &mut lens.intrinsics;
    (intrinsics.fx_px, intrinsics.fy_px, intrinsics.cx_px, intrinsics.cy_px) =
        (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px);
    lens.mapping = Mapping::Radtan(Radtan { k1, k2, p1, p2, k3: 0.0 });
    lens
}

/// Whether the pictures' camera sees one direction at each position in its pictures. Fails on a focal length or principal point that is not
/// finite; distortion that folds a picture over, by the key.
pub fn check(stream: &ImageStream) -> Result<(), Error> {
    let lens = lens_of(&stream.params.camera, stream.size());
    let (right, bottom) = (f64::from(stream.size().width_px) - 0.5, f64::from(stream.size().height_px) - 0.5);
    for corner in [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)] {
        if lens.unproject(DVec2::new(corner.0, corner.1)).is_none() {
            let reason = "the distortion folds the pictures over; use values nearer to 0";
            return Err(Error::key("scene.images_camera", format!("{:?}", stream.params.camera.distortion), reason));
        }
    }
    Ok(())
}

/// Pixels of a camera as seen by another one.
struct CameraPixels<'a> {
    camera: &'a Camera,
    lens: Lens,
    size: Size,
}

/// Where a pixel lies in the pictures: pixel edges are whole numbers there, from (0, 0) at the top left.
type Quad = [DVec2; 4];

impl<'a> CameraPixels<'a> {
    fn of(stream: &ImageStream, camera: &'a Camera) -> Self {
        Self { camera, lens: lens_of(&stream.params.camera, stream.size()), size: stream.size() }
    }

    fn project(&self, bearing: [f32; 3]) -> Option<DVec2> {
        let position_px = self.lens.project(DVec3::from_array(bearing.map(f64::from)))?;
        Some(position_px + 0.5)
    }

    /// Top left, top right, bottom left, bottom right of each pixel of a row, with the share of light that roll-off leaves it; none where
    /// either lens has no position for a corner.
    fn quads(&self, y_px: usize) -> Vec<Option<(Quad, f64)>> {
        let mut right: [Option<DVec2>; 2] = [None; 2];
        let mut after = usize::MAX;
        (0..index(self.camera.size.width_px))
            .map(|x_px| {
                let corners = self.camera.corners(x_px, y_px)?;
                // The right edge of the pixel before is the left one of this.
                let left = if after == x_px { right } else { [self.project(corners[0]), self.project(corners[2])] };
                right = [self.project(corners[1]), self.project(corners[3])];
                after = x_px + 1;
                let quad = [left[0]?, right[0]?, left[1]?, right[1]?];
                Some((quad, self.roll_off(&corners)))
            })
            .collect()
    }

    /// Mean over the pixel: two thirds of the centre's and one third of the corners', exact for a fall of the second order.
    fn roll_off(&self, corners: &[[f32; 3]; 4]) -> f64 {
        let z = corners.map(|corner| corner[2]);
        let centre = f64::from(self.camera.roll_off_at(0.25 * (z[0] + z[1] + z[2] + z[3])));
        let around: f64 = z.iter().map(|&z| f64::from(self.camera.roll_off_at(z))).sum();
        (2.0 * centre + 0.25 * around) / 3.0
    }
}

/// Photons of one exposure. `shutter` has one span a row (all equal for a global shutter). Panics if it has not. The render variance is
/// infinite, which is "not known": areas and times are integrated without chance, and the pictures' own noise is theirs. Fails on a
/// picture that cannot be read any more.
pub fn resample(stream: &ImageStream, camera: &Camera, shutter: &[Span]) -> Result<Exposure, Error> {
    let mut photons = Plane::filled(camera.size, 0.0_f32);
    let (width, height) = (photons.width_px(), photons.height_px());
    assert!(shutter.len() == height, "resampling needs one span for each row");
    let mut rows: Vec<Vec<(usize, f64)>> = Vec::with_capacity(height);
    for (row, span) in shutter.iter().enumerate() {
        let is_again = row > 0 && shutter[row - 1] == *span;
        rows.push(if is_again { rows[row - 1].clone() } else { stream.weights(*span) });
    }
    let mut needed: Vec<usize> = rows.iter().flatten().map(|(number, _)| *number).collect();
    needed.sort_unstable();
    needed.dedup();
    let view = CameraPixels::of(stream, camera);
    let per_lux_s = camera.photons_per_lux_s(stream.params.illuminant);
    for numbers in needed.chunks(stream.pictures_at_once()) {
        let pictures = stream.pictures(numbers)?;
        let weights: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| {
                let seconds = |number: usize| row.iter().find(|(known, _)| *known == number).map_or(0.0, |(_, s)| *s);
                numbers.iter().map(|&number| seconds(number) * stream.params.white_lux).collect()
            })
            .collect();
        let one = |row: usize, values: &mut [f32]| {
            let counted: Vec<(&Picture, f64)> = pictures
                .iter()
                .map(|picture| &**picture)
                .zip(weights[row].iter().copied())
                .filter(|(_, lux_s)| *lux_s > 0.0)
                .collect();
            add_row(&view, row, &counted, per_lux_s, values);
        };
        over_chunks(photons.values_mut(), width, one);
    }
    Ok(Exposure { photons, render_variance_ratio: f64::INFINITY, rays: 0 })
}

/// Adds the light of pictures, each with its lux-seconds at value 1, to the pixels of a row.
fn add_row(view: &CameraPixels, row: usize, pictures: &[(&Picture, f64)], per_lux_s: [f64; BANDS], values: &mut [f32]) {
    let Some((first, _)) = pictures.first() else { return };
    let mosaic = &view.camera.mosaic;
    let filters: Vec<[f64; BANDS]> = (0..mosaic.width_px())
        .map(|column| {
            let passed = mosaic.transmission_at(column, row);
            std::array::from_fn(|band| per_lux_s[band] * passed[band])
        })
        .collect();
    let mut coverage = Coverage::default();
    assert!(pictures.iter().all(|(picture, _)| picture.size() == first.size()));
    for (x_px, pixel) in view.quads(row).into_iter().enumerate() {
        let Some((quad, roll_off)) = pixel else { continue };
        let Some(seen_share) = coverage.of(&quad, view.size) else { continue };
        let bands = filters[x_px % filters.len()];
        let mut light = 0.0;
        for (picture, lux_s) in pictures {
            let weights = picture.channel_weights(bands);
            light += lux_s * coverage.mean(picture, &weights);
        }
        values[x_px] += f32_nearest(light * seen_share * roll_off);
    }
}

impl Coverage {
    /// Takes a pixel's area, and gives the share of it that lies in the picture; none where nothing does.
    fn of(&mut self, quad: &Quad, size: Size) -> Option<f64> {
        let whole = area(&ring(quad));
        let inside = clipped(&ring(quad), size);
        let share = if whole > 0.0 { area(&inside) / whole } else { 0.0 };
        if share <= 0.0 {
            return None;
        }
        match widened(quad) {
            None => self.set(&inside),
            Some(wide) => self.set(&clipped(&ring(&wide), size)),
        }
        Some(share)
    }
}

/// The corners in their order around the area.
fn ring(quad: &Quad) -> [DVec2; 4] {
    [quad[0], quad[1], quad[3], quad[2]]
}

/// Share of a camera's picture that lies outside the stream's pictures and is black.
pub fn outside_share(stream: &ImageStream, camera: &Camera) -> f64 {
    let view = CameraPixels::of(stream, camera);
    let (mut seen, mut pixels) = (0.0, 0.0);
    for row in 0..index(camera.size.height_px) {
        for quad in view.quads(row) {
            pixels += 1.0;
            let Some((quad, _)) = quad else { continue };
            let whole = area(&ring(&quad));
            seen += if whole > 0.0 { area(&clipped(&ring(&quad), view.size)) / whole } else { 0.0 };
        }
    }
    // A picture of exactly the same field is not outside by the rounding of its corners.
    if seen > pixels * (1.0 - 1e-6) { 0.0 } else { 1.0 - seen / pixels }
}

/// Pixels of the pictures that a pixel in the middle of a camera covers: below 1 the pictures are coarser than the sensor.
pub fn source_pixels(stream: &ImageStream, camera: &Camera) -> f64 {
    let quads = CameraPixels::of(stream, camera).quads(index(camera.size.height_px) / 2);
    let middle = quads.get(index(camera.size.width_px) / 2).copied().flatten();
    middle.map_or(0.0, |(quad, _)| area(&ring(&quad)))
}

/// Least and greatest mean photons of a pixel over an exposure, for any of the pictures. `outside` says whether some pixels see none.
pub fn photon_bounds(stream: &ImageStream, camera: &Camera, exposure_s: f64, outside: bool) -> [f64; 2] {
    let mut exitance = stream.exitance_bounds();
    if outside {
        exitance.least = [0.0; BANDS];
    }
    bounds::of_exitance(stream.params.illuminant, &exitance, camera, exposure_s)
}

/// z in metres of what the centre of each pixel sees in the picture nearest to a time: the pixel of the picture there, since a mean of
/// two depths is neither. Infinite where the picture has none; none where no picture has. Fails on a picture that cannot be read any
/// more.
pub fn depth(stream: &ImageStream, camera: &Camera, t_s: f64) -> Result<Option<Plane<f32>>, Error> {
    let Some(source) = stream.depth_m(t_s)? else { return Ok(None) };
    let view = CameraPixels::of(stream, camera);
    let mut plane = Plane::filled(camera.size, f32::INFINITY);
    for row in 0..plane.height_px() {
        for (x_px, quad) in view.quads(row).into_iter().enumerate() {
            let Some((quad, _)) = quad else { continue };
            let centre_px = 0.25 * (quad[0] + quad[1] + quad[2] + quad[3]);
            let inside = centre_px.cmpge(DVec2::ZERO).all()
                && centre_px.x < f64::from(view.size.width_px)
                && centre_px.y < f64::from(view.size.height_px);
            if inside {
                let pixel = [centre_px.x, centre_px.y].map(|position_px| index(crate::num::u32_truncated(position_px)));
                plane.row_mut(row)[x_px] = source.at(pixel[0], pixel[1]);
            }
        }
    }
    Ok(Some(plane))
}
