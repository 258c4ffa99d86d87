//! Lens and aperture: keys of `[optics]`.

use serde::{Deserialize, Serialize};

sections! {
    /// Lens and aperture.
    Optics {
        /// Name of a lens preset; "none": what is not written has the values of pinhole_90.
        preset: String,
        /// "pinhole", "radtan", "kb4", "double_sphere", "eucm" or "table".
        model: String,
        /// Across the width of the array: of a pinhole or radtan before distortion, 1 to 170; of others the whole field, 1 to 360.
        /// Or `fx_px` and `fy_px`, not both.
        horizontal_fov_deg: Option<f64>,
        /// Focal length in pixels of the array, 1 to 1e5, with `fy_px`; of a double sphere the unit of its plane, as Kalibr has it.
        fx_px: Option<f64>,
        /// The same vertically.
        fy_px: Option<f64>,
        /// Column of the principal point, within the array; not written: its middle.
        cx_px: Option<f64>,
        /// Row of the principal point, within the array; not written: its middle.
        cy_px: Option<f64>,
        /// radtan: radial distortion, r^2. kb4: angle^3. -10 to 10.
        k1: f64,
        /// radtan: radial distortion, r^4. kb4: angle^5. -10 to 10.
        k2: f64,
        /// radtan: tangential distortion, -10 to 10.
        p1: f64,
        /// radtan: tangential distortion, -10 to 10.
        p2: f64,
        /// radtan: radial distortion, r^6. kb4: angle^7. -10 to 10.
        k3: f64,
        /// kb4: angle^9, -10 to 10.
        k4: f64,
        /// double_sphere: distance of the spheres, above -1 to below 1.
        xi: f64,
        /// double_sphere, eucm: shift of the pinhole, 0 to 1.
        alpha: f64,
        /// eucm: squared ratio of the ellipsoid's axes, 0.01 to 100.
        beta: f64,
        /// table: [angle off the axis in degrees, radius], both rising, at most 64 points beside the axis. It sets the scale.
        table: Vec<[f64; 2]>,
        /// table: unit of its radii on the array, "mm" or "px".
        table_unit: String,
        /// Size of the picture in red and blue, and if written in near infrared (else as red), relative to green, in parts per thousand,
        /// -50 to 50; empty: no lateral chromatic aberration.
        lateral_ca: Vec<f64>,
        /// Aperture, 0.5 to 64.
        f_number: f64,
        /// Of the lens, 0 to 1.
        transmission: f64,
        /// Share of 700 to 1000 nm that passes as well, 0 (a cut filter) to 1 (none).
        infrared_transmission: f64,
        /// "thin_lens" (1 + 4 N^2) or "aplanatic" (4 N^2).
        pupil: String,
        /// "cos4" (a flat pupil; fields below 180 degrees), "solid_angle" (a pupil that turns to face its field, as in wide-angle lenses),
        /// "none", or "table".
        roll_off: String,
        /// [angle off the axis in degrees, share of the light on the axis], from 0 degrees on.
        roll_off_table: Vec<[f64; 2]>,
        /// Angles off the axis in degrees at which the lens' stops begin to clip its pupil and at which nothing comes through; not written:
        /// never. The second is the edge of the image circle.
        vignetting_deg: Option<[f64; 2]>,
        /// Whether light is bent at the pupil's edge.
        diffraction: bool,
        /// Diameter of the blur circle of defocus on the sensor, 0 to 1000, alike for all depths.
        defocus_um: f64,
        /// Standard deviation of a Gaussian blur that stands for all other aberrations, on the sensor along each axis, 0 to 1000.
        aberration_um: f64,
    }
}
