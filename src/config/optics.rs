//! From the keys of lens and aperture to their checked parameters.

use super::check::{one_of, within};
use super::scenario::Scenario;
use crate::error::Error;
use crate::optics::lens::{Lens, Radtan};
use crate::optics::{Aperture, Pupil, RollOff};

impl Scenario {
    /// The lens mapping.
    ///
    /// # Errors
    /// A field of view outside 1 to 170 degrees, or distortion that folds the picture over.
    pub fn lens(&self) -> Result<Lens, Error> {
        let optics = &self.optics;
        let fov_deg = within("optics.horizontal_fov_deg", optics.horizontal_fov_deg, 1.0..=170.0, "1 to 170")?;
        for (key, value) in [("k1", optics.k1), ("k2", optics.k2), ("p1", optics.p1), ("p2", optics.p2)] {
            within(&format!("optics.{key}"), value, -10.0..=10.0, "-10 to 10")?;
        }
        let size = self.size()?;
        let mut lens = Lens::pinhole(size, fov_deg.to_radians());
        lens.distortion = Radtan { k1: optics.k1, k2: optics.k2, p1: optics.p1, p2: optics.p2 };
        let (right, bottom) = (f64::from(size.width_px) - 0.5, f64::from(size.height_px) - 0.5);
        let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)];
        if corners.iter().any(|&(x, y)| lens.unproject(glam::DVec2::new(x, y)).is_none()) {
            let terms = [("k1", optics.k1), ("k2", optics.k2), ("p1", optics.p1), ("p2", optics.p2)];
            let (name, value) = terms
                .into_iter()
                .fold(("k1", 0.0_f64), |most, term| if term.1.abs() > most.1.abs() { term } else { most });
            let reason = "the distortion folds over inside the picture; a value nearer to 0 would do";
            return Err(Error::key(&format!("optics.{name}"), value, reason));
        }
        Ok(lens)
    }

    /// Aperture, transmission and shading.
    ///
    /// # Errors
    /// Values out of range, unknown names.
    pub fn aperture(&self) -> Result<(Aperture, RollOff), Error> {
        let optics = &self.optics;
        let pupil =
            one_of("optics.pupil", &optics.pupil, &[("thin_lens", Pupil::ThinLens), ("aplanatic", Pupil::Aplanatic)])?;
        let roll_off =
            one_of("optics.roll_off", &optics.roll_off, &[("cos4", RollOff::Cos4), ("none", RollOff::None)])?;
        let f_number = within("optics.f_number", optics.f_number, 0.5..=64.0, "0.5 to 64")?;
        let transmission = within("optics.transmission", optics.transmission, 1e-6..=1.0, "above 0 to 1")?;
        Ok((Aperture { f_number, transmission, pupil }, roll_off))
    }
}
