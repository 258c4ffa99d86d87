//! What a user writes: one struct a section, one field a key, unknown keys refused. Ranges are checked on conversion.

use serde::{Deserialize, Serialize};

macro_rules! sections {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident $(as $key:literal)? : $type:ty,)* })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$field_doc])* $(#[serde(rename = $key)])? pub $field: $type,)* }
    )* };
}

sections! {
    /// A whole scenario, all layers merged.
    Scenario {
        /// Seed of everything that differs from frame to frame.
        seed: u64,
        /// What is looked at.
        scene: Scene,
        /// How the rig moves.
        motion: Motion,
        /// How the run is carried out.
        run: Run,
        /// Cameras and IMU.
        rig: Rig,
        /// Lens and aperture.
        optics: Optics,
        /// The image sensor.
        sensor: Sensor,
        /// The extractor on the sensor.
        compute: Compute,
        /// The link to the host.
        link: Link,
        /// The host's tracker.
        tracker: Tracker,
        /// Constants of energy.
        energy: Energy,
    }
    /// What is looked at: exactly one of `file`, `generator`, `target`.
    Scene {
        /// A glTF binary in the scenario's folder.
        file: Option<String>,
        /// A scene made by code: "box".
        generator: Option<String>,
        /// A calibration target: "flat".
        target: Option<String>,
        /// On a horizontal plane at the camera's start; for targets, on the target's plane. Above 0, to 200,000.
        illuminance_lux: f64,
        /// "D65", "A", "E", "FL11", "LED-B3".
        illuminant: String,
        /// Of targets, 0 to 1.
        reflectance: f64,
        /// Light that a geometry file does not hold: sky, lamps' strength, glowing panels.
        surroundings: crate::scene::Surroundings,
    }
    /// How the rig moves.
    Motion {
        /// A TUM trajectory in the scenario's folder, followed by a smooth spline.
        file: Option<String>,
        /// Without a file: "still" or "sway" (a smooth generated motion).
        kind: String,
        /// Time in the trajectory at which the run starts, counted from its first pose.
        start_s: f64,
        /// Factor on the trajectory's translation, above 0.
        scale: f64,
        /// Place of the trajectory's first pose of the run (or of a still rig) in the scene.
        offset_m: [f64; 3],
        /// Rotation from the trajectory's world into the scene's, quaternion x y z w.
        world_from_motion: [f64; 4],
    }
    /// How the run is carried out.
    Run {
        /// Frames of each camera, 1 to 1,000,000.
        frames: u32,
        /// Rung of the ladder: "expected", "sampled", "clocked", "rtl".
        rung: String,
        /// "auto", "all", "none", or names to add and take away from auto: "+name,-name".
        effects: String,
        /// Threads; 0: as many as cores. Changes no byte of the result.
        threads: u32,
        /// Rays a pixel, 1 to 4096.
        samples_per_pixel: u32,
        /// What all effects left out may add up to, in units of a pixel's own noise, 0 to 10.
        accuracy: f64,
    }
    /// Cameras and IMU on the body.
    Rig {
        /// Distance between the two cameras; 0: one camera.
        baseline_mm: f64,
        /// Rotation from the rig (x right, y down, z forward) into the body that the trajectory describes, quaternion x y z w.
        body_from_rig: [f64; 4],
        /// Preset of the inertial unit: "mems_phone" or "none".
        imu: String,
    }
    /// Lens and aperture.
    Optics {
        /// Name of a lens preset.
        preset: String,
        /// Across the width of the array, before distortion, 1 to 170.
        horizontal_fov_deg: f64,
        /// Radial distortion, r^2.
        k1: f64,
        /// Radial distortion, r^4.
        k2: f64,
        /// Tangential distortion.
        p1: f64,
        /// Tangential distortion.
        p2: f64,
        /// Aperture, 0.5 to 64.
        f_number: f64,
        /// Of the lens, 0 to 1.
        transmission: f64,
        /// "thin_lens" (1 + 4 N^2) or "aplanatic" (4 N^2).
        pupil: String,
        /// "cos4" or "none".
        roll_off: String,
    }
    /// The image sensor.
    Sensor {
        /// Name of a sensor preset.
        preset: String,
        /// Number of the die: spatial patterns are drawn from it.
        die: u64,
        /// Columns, 16 to 4096.
        width: u32,
        /// Rows, 16 to 4096.
        height: u32,
        /// Of the die, 150 to 450.
        temperature_k: f64,
        /// Photodiode to column line.
        pixel: Pixel,
        /// Column converters.
        adc: Adc,
        /// Sequencer.
        readout: Readout,
    }
    /// Photodiode to column line.
    Pixel {
        /// "3T", "4T", "5T", "6T".
        kind as "type": String,
        /// Above 0 to 100.
        pitch_um: f64,
        /// Photoelectrons a photon that meets the photodiode, 0 to 1.
        quantum_efficiency: f64,
        /// Share of the pixel that collects light, above 0, to 1.
        fill_factor: f64,
        /// At the column, source follower included, above 0 to 1000.
        conversion_gain_uv_per_e: f64,
        /// 1 to 1e9.
        full_well_e: f64,
        /// At 300 K, 0 or more.
        dark_current_e_per_s: f64,
        /// Step of temperature over which dark current doubles, above 0 to 100.
        dark_doubling_k: f64,
        /// After CDS, at the ADC's input, 0 or more.
        read_noise_uv: f64,
        /// Overrides sqrt(A k T g / q).
        ktc_noise_uv: Option<f64>,
        /// Standard deviation of the response over pixels, 0 to 0.15.
        prnu: f64,
        /// Standard deviation of the dark signal over pixels, 0 or more.
        dsnu_e: f64,
    }
    /// Column converters.
    Adc {
        /// 1 to 16.
        bits: u32,
        /// Of the ramp's counter.
        clock_hz: u64,
        /// Span of the ramp at gain 1; over the gain 100 uV to 10 V.
        full_scale_uv: f64,
        /// A gain of 2 halves the ramp's span; above 0 to 1000.
        gain: f64,
        /// Pedestal, below the greatest code; not written: a sixteenth of the codes, at any depth.
        black_level_dn: Option<u32>,
        /// Standard deviation over columns, before CDS.
        column_offset_uv: f64,
        /// Standard deviation over columns that CDS leaves.
        column_offset_residual_uv: f64,
        /// Standard deviation of the gain over columns, 0 to 0.15.
        column_gain_sigma: f64,
        /// Clocks of the reset conversion.
        reset_counts: u32,
        /// Before the reset conversion.
        settle_reset_us: f64,
        /// Before the signal conversion.
        settle_signal_us: f64,
        /// "linear".
        ramp: String,
        /// "none", "analog", "digital".
        cds: String,
    }
    /// Sequencer.
    Readout {
        /// "global" or "rolling".
        shutter: String,
        /// Line length in pixel clocks.
        hts: u32,
        /// Frame length in lines.
        vts: u32,
        /// Pixel clock.
        pixel_rate_hz: u64,
        /// Rounded to whole lines.
        exposure_us: f64,
        /// "fixed".
        exposure: String,
        /// Lines of a frame that no exposure can use.
        exposure_margin_lines: u32,
    }
    /// The extractor on the sensor.
    Compute {
        /// "fast9".
        detector: String,
        /// In 8-bit DN, 1 to 255.
        threshold: u8,
        /// Features a frame; 0: all corners.
        top_k: u32,
        /// Side of the cells that share the features out, 8 to 4096.
        cell_px: u32,
        /// Places to 1/16 px.
        subpixel: bool,
    }
    /// The link to the host.
    Link {
        /// D-PHY lanes, 1 to 4.
        lanes: u32,
        /// DDR clock of a lane.
        frequency_hz: u64,
        /// "auto": the smallest RAW kind that holds the codes; or "raw6", "raw7", "raw8", "raw10", "raw12", "raw14", "raw16".
        format: String,
        /// "frames", "features", "both".
        mode: String,
    }
    /// The host's tracker.
    Tracker {
        /// Keyframes refined together, 2 to 50.
        window: u32,
        /// Whether rows' own times are used. Comes with a later version: true is refused under a rolling shutter.
        rolling_shutter: bool,
    }
    /// Constants of energy.
    Energy {
        /// Name of a technology.
        technology: String,
    }
}
