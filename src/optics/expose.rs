//! From scene to photodiode, band by band. Computes the mean photons of every pixel, blurred by the lens, filtered, and shared between
//! neighbours.
//!
//! The lens blurs light before the filters, charge spreads behind them, and both differ by band, as the mapping does (lateral
//! chromatic aberration). So bands that differ are rendered one by one, and behind a mosaic so are all bands once the lens blurs.
//! A monochrome array takes all bands that share a mapping in one render, blurred by the mean of their kernels as the light's
//! spectrum weighs them, which is exact for grey scenes. Where nothing differs there is one render and its plane is left as it
//! is.

use super::camera::{BandGroup, Camera};
use super::crosstalk::shared_out;
use super::mosaic::{FILTER_BANDS, Mosaic};
use super::psf::Psf;
use super::render::{Exposure, Sampling, render, render_over};
use super::static_pictures::StaticPictures;
use crate::draw::DrawKey;
use crate::error::{Error, within};
use crate::num::{f32_nearest, f64_from_usize};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::Illuminant;
use crate::scene::light::{BANDS, INFRARED};
use crate::scene::object::DynamicScene;
use crate::units::Span;

/// Wavelengths that represent the bands in diffraction, their middles: red, green, blue, near infrared.
pub const WAVELENGTHS_UM: [f64; FILTER_BANDS] = [0.65, 0.55, 0.45, 0.85];

/// What lies between an ideal mapping and the photodiode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePath {
    /// Size of each band's picture over that of the mapping, around the principal point.
    pub magnification: [f64; FILTER_BANDS],
    /// Blur of the lens.
    pub psf: Psf,
    /// Share of the light behind the filters that meets one of the four neighbours' photodiodes, 0 to 0.5.
    pub optical_crosstalk: f64,
    /// Share of the charge of each band that one of the four neighbours collects, 0 to 0.5.
    pub electrical_crosstalk: [f64; FILTER_BANDS],
}

impl Camera {
    /// The same camera with a lens that blurs, bands that differ, and photodiodes that share. To be called after its filters and
    /// its shading are set. Fails on values out of range.
    pub fn with_image_path(mut self, path: &ImagePath) -> Result<Self, Error> {
        check(path)?;
        let is_mono = self.mosaic.is_mono();
        let blurs = !path.psf.is_sharp();
        let same = |a: usize, b: usize| {
            path.magnification[a].to_bits() == path.magnification[b].to_bits()
                && path.electrical_crosstalk[a].to_bits() == path.electrical_crosstalk[b].to_bits()
                && (is_mono || !blurs)
        };
        let mut band_groups: Vec<BandGroup> = Vec::new();
        let passes_some = |band: usize| {
            (band != INFRARED || self.infrared_transmission > 0.0)
                && self
                    .mosaic
                    .letters()
                    .any(|letter| self.mosaic.transmission(letter).is_some_and(|passed| passed[band] > 0.0))
        };
        for band in (0..BANDS).filter(|&band| passes_some(band)) {
            let known =
                band_groups.iter_mut().find(|group| (0..BANDS).any(|other| group.bands[other] && same(other, band)));
            if let Some(group) = known {
                group.bands[band] = true;
                continue;
            }
            let kernel = |band: usize| path.psf.kernel(WAVELENGTHS_UM[band], self.pixel_pitch_um);
            band_groups.push(BandGroup {
                kernels: blurs.then(|| std::array::from_fn(kernel)),
                filters_later: blurs && !is_mono,
                electrical_crosstalk: path.electrical_crosstalk[band],
                ..self.band_group(band, path.magnification[band])
            });
        }
        let changes =
            |group: &BandGroup| group.kernels.is_some() || group.electrical_crosstalk > 0.0 || group.lens != self.lens;
        if band_groups.len() == 1 && !changes(&band_groups[0]) {
            band_groups.clear();
        }
        for group in &mut band_groups {
            let filters = if group.filters_later { Mosaic::mono() } else { self.mosaic.clone() };
            group.mosaic = filters.restricted_to(group.bands);
        }
        (self.band_groups, self.optical_crosstalk) = (band_groups, path.optical_crosstalk);
        Ok(self)
    }
}

fn check(path: &ImagePath) -> Result<(), Error> {
    within("optics.defocus_um", path.psf.defocus_um, 0.0, 1000.0)?;
    within("optics.aberration_um", path.psf.aberration_um, 0.0, 1000.0)?;
    within("sensor.pixel.optical_crosstalk", path.optical_crosstalk, 0.0, 0.5)?;
    for band in 0..FILTER_BANDS {
        within("sensor.pixel.electrical_crosstalk", path.electrical_crosstalk[band], 0.0, 0.5)?;
        within("optics.lateral_ca", 1e3 * (path.magnification[band] - 1.0), -50.0, 50.0)?;
    }
    Ok(())
}

/// One exposure as the photodiodes receive it. `shutter` has one span a row. Its render noise is stated as an upper bound where bands are
/// rendered one by one, since they may err together, and before blur and crosstalk, which only lower it.
pub fn expose<'a>(
    scene: impl Into<DynamicScene<'a>>,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    let scene = scene.into();
    let rendered = |camera: &Camera| Ok(render(scene, camera, shutter, world_from_body, sampling));
    expose_by(scene.fixed.illuminant(), camera, &rendered).expect("rendering cannot fail")
}

/// [`expose`] by a still camera under steady light, where only what moves is rendered anew: `static_key` names the samples of the static
/// scene's picture, which `pictures` keeps.
pub fn expose_still_camera(
    scene: DynamicScene<'_>,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    (sampling, static_key): (Sampling, DrawKey),
    pictures: &StaticPictures,
) -> Exposure {
    let rendered = |camera: &Camera| {
        let of_static = Sampling { key: static_key, ..sampling };
        let alone = || render(scene.fixed, camera, shutter, world_from_body, of_static);
        let picture = pictures.of(camera, shutter, &of_static, alone);
        Ok(render_over(&picture, scene, camera, shutter, world_from_body, sampling))
    };
    expose_by(scene.fixed.illuminant(), camera, &rendered).expect("rendering cannot fail")
}

/// [`expose`] where the light behind an ideal lens comes from elsewhere: `ideal` is called once for each group of bands.
pub fn expose_by(
    illuminant: Illuminant,
    camera: &Camera,
    ideal: &dyn Fn(&Camera) -> Result<Exposure, Error>,
) -> Result<Exposure, Error> {
    let mut exposure =
        if camera.band_groups.is_empty() { ideal(camera)? } else { by_group(illuminant, camera, ideal)? };
    if camera.optical_crosstalk > 0.0 {
        exposure.photons = shared_out(&exposure.photons, camera.optical_crosstalk);
    }
    Ok(exposure)
}

fn by_group(
    illuminant: Illuminant,
    camera: &Camera,
    ideal: &dyn Fn(&Camera) -> Result<Exposure, Error>,
) -> Result<Exposure, Error> {
    let mut whole = Exposure { photons: Plane::filled(camera.size, 0.0), render_variance_ratio: 0.0, rays: 0 };
    let (mut photons, mut deviations) = (0.0, 0.0);
    for group in &camera.band_groups {
        let seen = ideal(&camera.of_group(group))?;
        let mut plane = seen.photons;
        if let Some(kernels) = &group.kernels {
            plane = group.kernel(camera.photons_per_lux_s(illuminant), kernels).blurred(&plane);
        }
        if group.filters_later {
            filter(&mut plane, &camera.mosaic, group.bands);
        }
        if group.electrical_crosstalk > 0.0 {
            plane = shared_out(&plane, group.electrical_crosstalk);
        }
        let mean = plane.values().iter().map(|&value| f64::from(value)).sum::<f64>()
            / f64_from_usize(camera.size.pixel_count());
        if mean > 0.0 {
            photons += mean;
            deviations += (seen.render_variance_ratio * mean).sqrt();
        }
        for (sum, value) in whole.photons.values_mut().iter_mut().zip(plane.values()) {
            *sum += value;
        }
        whole.rays += seen.rays;
    }
    if photons > 0.0 {
        whole.render_variance_ratio = deviations * deviations / photons;
    }
    Ok(whole)
}

/// Photons behind the filters, of a plane of one band before them.
pub(super) fn filter(plane: &mut Plane<f32>, mosaic: &Mosaic, bands: [bool; FILTER_BANDS]) {
    let band = bands.iter().position(|&is_in| is_in).expect("a group has a band");
    let (columns, rows) = (mosaic.width_px(), mosaic.height_px());
    for y in 0..plane.height_px() {
        let passed: Vec<f32> = (0..columns).map(|x| f32_nearest(mosaic.transmission_at(x, y % rows)[band])).collect();
        for (x, value) in plane.row_mut(y).iter_mut().enumerate() {
            *value *= passed[x % columns];
        }
    }
}
