//! A camera before its pixels: lens, aperture, and the bearing of every pixel. Generates rays and computes photons per lux.

mod identity;

use glam::{DVec2, DVec3};

use super::lens::Lens;
use super::mosaic::{FILTER_BANDS, Mosaic};
use super::psf::BlurKernel;
pub use super::roll_off::RollOff;
use super::roll_off::Shading;
use crate::error::Error;
use crate::num::{f32_nearest, f64_from_usize, index};
use crate::pose::Pose;
use crate::scene::Illuminant;
use crate::scene::light::BANDS;
use crate::units::Size;

/// How the cone of light behind the lens is taken (docs/light.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pupil {
    /// `E = pi L T / (1 + 4 N^2)`: the exit pupil is a flat disc.
    ThinLens,
    /// `E = pi L T / (4 N^2)`: a lens that obeys the sine condition.
    Aplanatic,
}

/// What lets light in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Focal length over the pupil's diameter.
    pub f_number: f64,
    /// Share of the light that passes the glass.
    pub transmission: f64,
    /// The cone's formula.
    pub pupil: Pupil,
}

impl Aperture {
    /// Irradiance on the sensor over the exitance of the surface it looks at, on the axis.
    pub fn irradiance_per_exitance(&self) -> f64 {
        let cone = 4.0 * self.f_number * self.f_number;
        match self.pupil {
            Pupil::ThinLens => self.transmission / (1.0 + cone),
            Pupil::Aplanatic => self.transmission / cone,
        }
    }
}

/// A camera of a rig.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Mapping between bearings and pixel positions.
    pub lens: Lens,
    /// Pixels.
    pub size: Size,
    /// The camera's pose on the body.
    pub body_from_camera: Pose,
    /// Aperture.
    pub aperture: Aperture,
    /// Distance between pixel centres, and the width of a pixel's square area, in micrometres.
    pub pixel_pitch_um: f64,
    shading: Shading,
    /// Colour filters over the pixels.
    pub mosaic: Mosaic,
    /// Share of near infrared that passes the lens's cut filter.
    pub infrared_transmission: f64,
    /// Steps per band between lens and photodiode; none where one render serves all bands.
    pub(super) band_groups: Vec<BandGroup>,
    /// Share of the light behind the filters that ends in the four neighbours.
    pub(super) optical_crosstalk: f64,
    bearings: Bearings,
}

/// Where the pixels of a lens look.
#[derive(Clone, Debug)]
pub(super) struct Bearings {
    /// Unit bearings at the corners of pixels, (width + 1) a row; zero where the lens has none.
    corners: Vec<[f32; 3]>,
    /// Root of the solid angle of each pixel, in radians: the width of its cone at a distance of 1 m.
    spreads: Vec<f32>,
}

impl Camera {
    /// Prepares a camera: computes once the bearing of every pixel corner. Inside a pixel bearings are linear between
    /// its corners, which is off by at most a quarter of the second derivative across a pixel: 1 / (4 f) px for a
    /// pinhole of f px, so 0.001 px at 250 px (tested). Fails on no pixels; a parameter that is not positive and finite; a transmission
    /// above 1.
    pub fn new(
        lens: Lens,
        size: Size,
        body_from_camera: Pose,
        aperture: Aperture,
        pixel_pitch_um: f64,
        roll_off: RollOff,
    ) -> Result<Self, Error> {
        if size.width_px == 0 || size.height_px == 0 {
            let value = format!("{} x {}", size.width_px, size.height_px);
            return Err(Error::key("sensor.width", value, "a picture needs at least one pixel"));
        }
        for (key, value) in [("optics.f_number", aperture.f_number), ("sensor.pixel.pitch_um", pixel_pitch_um)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::key(key, value, "use a positive number"));
            }
        }
        if !(0.0..=1.0).contains(&aperture.transmission) {
            return Err(Error::key("optics.transmission", aperture.transmission, "use 0 to 1"));
        }
        let shading = Shading::of(roll_off, &lens);
        Ok(Self {
            lens,
            size,
            body_from_camera,
            aperture,
            pixel_pitch_um,
            infrared_transmission: 0.0,
            shading,
            mosaic: Mosaic::mono(),
            band_groups: Vec::new(),
            optical_crosstalk: 0.0,
            bearings: Bearings::of(&lens, size),
        })
    }

    /// The same camera with colour filters. They come before `Camera::with_image_path`, which looks at them.
    #[must_use]
    pub fn with_mosaic(self, mosaic: Mosaic) -> Self {
        Self { mosaic, ..self }
    }

    /// The same camera with a lens that passes this share of near infrared, 0 (an ideal cut filter, as made) to 1 (none).
    #[must_use]
    pub fn with_infrared(self, infrared_transmission: f64) -> Self {
        Self { infrared_transmission, ..self }
    }

    /// The same camera with another fall of light. Pixels that reach to where nothing comes through are black.
    #[must_use]
    pub fn with_shading(mut self, shading: Shading) -> Self {
        self.bearings.darken(&shading);
        Self { shading, ..self }
    }

    /// The group of one band, whose lens magnifies by this factor. It has no kernels, filters or crosstalk yet.
    pub(super) fn band_group(&self, band: usize, magnification: f64) -> BandGroup {
        let lens = self.lens.magnified(magnification);
        // A factor of 1 keeps the bearings' bits without asking the lens again.
        let bearings = if lens == self.lens {
            self.bearings.clone()
        } else {
            let mut bearings = Bearings::of(&lens, self.size);
            bearings.darken(&self.shading);
            bearings
        };
        let mut bands = [false; FILTER_BANDS];
        bands[band] = true;
        let mosaic = self.mosaic.clone();
        BandGroup { lens, bearings, mosaic, bands, kernels: None, filters_later: false, electrical_crosstalk: 0.0 }
    }

    /// The camera that renders a group: this one with the group's mapping and filters, an ideal lens and no crosstalk.
    pub(super) fn of_group(&self, group: &BandGroup) -> Self {
        Self {
            lens: group.lens,
            size: self.size,
            body_from_camera: self.body_from_camera,
            aperture: self.aperture,
            pixel_pitch_um: self.pixel_pitch_um,
            shading: self.shading.clone(),
            mosaic: group.mosaic.clone(),
            infrared_transmission: self.infrared_transmission,
            band_groups: Vec::new(),
            optical_crosstalk: 0.0,
            bearings: group.bearings.clone(),
        }
    }

    /// Photons of each band that reach a pixel's filter on the axis in a second per lux-equivalent of exitance.
    pub fn photons_per_lux_s(&self, illuminant: Illuminant) -> [f64; BANDS] {
        let area_um2 = self.pixel_pitch_um * self.pixel_pitch_um;
        let all = illuminant.photons_per_lux_s_um2() * area_um2 * self.aperture.irradiance_per_exitance();
        let [red, green, blue, infrared] = illuminant.band_shares();
        [red, green, blue, infrared * self.infrared_transmission].map(|share| all * share)
    }

    /// Least and greatest share of light that roll-off leaves over all pixels (0 where the lens has no bearing). Inside a pixel the cosine
    /// lies between those of its corners.
    pub fn roll_off_bounds(&self) -> [f64; 2] {
        let own = self.bounds_at(&self.bearings.corners);
        // Bands with a separate mapping see a little more or less of the field.
        self.band_groups
            .iter()
            .map(|group| self.bounds_at(&group.bearings.corners))
            .fold(own, |all, of| [crate::num::lesser(all[0], of[0]), crate::num::greater(all[1], of[1])])
    }

    /// Least and greatest share of light that roll-off leaves at these bearings.
    fn bounds_at<'a>(&self, bearings: impl IntoIterator<Item = &'a [f32; 3]>) -> [f64; 2] {
        let (mut least, mut most, mut is_whole) = (f32::MAX, f32::MIN, true);
        for bearing in bearings {
            if *bearing == [0.0; 3] {
                is_whole = false;
                continue;
            }
            least = if bearing[2] < least { bearing[2] } else { least };
            most = if bearing[2] > most { bearing[2] } else { most };
        }
        if most < least {
            return [0.0; 2];
        }
        let [low, high] = self.shading.bounds(least, most);
        [if is_whole { low } else { 0.0 }, high]
    }

    /// As `roll_off_bounds`, of the pixels from the first column and row to before the last ones. Where light reaches pixels from their
    /// neighbours or bands have separate mappings, what holds for the whole picture.
    pub fn roll_off_bounds_of(&self, [first_x, end_x]: [u32; 2], [first_y, end_y]: [u32; 2]) -> [f64; 2] {
        if !self.band_groups.is_empty() || self.optical_crosstalk > 0.0 {
            return self.roll_off_bounds();
        }
        let stride = index(self.size.width_px) + 1;
        let columns = index(first_x)..=index(end_x);
        let rows = index(first_y)..=index(end_y);
        self.bounds_at(rows.flat_map(|y| &self.bearings.corners[y * stride..][columns.clone()]))
    }

    /// Least and greatest share of the light of the darkest and of the brightest surroundings that blur can leave a pixel.
    pub fn blur_bounds(&self) -> [f64; 2] {
        let lobes = self.band_groups.iter().fold(0.0, |most, group| crate::num::greater(most, group.lobes()));
        [if lobes > 0.0 { 0.5 } else { 1.0 }, 1.0 + lobes]
    }

    /// Cosine to the axis of the bearing farthest from it.
    pub fn cosine_min(&self) -> f64 {
        let seen = self.bearings.corners.iter().filter(|bearing| **bearing != [0.0; 3]);
        seen.fold(1.0, |least, bearing| crate::num::lesser(least, f64::from(bearing[2])))
    }

    /// Share of light that roll-off leaves for a cosine to the axis.
    #[inline(always)]
    pub(super) fn roll_off_at(&self, cos: f32) -> f32 {
        self.shading.share_at(cos)
    }

    /// Bearings of the corners (top left, top right, bottom left, bottom right) of a pixel; none outside the lens's range.
    #[inline(always)]
    pub(super) fn corners(&self, x_px: usize, y_px: usize) -> Option<[[f32; 3]; 4]> {
        let stride = index(self.size.width_px) + 1;
        let top = y_px * stride + x_px;
        let corners = [top, top + 1, top + stride, top + stride + 1].map(|at| self.bearings.corners[at]);
        corners.iter().all(|bearing| *bearing != [0.0; 3]).then_some(corners)
    }

    /// Width of a pixel's cone at 1 m, in metres.
    #[inline(always)]
    pub(super) fn spread(&self, x_px: usize, y_px: usize) -> f32 {
        self.bearings.spreads[y_px * index(self.size.width_px) + x_px]
    }
}

impl Bearings {
    fn of(lens: &Lens, size: Size) -> Self {
        let (width, height) = (index(size.width_px), index(size.height_px));
        let mut corners = Vec::with_capacity((width + 1) * (height + 1));
        for y in 0..=height {
            for x in 0..=width {
                let position_px = DVec2::new(f64_from_usize(x) - 0.5, f64_from_usize(y) - 0.5);
                let bearing = lens.unproject(position_px).filter(|bearing| bearing.is_finite());
                corners.push(bearing.map_or([0.0; 3], |bearing| bearing.to_array().map(f32_nearest)));
            }
        }
        let at = |x: usize, y: usize| DVec3::from_array(corners[y * (width + 1) + x].map(f64::from));
        let mut spreads = Vec::with_capacity(size.pixel_count());
        for y in 0..height {
            for x in 0..width {
                let (right, down) = (at(x + 1, y) - at(x, y), at(x, y + 1) - at(x, y));
                spreads.push(f32_nearest(right.cross(down).length().sqrt()));
            }
        }
        Self { corners, spreads }
    }

    /// Takes the bearings away from where nothing comes through.
    fn darken(&mut self, shading: &Shading) {
        for bearing in &mut self.corners {
            if shading.is_dark_at(f64::from(bearing[2])) {
                *bearing = [0.0; 3];
            }
        }
    }
}

/// Bands that are rendered and changed together.
#[derive(Clone, Debug)]
pub(super) struct BandGroup {
    pub(super) lens: Lens,
    pub(super) bearings: Bearings,
    /// Filters that the render applies; all others come afterwards.
    pub(super) mosaic: Mosaic,
    pub(super) bands: [bool; FILTER_BANDS],
    /// One for each band where the lens blurs.
    pub(super) kernels: Option<[BlurKernel; FILTER_BANDS]>,
    /// Whether the filters come after the blur.
    pub(super) filters_later: bool,
    pub(super) electrical_crosstalk: f64,
}

impl BandGroup {
    /// The greatest lobes of its kernels.
    pub(super) fn lobes(&self) -> f64 {
        self.kernels.iter().flatten().fold(0.0, |most, kernel| crate::num::greater(most, kernel.lobes()))
    }

    /// The kernel of the group's bands: their mean by the light's photons behind the filter.
    pub(super) fn kernel(&self, photons_per_lux_s: [f64; BANDS], kernels: &[BlurKernel; FILTER_BANDS]) -> BlurKernel {
        let passed = self.mosaic.transmission_at(0, 0);
        let weighed: Vec<(&BlurKernel, f64)> = (0..BANDS)
            .filter(|&band| self.bands[band])
            .map(|band| (&kernels[band], photons_per_lux_s[band] * passed[band]))
            .collect();
        if let [(kernel, _)] = weighed[..] {
            return kernel.clone();
        }
        if weighed.iter().all(|(_, share)| *share == 0.0) { weighed[0].0.clone() } else { BlurKernel::mean(&weighed) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lens::{Intrinsics, Mapping, Radtan};
    use super::*;

    #[test]
    fn bearings_between_corners_keep_their_stated_error() {
        let size = Size { width_px: 320, height_px: 240 };
        let intrinsics = Intrinsics { fx_px: 250.0, fy_px: 250.0, cx_px: 159.5, cy_px: 119.5 };
        let mapping = Mapping::Radtan(Radtan { k1: -0.05, k2: 0.01, p1: 1e-4, p2: -2e-4, k3: 0.0 });
        let lens = Lens { intrinsics, mapping };
        let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
        let camera = Camera::new(lens, size, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap();
        let mut tried = 0;
        for y in (0..240).step_by(13) {
            for x in (0..320).step_by(7) {
                let corners = camera.corners(x, y).unwrap();
                for (u, v) in [(0.5, 0.5), (0.25, 0.75), (0.0, 0.9)] {
                    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
                    let between: DVec3 =
                        (0..4).map(|corner| DVec3::from_array(corners[corner].map(f64::from)) * weights[corner]).sum();
                    let position_px = DVec2::new(f64_from_usize(x) - 0.5 + u, f64_from_usize(y) - 0.5 + v);
                    let back_px = lens.project(between).unwrap();
                    // 1 / (4 f) = 0.001 px, and f32 bearings: 6e-8 times 250 px times the stretch of the corner, below 5e-5 px.
                    assert!((back_px - position_px).length() < 0.001 + 5e-5, "{x} {y}: {back_px} for {position_px}");
                    tried += 1;
                }
            }
        }
        assert!(tried > 2_000);
    }

    #[test]
    fn bad_apertures_are_refused_by_key() {
        let size = Size { width_px: 4, height_px: 4 };
        let lens = Lens::pinhole(size, 1.0);
        let mut tried = 0;
        for (f_number, transmission, pitch_um, key) in [
            (0.0, 1.0, 3.0, "optics.f_number"),
            (f64::NAN, 1.0, 3.0, "optics.f_number"),
            (2.0, 1.5, 3.0, "optics.transmission"),
            (2.0, 1.0, -3.0, "sensor.pixel.pitch_um"),
        ] {
            let aperture = Aperture { f_number, transmission, pupil: Pupil::ThinLens };
            let error = Camera::new(lens, size, Pose::IDENTITY, aperture, pitch_um, RollOff::None).unwrap_err();
            assert!(error.to_string().contains(key), "{error}");
            tried += 1;
        }
        assert_eq!(tried, 4);
    }
}
