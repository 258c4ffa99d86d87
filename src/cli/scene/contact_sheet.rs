//! A contact sheet: small pictures of a scene from several views, in even light, so that shapes and textures show.

use std::io::Cursor;

use glam::DVec3;
use image::{ImageFormat, Rgb, RgbImage};
use sensel::error::Error;
use sensel::num::{f64_from_usize, index, u32_from, u32_truncated_f32};
use sensel::scene::lanes::LANES;
use sensel::scene::mesh::{BackfaceCulled, dot};
use sensel::scene::texture::Footprint;
use sensel::scene::tracer::{MISS, Stack, closest_through};
use sensel::scene::views::{CameraView, packet_of};
use sensel::scene::{Illuminant, LitScene, Scene};

/// Pixels of each picture.
const SIZE_PX: [u32; 2] = [320, 240];
/// Pictures in a row.
const COLUMNS: usize = 3;
/// Samples of a pixel: along each axis.
const EACH: usize = 2;
/// What lies beyond all surfaces.
const BEYOND: [f32; 3] = [0.12, 0.14, 0.18];

/// The pictures as PNG. Fails on a picture that cannot be encoded.
pub fn png(scene: &Scene, views: &[CameraView]) -> Result<Vec<u8>, Error> {
    let lit = scene.clone().evenly_lit(1.0, Illuminant::D65);
    let columns = COLUMNS.min(views.len().max(1));
    let rows = views.len().max(1).div_ceil(columns);
    let mut sheet = RgbImage::new(SIZE_PX[0] * u32_from(columns), SIZE_PX[1] * u32_from(rows));
    for (number, view) in views.iter().enumerate() {
        let (left, top) = (SIZE_PX[0] * u32_from(number % columns), SIZE_PX[1] * u32_from(number / columns));
        let lines = sensel::parallel::collected(index(SIZE_PX[1]), |row| line(&lit, view, row));
        for (y, line) in (top..).zip(lines) {
            for (x, colour) in (left..).zip(line) {
                sheet.put_pixel(x, y, Rgb(colour.map(code)));
            }
        }
    }
    let mut bytes = Vec::new();
    let written = sheet.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png);
    written.map_err(|error| Error::Run(format!("the contact sheet: {error}")))?;
    Ok(bytes)
}

/// Linear colours of a row of pixels.
fn line(lit: &LitScene, view: &CameraView, row: usize) -> Vec<[f32; 3]> {
    let mut stack = Stack::new();
    let (width, half) = (index(SIZE_PX[0]), libm::tan(0.5 * view.horizontal_fov_rad));
    let mut colours = vec![[0.0; 3]; width];
    let per_packet = LANES / (EACH * EACH);
    for first in (0..width).step_by(per_packet) {
        let packet = packet_of(&view.world_from_camera, |lane| {
            let (pixel, sample) = (first + lane / (EACH * EACH), lane % (EACH * EACH));
            let at = |pixel: usize, sample: usize, of: usize| {
                2.0 * f64_from_usize(2 * (EACH * pixel + sample) + 1) / f64_from_usize(2 * EACH * of) - 1.0
            };
            let x = at(pixel, sample % EACH, width);
            let y = 0.75 * at(row, sample / EACH, index(SIZE_PX[1]));
            DVec3::new(half * x, half * y, 1.0)
        });
        let hits = closest_through(&lit.scene().bvh, &BackfaceCulled(&lit.scene().mesh), &packet, &mut stack);
        for lane in 0..LANES {
            let direction = [0, 1, 2].map(|axis| packet.direction[axis].0[lane]);
            let seen = match hits.triangle[lane] {
                MISS => BEYOND,
                triangle => {
                    let normal = lit.scene().layout.triangles[index(triangle)].normal;
                    let barycentric = [hits.u.0[lane], hits.v.0[lane]];
                    let [r, g, b, _] = lit.exitance_lux(triangle, barycentric, direction, &Footprint::POINT, 1.0);
                    // Brighter the more a surface faces the camera, so that edges between surfaces of one colour show.
                    let facing = 0.35 + 0.65 * dot(normal, direction).abs();
                    [r, g, b].map(|band| band * facing)
                }
            };
            let colour = &mut colours[first + lane / (EACH * EACH)];
            for band in 0..3 {
                colour[band] += seen[band] / 4.0;
            }
        }
    }
    colours
}

/// sRGB code of a linear value; 1 is white.
fn code(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 };
    u8::try_from(u32_truncated_f32(255.0 * encoded + 0.5)).unwrap_or(u8::MAX)
}
