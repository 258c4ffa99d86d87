//! From the keys of lens and aperture to their checked parameters.

use super::check::{one_of, within};
use super::resolved::Resolved;
use super::scenario::{Optics, Scenario};
use crate::error::Error;
use crate::optics::lens::{DoubleSphere, Eucm, Intrinsics, Kb4, Lens, Mapping, RadiusTable, Radtan};
use crate::optics::mosaic::FILTER_BANDS;
use crate::optics::{Aperture, Camera, ImagePath, Psf, Pupil, RollOff, Shading};
use crate::units::Size;

/// Names of the mappings.
const MODELS: [&str; 6] = ["pinhole", "radtan", "kb4", "double_sphere", "eucm", "table"];

/// Keys of mappings, and the mappings that read them.
const KEYS: [(&str, &[&str]); 14] = [
    ("horizontal_fov_deg", &["pinhole", "radtan", "kb4", "double_sphere", "eucm"]),
    ("fx_px", &["pinhole", "radtan", "kb4", "double_sphere", "eucm"]),
    ("fy_px", &["pinhole", "radtan", "kb4", "double_sphere", "eucm"]),
    ("k1", &["radtan", "kb4"]),
    ("k2", &["radtan", "kb4"]),
    ("p1", &["radtan"]),
    ("p2", &["radtan"]),
    ("k3", &["radtan", "kb4"]),
    ("k4", &["kb4"]),
    ("xi", &["double_sphere"]),
    ("alpha", &["double_sphere", "eucm"]),
    ("beta", &["eucm"]),
    ("table", &["table"]),
    ("table_unit", &["table"]),
];

/// Refuses a key of another mapping or law of shading that the user changed. Fails with the first such key, with what would make it act.
pub(super) fn check_idle(resolved: &Resolved) -> Result<(), Error> {
    let optics = &resolved.scenario.optics;
    for (key, models) in KEYS {
        let key = format!("optics.{key}");
        let is_off = !models.contains(&optics.model.as_str()) && resolved.tree.get(&key).is_some();
        resolved.check_idle(is_off, &key, &format!("optics.model = {}", models.join(" or ")))?;
    }
    resolved.check_idle(optics.roll_off != "table", "optics.roll_off_table", "optics.roll_off = \"table\"")
}

impl Scenario {
    /// The lens mapping. Fails on parameters out of range, a field of view that the mapping does not reach, distortion that folds a flat
    /// picture over.
    pub fn lens(&self) -> Result<Lens, Error> {
        let (optics, size) = (&self.optics, self.size()?);
        let mapping = self.mapping()?;
        let mut lens = match (optics.horizontal_fov_deg, optics.fx_px, optics.fy_px) {
            _ if optics.model == "table" => self.table_lens(size, mapping)?,
            (Some(fov_deg), None, None) => lens_spanning(size, mapping, fov_deg)?,
            (None, Some(fx_px), Some(fy_px)) => {
                let fx_px = within("optics.fx_px", fx_px, 1.0..=1e5, "1 to 1e5")?;
                let fy_px = within("optics.fy_px", fy_px, 1.0..=1e5, "1 to 1e5")?;
                Lens { intrinsics: Intrinsics { fx_px, fy_px, ..middle(size) }, mapping }
            }
            (Some(fov_deg), ..) => {
                return Err(Error::key("optics.horizontal_fov_deg", fov_deg, "use either this, or fx_px and fy_px"));
            }
            (None, fx_px, _) => {
                let key = if fx_px.is_none() { "optics.fx_px" } else { "optics.fy_px" };
                return Err(Error::key(key, "", "is missing; give horizontal_fov_deg, or fx_px and fy_px"));
            }
        };
        for (key, written, side_px, position_px) in [
            ("optics.cx_px", optics.cx_px, size.width_px, &mut lens.intrinsics.cx_px),
            ("optics.cy_px", optics.cy_px, size.height_px, &mut lens.intrinsics.cy_px),
        ] {
            let last_px = f64::from(side_px) - 0.5;
            *position_px = match written {
                Some(at_px) => within(key, at_px, -0.5..=last_px, &format!("-0.5 to {last_px}"))?,
                None => *position_px,
            };
        }
        check_corners(optics, size, &lens)?;
        Ok(lens)
    }

    fn mapping(&self) -> Result<Mapping, Error> {
        let optics = &self.optics;
        let Optics { k1, k2, p1, p2, k3, k4, xi, alpha, beta, .. } = *optics;
        for (key, value) in [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3), ("k4", k4)] {
            within(&format!("optics.{key}"), value, -10.0..=10.0, "-10 to 10")?;
        }
        // At 1 the centre of the second sphere lies on the first one, and the model degenerates.
        within("optics.xi", xi, -0.999..=0.999, "-0.999 to 0.999")?;
        within("optics.alpha", alpha, 0.0..=1.0, "0 to 1")?;
        within("optics.beta", beta, 0.01..=100.0, "0.01 to 100")?;
        one_of("optics.model", &optics.model, &MODELS.map(|name| (name, ())))?;
        Ok(match optics.model.as_str() {
            "pinhole" => Mapping::Pinhole,
            "radtan" => Mapping::Radtan(Radtan { k1, k2, p1, p2, k3 }),
            "kb4" => Mapping::Kb4(Kb4::new([k1, k2, k3, k4])),
            "double_sphere" => Mapping::DoubleSphere(DoubleSphere { xi, alpha }),
            "eucm" => Mapping::Eucm(Eucm { alpha, beta }),
            "table" => Mapping::Table(RadiusTable::new(&in_radians(&optics.table))?),
            other => unreachable!("`MODELS` has {other}, which has no mapping"),
        })
    }

    /// A table brings its own scale.
    fn table_lens(&self, size: Size, mapping: Mapping) -> Result<Lens, Error> {
        let pitch_um = within("sensor.pixel.pitch_um", self.sensor.pixel.pitch_um, 1e-3..=100.0, "0.001 to 100")?;
        let units = [("mm", 1e3 / pitch_um), ("px", 1.0)];
        let px_per_unit = one_of("optics.table_unit", &self.optics.table_unit, &units)?;
        Ok(Lens { intrinsics: Intrinsics { fx_px: px_per_unit, fy_px: px_per_unit, ..middle(size) }, mapping })
    }

    /// Aperture and transmission, and the law of shading where it has a name. Fails on values out of range, unknown names.
    pub fn aperture(&self) -> Result<(Aperture, RollOff), Error> {
        let optics = &self.optics;
        let pupil =
            one_of("optics.pupil", &optics.pupil, &[("thin_lens", Pupil::ThinLens), ("aplanatic", Pupil::Aplanatic)])?;
        let laws = [
            ("cos4", RollOff::Cos4),
            ("none", RollOff::None),
            ("solid_angle", RollOff::SolidAngle),
            // The table takes its place in `Scenario::fitted`.
            ("table", RollOff::None),
        ];
        let roll_off = one_of("optics.roll_off", &optics.roll_off, &laws)?;
        let f_number = within("optics.f_number", optics.f_number, 0.5..=64.0, "0.5 to 64")?;
        let transmission = within("optics.transmission", optics.transmission, 1e-6..=1.0, "1e-6 to 1")?;
        Ok((Aperture { f_number, transmission, pupil }, roll_off))
    }

    /// A camera (lens, aperture and filters set) with the rest of its optics: shading, blur, bands' own sizes, crosstalk. Fails on values
    /// out of range; cos^4 for a picture that reaches beyond 90 degrees.
    pub fn fitted(&self, camera: Camera) -> Result<Camera, Error> {
        let optics = &self.optics;
        let (_, roll_off) = self.aperture()?;
        let mut shading = Shading::of(roll_off, &camera.lens);
        if optics.roll_off == "table" {
            shading = Shading::measured(&in_radians(&optics.roll_off_table))?;
        }
        let mut dark_deg = 180.0;
        if let Some([start_deg, end_deg]) = optics.vignetting_deg {
            if !(start_deg >= 0.0 && end_deg > start_deg && end_deg <= 180.0) {
                let value = format!("[{start_deg}, {end_deg}]");
                let reason = "use two rising angles from 0 to 180 degrees";
                return Err(Error::key("optics.vignetting_deg", value, reason));
            }
            shading = shading.vignetted(start_deg.to_radians(), end_deg.to_radians());
            dark_deg = end_deg;
        }
        let camera = camera.with_shading(shading);
        if roll_off == RollOff::Cos4 && dark_deg > 90.0 && camera.cosine_min() <= 0.0 {
            let reason =
                "a flat pupil sees nothing from 90 degrees on, and this picture does; use solid_angle or table";
            return Err(Error::key("optics.roll_off", &optics.roll_off, reason));
        }
        camera.with_image_path(&self.image_path()?)
    }

    fn image_path(&self) -> Result<ImagePath, Error> {
        let (optics, pixel) = (&self.optics, &self.sensor.pixel);
        let mut magnification = [1.0; FILTER_BANDS];
        match optics.lateral_ca[..] {
            [] => {}
            [red, blue] | [red, blue, _] => {
                let infrared = optics.lateral_ca.get(2).copied().unwrap_or(red);
                magnification = [1.0 + 1e-3 * red, 1.0, 1.0 + 1e-3 * blue, 1.0 + 1e-3 * infrared];
            }
            _ => {
                let reason = "use [red, blue], [red, blue, near infrared] or []";
                return Err(Error::key("optics.lateral_ca", format!("{:?}", optics.lateral_ca), reason));
            }
        }
        let visible = pixel.electrical_crosstalk;
        let infrared = pixel.electrical_crosstalk_nir.unwrap_or(visible);
        within("sensor.pixel.electrical_crosstalk_nir", infrared, 0.0..=0.5, "0 to 0.5")?;
        Ok(ImagePath {
            magnification,
            psf: Psf {
                diffraction: optics.diffraction,
                f_number: optics.f_number,
                defocus_um: optics.defocus_um,
                aberration_um: optics.aberration_um,
            },
            optical_crosstalk: pixel.optical_crosstalk,
            electrical_crosstalk: [visible, visible, visible, infrared],
        })
    }
}

/// Square pixels of no size yet, and the principal point in the array's middle.
fn middle(size: Size) -> Intrinsics {
    let (cx_px, cy_px) = (0.5 * (f64::from(size.width_px) - 1.0), 0.5 * (f64::from(size.height_px) - 1.0));
    Intrinsics { fx_px: 1.0, fy_px: 1.0, cx_px, cy_px }
}

fn in_radians(points: &[[f64; 2]]) -> Vec<(f64, f64)> {
    points.iter().map(|&[angle_deg, value]| (angle_deg.to_radians(), value)).collect()
}

/// The field is a pinhole's before its distortion, and any other lens' own.
fn lens_spanning(size: Size, mapping: Mapping, fov_deg: f64) -> Result<Lens, Error> {
    let key = "optics.horizontal_fov_deg";
    if mapping.is_flat() {
        let fov_deg = within(key, fov_deg, 1.0..=170.0, "1 to 170, or the optics.model of a fisheye")?;
        return Ok(Lens { mapping, ..Lens::pinhole(size, fov_deg.to_radians()) });
    }
    let fov_deg = within(key, fov_deg, 1.0..=360.0, "1 to 360")?;
    Lens::spanning(size, mapping, fov_deg.to_radians()).ok_or_else(|| {
        let unit = Lens { intrinsics: Intrinsics { fx_px: 1.0, fy_px: 1.0, cx_px: 0.0, cy_px: 0.0 }, mapping };
        let most_deg = 2.0 * unit.field_angle_max_rad().to_degrees();
        // A little inside, where the mapping surely has a bearing.
        let wide_deg = (10.0 * most_deg - 1.0).floor() / 10.0;
        Error::key(key, fov_deg, format!("this mapping ends below {most_deg:.3} degrees; use {wide_deg} or less"))
    })
}

/// A flat picture is whole; a fisheye's corners may lie outside its image circle, and stay black.
fn check_corners(optics: &Optics, size: Size, lens: &Lens) -> Result<(), Error> {
    if !lens.mapping.is_flat() {
        return Ok(());
    }
    let (right, bottom) = (f64::from(size.width_px) - 0.5, f64::from(size.height_px) - 0.5);
    let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)];
    if corners.iter().any(|&(x, y)| lens.unproject(glam::DVec2::new(x, y)).is_none()) {
        let terms = [("k1", optics.k1), ("k2", optics.k2), ("p1", optics.p1), ("p2", optics.p2), ("k3", optics.k3)];
        let (name, value) =
            terms.into_iter().fold(("k1", 0.0_f64), |most, term| if term.1.abs() > most.1.abs() { term } else { most });
        let reason = "the distortion folds over inside the picture; use a value nearer to 0";
        return Err(Error::key(&format!("optics.{name}"), value, reason));
    }
    Ok(())
}
