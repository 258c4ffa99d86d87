//! Which keys reach the photons: those of scene, light, lens, motion, row exposures and render, and no others.

use std::collections::BTreeSet;

use crate::common::assets::KeptBakes;
use sensel::config::Resolved;
use sensel::run::probe::PictureId;
use sensel::run::{NoFiles, NoProgress, Setup};
use sensel::units::FrameIndex;

const TEXT: &str = "[scene]\ntarget = \"checkerboard\"\ntarget_square_m = 0.1\nilluminance_lux = 2000.0\n\
    [run]\nrender_tolerance = 0.02\n[sensor]\nwidth = 32\nheight = 24\noptical_black_rows = 2\n\
    [sensor.pixel]\nrts_ppm = 10.0\n";

/// Keys that are held where a sensor's own figures would stand in their place.
const HELD: [&str; 2] = ["run.render_quantum_efficiency=0.5", "run.render_full_well_e=9000.0"];

/// Keys behind the lens, each with another value.
const BEHIND: &str = "seed=2 run.rung=clocked run.effects=all run.accuracy=0.5 run.threads=1 run.frames=5 \
    rig.imu=none rig.imu_rate_hz=100.0 rig.imu_position_mm=[1.0,0.0,0.0] \
    sensor.temperature_k=320.0 sensor.die=2 sensor.corner=ff sensor.supply_v=2.9 sensor.supply_nominal_v=2.9 \
    sensor.die_gain_sigma=0.01 sensor.die_offset_uv=10.0 sensor.die_dark_sigma=0.1 sensor.optical_black_rows=4 \
    sensor.black_clamp=frame sensor.pixel.type=5T sensor.pixel.quantum_efficiency=0.3 sensor.pixel.fill_factor=0.5 \
    sensor.pixel.conversion_gain_uv_per_e=20.0 sensor.pixel.full_well_e=2000.0 sensor.pixel.dark_current_e_per_s=1000.0 \
    sensor.pixel.dark_doubling_k=6.0 sensor.pixel.read_noise_uv=300.0 sensor.pixel.ktc_noise_uv=300.0 sensor.pixel.prnu=0.03 \
    sensor.pixel.dsnu_e=20.0 sensor.pixel.dcnu=0.3 sensor.pixel.storage_dark_e_per_s=100.0 \
    sensor.pixel.storage_leakage_per_s=0.1 sensor.pixel.parasitic_light=0.001 sensor.pixel.rts_ppm=1000.0 \
    sensor.pixel.rts_amplitude_uv=500.0 sensor.pixel.rts_rate_hz=1000.0 sensor.pixel.flicker_uv_per_rthz=5.0 \
    sensor.pixel.follower_bandwidth_hz=1000000.0 sensor.pixel.gain_compression=0.1 sensor.pixel.blooming=0.5 \
    sensor.pixel.image_lag=0.02 sensor.pixel.hot_ppm=1000.0 sensor.pixel.hot_dark_e_per_s=1000.0 sensor.pixel.dead_ppm=1000.0 \
    sensor.pixel.stuck_ppm=1000.0 sensor.pixel.defect_cluster_share=0.5 \
    sensor.adc.bits=4 sensor.adc.bits=12 sensor.adc.clock_hz=400000000 sensor.adc.full_scale_uv=30000.0 sensor.adc.gain=4.0 \
    sensor.adc.black_level_dn=128 sensor.adc.column_offset_uv=900.0 sensor.adc.column_offset_residual_uv=90.0 \
    sensor.adc.column_gain_sigma=0.01 sensor.adc.reset_counts=64 sensor.adc.settle_reset_us=1.0 sensor.adc.settle_signal_us=2.0 \
    sensor.adc.cds=analog sensor.adc.ramp_inl_lsb=1.0 sensor.adc.ramp_settling_clk=10.0 \
    sensor.adc.ramp_noise_uv=50.0 sensor.adc.ramp_jitter_ps=50.0 sensor.adc.supply_ripple_uv=50.0 \
    sensor.adc.supply_ripple_hz=200000.0 sensor.adc.comparator_noise_uv=50.0 sensor.adc.comparator_delay_clk=2 \
    sensor.adc.comparator_delay_sigma_clk=1.0 sensor.adc.kickback_uv=10.0 sensor.adc.kickback_decay_clk=8 \
    sensor.adc.row_noise_uv=50.0 sensor.adc.row_offset_uv=50.0 sensor.adc.column_noise_uv=50.0 \
    sensor.adc.column_capacitance_pf=2.0 sensor.adc.column_bias_ua=5.0 sensor.adc.column_overdrive_v=0.3 \
    sensor.adc.counter=gray sensor.adc.counting=latch sensor.adc.sides=2 \
    compute.threshold=40 compute.target_features=100 compute.pipeline_bits=10 compute.smoothing=off compute.octaves=2 \
    compute.cell_px=32 compute.per_cell=2 compute.rank=harris compute.subpixel=false compute.angle_bits=5 \
    compute.descriptor_bits=128 compute.pattern=symmetric compute.engines=1 compute.fifo_depth=4 compute.overflow=drop_newest \
    link.lanes=2 link.frequency_hz=400000000 link.format=raw16 link.mode=features link.mode=frames link.frames_every=2 \
    link.line_sync=true link.fifo_rows=4 link.when_full=stall link.bit_error_rate=0.00001 \
    tracker.window=5 tracker.rolling_shutter=false tracker.loop_closing=false tracker.imu=off energy.technology=28nm energy.io_v=2.5 \
    energy.adc=sar energy.port=lvds energy.port_lanes=2 energy.periphery=low_power energy.image_processor=true energy.idle_bias=0.5 \
    energy.digital_v=1.5 energy.pixel_node_nm=90.0 energy.sleep_period_ms=900.0 energy.wake_us=10.0 energy.year=2010 \
    energy.constant.link_byte.pj=12.0";

/// Keys before it, each with another value.
const BEFORE: &str = "scene.illuminance_lux=900.0 scene.illuminant=A scene.reflectance=0.3 scene.target_square_m=0.2 \
    motion.kind=sway optics.f_number=4.0 optics.transmission=0.5 \
    optics.aberration_um=2.0 rig.baseline_mm=0.0 \
    sensor.pixel.pitch_um=4.0 sensor.pixel.optical_crosstalk=0.05 sensor.pixel.electrical_crosstalk=0.05 \
    sensor.readout.exposure_us=1000.0 \
    run.render_seed=1 run.render_tolerance=0.1 run.samples_per_pixel=3 run.render_quantum_efficiency=0.25 \
    run.render_full_well_e=100.0 run.photon_rounding=0.3";

/// Sections all of whose keys lie behind the lens, but for those named.
const SECTIONS: [&str; 6] = ["sensor.adc.", "sensor.pixel.", "compute.", "link.", "tracker.", "energy."];
/// Of these: geometry and filters, and keys that act only together with others (which are said to be idle, or want a table).
const NOT_ALONE: &str = "sensor.pixel.pitch_um sensor.pixel.cfa sensor.pixel.optical_crosstalk sensor.pixel.electrical_crosstalk \
    sensor.pixel.overflow_capacity_e sensor.adc.ramp sensor.adc.ramp_points sensor.adc.ramp_table_uv sensor.adc.pitch_um \
    sensor.adc.columns_per_adc compute.detector sensor.readout.hts";

fn setup(assignments: &[&str]) -> Setup {
    let assignments: Vec<String> = assignments.iter().map(|&assignment| assignment.to_owned()).collect();
    let resolved =
        Resolved::from_layers("photons.toml", TEXT, &assignments).unwrap_or_else(|e| panic!("{assignments:?}: {e}"));
    Setup::new(resolved, &KeptBakes, &NoProgress).unwrap_or_else(|e| panic!("{assignments:?}: {e}"))
}

const FRAMES: [u32; 2] = [0, 3];

fn photons_of(setup: &Setup) -> Vec<Vec<u32>> {
    let of = |frame| {
        let seen = setup.exposures_at(PictureId { frame: FrameIndex(frame), camera: 0 }).unwrap();
        seen.iter().flat_map(|exposure| exposure.photons.values().iter().map(|value| value.to_bits())).collect()
    };
    FRAMES.map(of).to_vec()
}

fn photons(assignments: &[&str]) -> Vec<Vec<u32>> {
    photons_of(&setup(assignments))
}

/// Photons, and the keys of the photon store for the same exposures, with a key and what it needs beside the held ones.
fn seen(assignment: Option<&str>) -> (Vec<Vec<u32>>, Vec<Option<String>>) {
    let mut all = HELD.to_vec();
    all.extend(assignment);
    all.extend(assignment.map_or(&[][..], beside));
    let setup = setup(&all);
    let keys = FRAMES.map(|frame| setup.photon_keys(PictureId { frame: FrameIndex(frame), camera: 0 })).concat();
    (photons_of(&setup), keys)
}

#[test]
fn no_key_behind_the_lens_changes_a_photon_or_a_key_of_their_store_and_every_key_before_it_changes_both() {
    let (held, held_keys) = seen(None);
    assert!(held_keys.len() == 2 && held_keys.iter().all(Option::is_some));
    let (mut tried, mut cases) = (BTreeSet::new(), 0);
    for assignment in BEHIND.split_whitespace() {
        let (photons, keys) = seen(Some(assignment));
        assert!(photons == held, "{assignment} changes photons");
        assert_eq!(keys, held_keys, "{assignment}");
        tried.insert(assignment.split_once('=').unwrap().0.to_owned());
        cases += 1;
    }
    let mut known = BTreeSet::from([held_keys]);
    for assignment in BEFORE.split_whitespace() {
        let (photons, keys) = seen(Some(assignment));
        assert!(photons != held, "{assignment} changes no photon");
        assert!(known.insert(keys), "{assignment} changes no key of the store, or two have one key");
        tried.insert(assignment.split_once('=').unwrap().0.to_owned());
        cases += 1;
    }
    assert!(cases > 128, "{cases}");
    // Every key of these sections was among them, so that none that comes later is forgotten.
    let resolved = Resolved::from_layers("photons.toml", TEXT, &[]).unwrap();
    let mut section = String::new();
    for line in resolved.canonical_text().lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = format!("{name}.");
        }
        let Some((key, _)) = line.split_once(" = ") else { continue };
        let key = format!("{section}{key}");
        let belongs = SECTIONS.iter().any(|section| key.starts_with(section));
        let known = tried.contains(&key) || NOT_ALONE.split_whitespace().any(|other| other == key);
        assert!(!belongs || known, "{key} is not tried");
    }
    assert!(tried.len() > 110, "{}", tried.len());
}

/// A scene with geometry, so that light is baked.
const ROOM: &str = "[scene]\ngenerator = \"box\"\nbake = \"direct\"\n[sensor]\nwidth = 64\nheight = 48\n";

/// Keys that decide what a bake may cost, and none of its light.
const LIMITS: [&str; 2] = ["scene.bake_rays_max=2e12", "scene.bake_memory_mb_max=5000.0"];

#[test]
fn what_a_bake_may_cost_changes_no_key_of_the_photon_store() {
    let in_room = |assignments: &[String]| {
        let resolved = Resolved::from_layers("room.toml", ROOM, assignments).unwrap();
        // Baked each time: a stored bake would be the same under all limits.
        let setup = Setup::new(resolved, &NoFiles, &NoProgress).unwrap();
        setup.photon_keys(PictureId { frame: FrameIndex(0), camera: 0 })
    };
    let room = in_room(&[]);
    assert!(room.iter().all(Option::is_some));
    for limit in LIMITS {
        assert_eq!(in_room(&[limit.to_owned()]), room, "{limit}");
    }
}

/// What a key needs beside it so that the configuration is a whole one.
fn beside(assignment: &str) -> &'static [&'static str] {
    match assignment.split_once('=').unwrap().0 {
        "sensor.supply_v" => &["sensor.supply_nominal_v=2.9"],
        "sensor.supply_nominal_v" => &["sensor.supply_v=2.9"],
        "link.fifo_rows" | "link.when_full" => &["link.fifo_rows=4", "link.when_full=stall"],
        "sensor.pixel.hot_dark_e_per_s" | "sensor.pixel.defect_cluster_share" => &["sensor.pixel.hot_ppm=1000.0"],
        _ => &[],
    }
}

/// Nothing is held: what an architect meets who compares converters.
#[test]
fn designs_of_four_and_of_ten_bits_see_the_same_photons_as_they_stand() {
    let plain = photons(&[]);
    for assignments in [
        &["sensor.adc.bits=4"][..],
        &["sensor.adc.bits=12", "sensor.adc.gain=8.0"],
        &["sensor.adc.full_scale_uv=20000.0", "sensor.adc.black_level_dn=0"],
        &["sensor.pixel.read_noise_uv=900.0", "sensor.pixel.conversion_gain_uv_per_e=60.0"],
        &["run.rung=clocked", "seed=9", "link.mode=features", "run.effects=none"],
    ] {
        assert!(photons(assignments) == plain, "{assignments:?}");
    }
    // Two figures of the sensor stand in the render's keys unless these are given, and the effective configuration says which.
    let other = ["sensor.pixel.quantum_efficiency=0.2"];
    assert!(photons(&other) != plain);
    let stated = |assignments: &[String]| {
        let run = Resolved::from_layers("photons.toml", TEXT, assignments).unwrap().scenario.run;
        (run.render_quantum_efficiency.unwrap(), run.render_full_well_e.unwrap())
    };
    let (efficiency, full_well_e) = stated(&[]);
    assert!((efficiency - 0.54).abs() < 1e-12 && full_well_e == 10_000.0, "{efficiency} {full_well_e}");
    let (efficiency, _) = stated(&other.map(str::to_owned));
    assert!((efficiency - 0.18).abs() < 1e-12, "{efficiency}");
    assert!(photons(&[other[0], "run.render_quantum_efficiency=0.54"]) == plain, "the stated key holds the photons");
}
