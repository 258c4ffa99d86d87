//! The image sensor: keys of `[sensor]` and its sections.

use serde::{Deserialize, Serialize};

use super::per_camera::PerCamera;

sections! {
    /// The image sensor.
    Sensor {
        /// Name of a sensor preset; "none": what is not written has the values of paper_6t_vga.
        preset: String,
        /// Number of the die: spatial patterns are drawn from it.
        die: u64,
        /// Columns, 16 to 4096.
        width: u32,
        /// Rows, 16 to 4096.
        height: u32,
        /// Of the die, 0 to 450.
        temperature_k: f64,
        /// Process corner: "tt", "ff", "ss", "fs", "sf".
        corner: String,
        /// Analog supply in V, 0.5 to 10.
        supply_v: f64,
        /// Analog supply in V for which the figures are given, 0.5 to 10.
        supply_nominal_v: f64,
        /// Sigma of the conversion gain from die to die relative to its mean, 0 to 0.15.
        die_gain_sigma: f64,
        /// Sigma of the black level from die to die in uV, 0 to 1e6.
        die_offset_uv: f64,
        /// Sigma of the logarithm of the dark current from die to die, 0 to 3.
        die_dark_sigma: f64,
        /// Rows without light that are read before the picture, 0 to 64.
        optical_black_rows: u32,
        /// "none"; "frame": the mean of the optical-black rows is moved to the black level.
        black_clamp: String,
        /// Photodiode to column line.
        pixel: Pixel,
        /// Column converters.
        adc: Adc,
        /// Sequencer.
        readout: Readout,
    }
    /// Photodiode to column line.
    Pixel {
        /// Transistors of the pixel: "3T", "4T", "5T", "6T".
        kind as "type": String,
        /// Distance of neighbouring pixels in um, above 0 to 100.
        pitch_um: f64,
        /// Photoelectrons a photon that meets the photodiode, 0 to 1, alike in all bands. Of monochrome arrays.
        quantum_efficiency: Option<f64>,
        /// "mono", or the pattern of colour filters: "RGGB", "RCCB", rows apart by slashes up to 4 x 4 ("BGRG/GIGI/RGBG/GIGI").
        cfa: String,
        /// Efficiency behind each filter by its letter: [600-700, 500-600, 400-500 nm] or the same and [.., 700-1000
        /// nm], 0 to 1. A monochrome array has the letter M, or `quantum_efficiency`.
        qe_by_filter: Option<std::collections::BTreeMap<String, Vec<f64>>>,
        /// Share of the pixel that collects light, 1e-6 to 1.
        fill_factor: f64,
        /// Conversion gain at the column in uV/e-, source follower included, 0.001 to 1000.
        conversion_gain_uv_per_e: f64,
        /// Full well in e-, 1 to 1e9.
        full_well_e: f64,
        /// Mean dark current at 300 K in e-/s, 0 or more.
        dark_current_e_per_s: f64,
        /// Step of temperature in K over which dark current doubles, 0.001 to 100.
        dark_doubling_k: f64,
        /// Read noise after CDS in uV at the ADC's input, 0 or more.
        read_noise_uv: f64,
        /// Reset noise in uV, in place of sqrt(A k T g / q).
        ktc_noise_uv: Option<f64>,
        /// Standard deviation of the response over pixels, 0 to 0.15.
        prnu: f64,
        /// Standard deviation of the dark signal over pixels in e-, 0 or more.
        dsnu_e: f64,
        /// Sigma of the dark current over pixels relative to its mean (lognormal), 0 to 2.
        dcnu: f64,
        /// Dark current of the storage node at 300 K in e-/s, 0 to 1e9; not written: as the photodiode's.
        storage_dark_e_per_s: Option<f64>,
        /// Share of the stored charge that leaks away in a second of waiting, 0 to 100 (global shutter).
        storage_leakage_per_s: f64,
        /// Response of the storage node to light relative to the photodiode's (1 / parasitic light sensitivity), 0 to 1.
        parasitic_light: f64,
        /// Pixels with random telegraph noise in parts per million, 0 to 1e6.
        rts_ppm: f64,
        /// Mean amplitude of their trap in uV at the ADC's input, 0 to 1e6 (exponentially distributed).
        rts_amplitude_uv: f64,
        /// Mean rate of capture and of emission of a trap in Hz, 1e-6 to 1e9.
        rts_rate_hz: f64,
        /// Source follower's 1/f noise at 1 Hz in uV/sqrt(Hz) at the ADC's input, 0 to 1e6.
        flicker_uv_per_rthz: f64,
        /// Bandwidth of source follower and column in Hz, 1e3 to 1e10.
        follower_bandwidth_hz: f64,
        /// Share of the conversion gain that is lost at full well, 0 to 0.5: v = g N (1 - c N / full well).
        gain_compression: f64,
        /// Share of the charge beyond the full well that spills into the four neighbours instead of the drain, 0 to 1.
        blooming: f64,
        /// Share of the charge that stays behind the transfer gate and is read with the next frame, 0 to 0.5.
        image_lag: f64,
        /// Hot pixels in parts per million, 0 to 1e5.
        hot_ppm: f64,
        /// Mean dark current of hot pixels at 300 K in e-/s, 0 to 1e9 (exponentially distributed).
        hot_dark_e_per_s: f64,
        /// Pixels that see no light in parts per million, 0 to 1e5.
        dead_ppm: f64,
        /// Pixels stuck at the bottom or the top of the range in parts per million, 0 to 1e5.
        stuck_ppm: f64,
        /// Share of defects that take their 2x2 neighbourhood with them, 0 to 1.
        defect_cluster_share: f64,
        /// The lower of two conversion gains in uV/e-, 0.001 to the higher one; not written: one gain only.
        low_conversion_gain_uv_per_e: Option<f64>,
        /// Capacity of the lateral overflow capacitor in e- beyond the full well, 0 to 1e9; read at the lower gain.
        overflow_capacity_e: f64,
        /// Share of the light behind the filters that meets one of the four neighbours' photodiodes, 0 to 0.5.
        optical_crosstalk: f64,
        /// Share of the charge that one of the four neighbours collects, 0 to 0.5.
        electrical_crosstalk: f64,
        /// The same of charge freed by near infrared, which is absorbed deeper, 0 to 0.5; not written: as the visible bands'.
        electrical_crosstalk_nir: Option<f64>,
    }
    /// Column converters.
    Adc {
        /// Bits of a code, 1 to 16.
        bits: u32,
        /// Clock of the ramp's counter in Hz.
        clock_hz: u64,
        /// Span of the ramp at gain 1 in uV; divided by the gain 100 uV to 10 V.
        full_scale_uv: f64,
        /// A gain of 2 halves the ramp's span; 0.001 to 1000.
        gain: f64,
        /// Pedestal of all codes in DN, below the greatest code; not written: a sixteenth of the codes, at any depth.
        black_level_dn: Option<u32>,
        /// Standard deviation of the columns' offsets in uV, before CDS.
        column_offset_uv: f64,
        /// Standard deviation of the columns' offsets that CDS leaves, in uV.
        column_offset_residual_uv: f64,
        /// Standard deviation of the gain over columns, 0 to 0.15.
        column_gain_sigma: f64,
        /// Clocks of the reset conversion.
        reset_counts: u32,
        /// Settling time before the reset conversion in us.
        settle_reset_us: f64,
        /// Settling time before the signal conversion in us.
        settle_signal_us: f64,
        /// Shape of the ramp: "linear", "piecewise" or "table".
        ramp: String,
        /// Correlated double sampling: "none", "analog", "digital".
        cds: String,
        /// Of a piecewise ramp: [share of the counts, share of the span], both rising from above 0 to below 1; at most 64.
        ramp_points: Vec<[f64; 2]>,
        /// Of a table ramp: its levels 1 to 2^bits - 1 in uV at gain 1, not falling.
        ramp_table_uv: Vec<f64>,
        /// Greatest deviation of the ramp from its shape in LSB, in the middle of a bow, -64 to 64.
        ramp_inl_lsb: f64,
        /// Time constant of the ramp's start in adc_clk clocks, 0 to 1e4: after k clocks the ramp is
        /// (1 - exp(-k / constant)) x constant clocks behind.
        ramp_settling_clk: f64,
        /// Noise of the ramp in uV, one draw per conversion, shared by the row's columns, 0 to 1e6.
        ramp_noise_uv: f64,
        /// Jitter of adc_clk against the ramp in ps, one draw per conversion and column, 0 to 1e6.
        ramp_jitter_ps: f64,
        /// Amplitude of the supply's ripple at the ADC's input in uV, rejection included, 0 to 1e6.
        supply_ripple_uv: f64,
        /// Frequency of that ripple in Hz, 1 to 1e9.
        supply_ripple_hz: f64,
        /// Noise of the comparator in uV, one draw per conversion and column, besides the read noise, 0 to 1e6.
        comparator_noise_uv: f64,
        /// Clocks from the ramp's passing the column's level to the comparator's output transition, 0 to 1000.
        comparator_delay_clk: u32,
        /// Sigma of that delay over the columns of the die in clocks, 0 to 100.
        comparator_delay_sigma_clk: f64,
        /// Step on the shared ramp, in uV, when a comparator flips, -1e4 to 1e4.
        kickback_uv: f64,
        /// Clocks in which that step decays to a half, 1 to 1024.
        kickback_decay_clk: u32,
        /// Noise that all columns of a row share in uV, one draw per row and frame, 0 to 1e6.
        row_noise_uv: f64,
        /// Sigma of the rows' offsets over the die in uV, 0 to 1e6.
        row_offset_uv: f64,
        /// Noise that all rows of a column share in uV, one draw per column and frame, 0 to 1e6.
        column_noise_uv: f64,
        /// Load of a column line in pF, 0.01 to 100.
        column_capacitance_pf: f64,
        /// Bias current of a column's source follower in uA, 0 to 1000; 0: it settles in any time.
        column_bias_ua: f64,
        /// Overdrive of the source follower in V, 0.01 to 2: its transconductance is 2 bias / overdrive.
        column_overdrive_v: f64,
        /// "binary" or "gray".
        counter: String,
        /// "up_down": each column counts down, then up; "latch": each column latches a shared count twice and subtracts.
        counting: String,
        /// Columns that share one converter, 1 to 64: a row takes as many conversions.
        columns_per_adc: u32,
        /// Width of a converter's layout in um, 0 to 1000; 0: not checked against the pixel pitch.
        pitch_um: f64,
        /// Sides of the array that carry converters, 1 or 2.
        sides: u32,
    }
    /// Sequencer.
    Readout {
        /// "global" or "rolling".
        shutter: String,
        /// "top_to_bottom".
        row_order: String,
        /// Line length in pixel clocks, blanking included, 1 to 2^24.
        hts: u32,
        /// Frame length in lines, blanking included, 1 to 2^24. Or `frame_rate_hz`, not both.
        vts: Option<u32>,
        /// Frames a second, from which VTS is derived (rounded to whole lines). Or `vts`, not both.
        frame_rate_hz: Option<f64>,
        /// Pixel clock.
        pixel_rate_hz: u64,
        /// Rounded to whole lines, at least `exposure_lines_min`; 0 to 1e9. Or `exposure_lines`, not both.
        exposure_us: Option<f64>,
        /// In whole lines. Or `exposure_us`, not both.
        exposure_lines: Option<u32>,
        /// Fine integration time in pixel clocks, added to the whole lines; below HTS.
        exposure_fine_clk: u32,
        /// Lines of a frame that no exposure can use.
        exposure_margin_lines: u32,
        /// Shortest exposure in lines, 0 to 65535.
        exposure_lines_min: u32,
        /// An exposure beyond the frame: "refuse", or "extend_frame" (VTS grows to exposure + margin).
        long_exposure: String,
        /// "fixed", or "auto": the mean code of a frame sets exposure and gain of later ones.
        exposure: String,
        /// Of the automatic exposure: mean code to reach, as a share of the greatest, black level included; 0.001 to 0.99.
        target_mean: f64,
        /// Of the automatic exposure: frames the host takes to answer, beyond the one in which a frame is read; 0 to 8.
        delay_frames: u32,
        /// Of the automatic exposure: longest exposure in lines; not written: the longest that the frame holds.
        exposure_lines_max: Option<u32>,
        /// Of the automatic exposure: greatest gain of the ramp, to 1000.
        gain_max: f64,
        /// Frames after which exposure and gain that are written act, 0 to 8.
        register_latency_frames: u32,
        /// Part of the array that is read: x, y, width, height in array pixels; not written: all of it.
        window: Option<[u32; 4]>,
        /// What x, y, width and height of a window must be multiples of, 1 to 64.
        window_step: u32,
        /// Pixels of each direction that become one: 1, 2 or 4.
        binning: u32,
        /// "charge" (summed before conversion), "average" (codes, a line for each array row), "skip" (the first of them is read).
        binning_mode: String,
        /// "none"; "multi_exposure": staggered exposures, read line by line in turn; "dual_gain": one charge, converted
        /// at both conversion gains.
        hdr: String,
        /// Exposures of a frame, 2 to 4.
        hdr_exposures: u32,
        /// Ratio of each exposure to the next shorter one, 1.001 to 1024.
        hdr_exposure_ratio: f64,
        /// Depth to which merged codes are companded, 8 to 16, where they need more. Not written: the converter's depth, 8 at least.
        hdr_bits: Option<u32>,
        /// Serial lanes from the columns to the output, to 65536; 0: parallel, which takes no time.
        lanes: u32,
        /// Bits a second of each of these lanes; not written: the pixel clock.
        lane_clock_hz: Option<u64>,
        /// Reset pulse of a line in pixel clocks, where settling does not hold it already.
        reset_clk: u32,
        /// Transfer pulse of a line in pixel clocks, where settling does not hold it already.
        transfer_clk: u32,
        /// Copying of the counters at the end of a line, in pixel clocks.
        latch_clk: u32,
        /// What starts a frame: "free" (the end of the one before) or "external" (a pulse to all cameras at once).
        trigger: String,
        /// From pulse to pulse, in whole nanoseconds; 0.001 to 1e8.
        trigger_period_us: Option<f64>,
        /// From pulse to frame, in pixel clocks.
        trigger_delay_clk: u32,
        /// How much later a camera's frames come than the first camera's: one value per camera, or the step from camera to camera.
        sync_skew_us: PerCamera,
        /// Deviation of a camera's clock, -1000 to 1000: one value per camera, or the step from camera to camera.
        clock_ppm: PerCamera,
    }
}
