//! For each effect of the list a scene that calls for it and one that does not.

/// How bright it is: next to nothing, well inside the range, far beyond the well.
#[derive(Clone, Copy)]
pub enum Light {
    Dark,
    Room,
    Beyond,
}

/// A sensor's keys over the quiet one's, and the light on it.
pub struct Scene {
    pub set: &'static [&'static str],
    pub light: Light,
}

/// Why an effect does not run.
pub enum Idle {
    /// The sensor has it, and the plan leaves it out.
    There { set: &'static [&'static str], light: Light },
    /// The sensor does not have it: it has no bound, so it is never left out.
    Absent { set: &'static [&'static str], light: Light },
}

pub struct Case {
    pub effect: &'static str,
    pub called: Scene,
    pub idle: Idle,
}

/// A sensor without any flaw, of 10 uV/e- and a well of 10,000 e-, read with 2 e- of noise so that budgets are those of a real one.
pub const QUIET: &[&str] = &[
    "sensor.pixel.type=4T",
    "sensor.pixel.conversion_gain_uv_per_e=10.0",
    "sensor.pixel.full_well_e=10000.0",
    "sensor.pixel.dark_current_e_per_s=0.0",
    "sensor.pixel.read_noise_uv=20.0",
    "sensor.pixel.prnu=0.0",
    "sensor.pixel.dsnu_e=0.0",
    "sensor.adc.cds=analog",
    "sensor.adc.bits=12",
    "sensor.adc.full_scale_uv=110000.0",
    "sensor.adc.column_gain_sigma=0.0",
    "sensor.adc.column_offset_uv=0.0",
    "sensor.adc.column_offset_residual_uv=0.0",
    "sensor.temperature_k=300.0",
];

/// Every effect at once.
pub const ALL_PRESENT: &[&str] = &[
    "sensor.pixel.type=3T",
    "sensor.pixel.prnu=0.01",
    "sensor.pixel.parasitic_light=1e-4",
    "sensor.pixel.dead_ppm=100.0",
    "sensor.pixel.dark_current_e_per_s=50.0",
    "sensor.pixel.hot_ppm=100.0",
    "sensor.pixel.hot_dark_e_per_s=1000.0",
    "sensor.pixel.dsnu_e=1.0",
    "sensor.pixel.blooming=0.5",
    "sensor.pixel.image_lag=0.01",
    "sensor.pixel.storage_leakage_per_s=0.5",
    "sensor.pixel.gain_compression=0.05",
    "sensor.die_gain_sigma=0.01",
    "sensor.pixel.rts_ppm=1000.0",
    "sensor.pixel.rts_amplitude_uv=100.0",
    "sensor.pixel.flicker_uv_per_rthz=5.0",
    "sensor.adc.column_bias_ua=5.0",
    "sensor.pixel.stuck_ppm=100.0",
    "sensor.adc.column_gain_sigma=0.001",
    "sensor.die_offset_uv=100.0",
    "sensor.adc.column_offset_uv=100.0",
    "sensor.adc.column_offset_residual_uv=10.0",
    "sensor.adc.column_noise_uv=20.0",
    "sensor.adc.row_noise_uv=20.0",
    "sensor.adc.row_offset_uv=20.0",
    "sensor.adc.comparator_noise_uv=20.0",
    "sensor.adc.ramp_noise_uv=20.0",
    "sensor.adc.ramp_jitter_ps=500.0",
    "sensor.adc.supply_ripple_uv=20.0",
];

const fn case(effect: &'static str, called: &'static [&'static str], idle: &'static [&'static str]) -> Case {
    let light = Light::Room;
    Case { effect, called: Scene { set: called, light }, idle: Idle::There { set: idle, light } }
}

/// The same sensor under two lights.
const fn by_light(effect: &'static str, set: &'static [&'static str], called: Light, idle: Light) -> Case {
    Case { effect, called: Scene { set, light: called }, idle: Idle::There { set, light: idle } }
}

/// In physical order.
pub const CASES: &[Case] = &[
    case("prnu", &["sensor.pixel.prnu=0.02"], &["sensor.pixel.prnu=1e-7"]),
    case("parasitic_light", &["sensor.pixel.parasitic_light=0.01"], &["sensor.pixel.parasitic_light=1e-12"]),
    by_light("dead_pixels", &["sensor.pixel.dead_ppm=50000.0"], Light::Room, Light::Dark),
    by_light("shot_noise", &[], Light::Room, Light::Dark),
    case("dark_current", &["sensor.pixel.dark_current_e_per_s=500.0"], &["sensor.pixel.dark_current_e_per_s=0.01"]),
    case(
        "hot_pixels",
        &["sensor.pixel.hot_ppm=50000.0", "sensor.pixel.hot_dark_e_per_s=5000.0"],
        &["sensor.pixel.hot_ppm=50000.0", "sensor.pixel.hot_dark_e_per_s=0.001"],
    ),
    case("dsnu", &["sensor.pixel.dsnu_e=5.0"], &["sensor.pixel.dsnu_e=0.001"]),
    by_light("blooming", &["sensor.pixel.blooming=0.5"], Light::Beyond, Light::Room),
    case("image_lag", &["sensor.pixel.image_lag=0.1"], &["sensor.pixel.image_lag=1e-9"]),
    by_light("full_well", &[], Light::Beyond, Light::Room),
    case("storage_leakage", &["sensor.pixel.storage_leakage_per_s=20.0"], &["sensor.pixel.storage_leakage_per_s=1e-9"]),
    case("gain_compression", &["sensor.pixel.gain_compression=0.3"], &["sensor.pixel.gain_compression=1e-9"]),
    case("die_gain", &["sensor.die_gain_sigma=0.05"], &["sensor.die_gain_sigma=1e-9"]),
    case(
        "rts_noise",
        &["sensor.pixel.rts_ppm=50000.0", "sensor.pixel.rts_amplitude_uv=500.0"],
        &["sensor.pixel.rts_ppm=50000.0", "sensor.pixel.rts_amplitude_uv=0.001"],
    ),
    case("flicker_noise", &["sensor.pixel.flicker_uv_per_rthz=50.0"], &["sensor.pixel.flicker_uv_per_rthz=1e-4"]),
    case(
        "ktc_noise",
        &["sensor.pixel.type=3T", "sensor.pixel.ktc_noise_uv=200.0"],
        &["sensor.pixel.type=3T", "sensor.pixel.ktc_noise_uv=0.001"],
    ),
    case("read_noise", &["sensor.pixel.read_noise_uv=200.0"], &["sensor.pixel.read_noise_uv=0.001"]),
    case(
        "column_settling",
        &["sensor.adc.column_bias_ua=0.2", "sensor.adc.column_capacitance_pf=10.0"],
        &["sensor.adc.column_bias_ua=20.0", "sensor.adc.column_capacitance_pf=0.5"],
    ),
    Case {
        effect: "stuck_pixels",
        called: Scene { set: &["sensor.pixel.stuck_ppm=50000.0"], light: Light::Room },
        idle: Idle::Absent { set: &[], light: Light::Room },
    },
    case("column_gain", &["sensor.adc.column_gain_sigma=0.01"], &["sensor.adc.column_gain_sigma=1e-9"]),
    case("die_offset", &["sensor.die_offset_uv=1000.0"], &["sensor.die_offset_uv=1e-4"]),
    case(
        "column_offset",
        &["sensor.adc.column_offset_residual_uv=100.0"],
        &["sensor.adc.column_offset_residual_uv=1e-3"],
    ),
    case("column_noise", &["sensor.adc.column_noise_uv=100.0"], &["sensor.adc.column_noise_uv=1e-3"]),
    case("row_noise", &["sensor.adc.row_noise_uv=100.0"], &["sensor.adc.row_noise_uv=1e-3"]),
    case("row_offset", &["sensor.adc.row_offset_uv=100.0"], &["sensor.adc.row_offset_uv=1e-3"]),
    case("comparator_noise", &["sensor.adc.comparator_noise_uv=100.0"], &["sensor.adc.comparator_noise_uv=1e-3"]),
    case("ramp_noise", &["sensor.adc.ramp_noise_uv=100.0"], &["sensor.adc.ramp_noise_uv=1e-3"]),
    case("ramp_jitter", &["sensor.adc.ramp_jitter_ps=5000.0"], &["sensor.adc.ramp_jitter_ps=1e-3"]),
    case("supply_ripple", &["sensor.adc.supply_ripple_uv=200.0"], &["sensor.adc.supply_ripple_uv=1e-4"]),
];
