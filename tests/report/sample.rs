//! A report as a run of ten seconds would make it, from closed forms, so that the page can be judged without a run.

use glam::{DQuat, DVec3};
use sensel::config::Resolved;
use sensel::energy::EnergyAccount;
use sensel::events::{Event, Events};
use sensel::plane::Plane;
use sensel::pose::{Pose, TimedPose};
use sensel::report::html::{FramePicture, FramePictures, Mark};
use sensel::report::latency_record::{LatencyStep, Waterfall};
use sensel::report::record::{
    Bandwidth, ExtractorClocks, FactRecord, FeatureFigures, FrameRecord, Hashes, LinkRecord, OmittedEffect, Phase,
    PlanRecord, SCHEMA_VERSION, Scenario, StageCost, TileRecord, Timing, Tracking, TrackingEvent,
};
use sensel::report::{Report, trajectory_figures};
use sensel::units::Size;

const FRAMES: u32 = 300;
const RATE_HZ: f64 = 30.0;
/// The tracker is lost in these frames.
const LOST: std::ops::Range<u32> = 180..186;

fn truth_m(t_s: f64) -> DVec3 {
    DVec3::new(
        0.8 * libm::sin(0.7 * t_s) + 0.05 * libm::sin(5.0 * t_s),
        1.5 + 0.03 * libm::sin(12.0 * t_s),
        0.6 * libm::cos(0.9 * t_s) + 0.2 * t_s,
    )
}

fn error_m(t_s: f64) -> DVec3 {
    0.004 * DVec3::new(libm::sin(3.0 * t_s), libm::sin(41.0 * t_s), libm::cos(1.3 * t_s) + 0.3 * libm::sin(60.0 * t_s))
}

fn poses(position_m: impl Fn(f64) -> DVec3) -> Vec<TimedPose> {
    let pose = |i: u32| {
        let t_s = f64::from(i) / RATE_HZ;
        TimedPose { t_s, world_from_body: Pose::new(DQuat::IDENTITY, position_m(t_s)) }
    };
    (0..FRAMES).map(pose).collect()
}

fn frame(truth: &TimedPose) -> FrameRecord {
    let t_s = truth.t_s;
    let wave = libm::sin(1.1 * t_s) + 0.3 * libm::sin(17.0 * t_s);
    FrameRecord {
        t_s,
        mean_code_dn: 310.0 + 55.0 * wave,
        exposure_us: 2000.0,
        gain: 1.0,
        found: sensel::num::u32_truncated(905.0 + 60.0 * wave),
        tracked: sensel::num::u32_truncated(240.0 + 45.0 * wave),
        innovation_px: Some(0.42),
        orientation_deg: Some(0.2),
        truth_m: truth.world_from_body.translation_m.to_array(),
        ..FrameRecord::default()
    }
}

pub fn report() -> Report {
    let truth = poses(truth_m);
    let mut estimate = poses(|t_s| truth_m(t_s) + error_m(t_s) + DVec3::new(2.0, 0.0, -1.0));
    estimate.retain(|pose| !LOST.contains(&sensel::num::u32_truncated(pose.t_s * RATE_HZ + 0.5)));
    let figures = trajectory_figures(&truth, &estimate);
    let mut report = Report {
        schema_version: SCHEMA_VERSION,
        version: "0.1.0".to_owned(),
        seed: 1,
        config_hash: "5f0c9a6e2f7d4f0b8d7c1a9b3e5d7f91".to_owned(),
        scenario: scenario(figures.as_ref().unwrap().path_m),
        plan: plan(),
        timing: timing(),
        bandwidth: bandwidth(),
        energy: energy_record(),
        features: FeatureFigures {
            median_found: Some(452.0),
            median_tracked: Some(241.0),
            min_tracked: Some(0),
            corners: 1310.0,
            without_patch: 96.0,
            unselected: 858.0,
            lost: 0.0,
            dropped: 0.0,
            late: 0.0,
            stalled_clk: 120.0,
            not_ready_clk: 344.0,
            threshold: Some(20),
        },
        tracking: Tracking { tracked_fraction: 0.98, ms_per_frame: 7.9, ..Tracking::default() },
        link: LinkRecord {
            packets: 289_200,
            frames_with_rows: 600,
            fifo_rows_most: 1,
            feature_latency_us: Some(91.7),
            ..LinkRecord::default()
        },
        hashes: hashes(),
        cost: cost(),
        frames: truth.iter().map(frame).collect(),
        config: "seed = 1\n\n[scene]\nfile = \"bathroom.glb\"\nilluminance_lux = 300.0\n\n[sensor]\npreset = \
         \"paper_6t_vga\"\n"
            .parse()
            .unwrap(),
        ..Report::default()
    };
    report.set_trajectory(figures, 1.0);
    report.tracking.prediction_error_m = Some(0.0061);
    report.tracking.innovation_px = Some(0.42);
    report.tracking.orientation_deg = Some(0.2);
    for steps in ["frame", "first_feature"] {
        let reason = "a step without a limit has no slack".to_owned();
        report.not_measurable.insert(format!("timing.waterfall.{steps}.slack_us"), reason);
    }
    report.tracking.single_picture_sigma_m = Some(0.0009);
    report.tracking.relocalise_s = Some(0.2);
    let event = |(frame, t_s), event: &str, reason: Option<&str>| {
        let (event, reason) = (event.to_owned(), reason.map(str::to_owned));
        TrackingEvent { frame: Some(frame), t_s, event, reason }
    };
    report.tracking.events = vec![
        event((0, 0.0), "initialised", None),
        event((80, 4.0), "lost", Some("no credible pose, neither near the prediction nor by descriptors")),
        event((84, 4.2), "relocalised", None),
    ];
    report
}

fn scenario(path_m: f64) -> Scenario {
    Scenario {
        name: "A walk through the furnished bathroom".to_owned(),
        scene: "bathroom.glb".to_owned(),
        scene_notes: Vec::new(),
        illuminance_lux: 300.0,
        illuminant: "D65".to_owned(),
        light: "after all bounces".to_owned(),
        motion: "head motion of tum_vi_room1.txt".to_owned(),
        motion_notes: Vec::new(),
        motion_scale: 0.35,
        path_m,
        duration_s: 10.0,
        frames: FRAMES,
        cameras: 2,
        baseline_mm: 65.0,
        sensor: "paper_6t_vga".to_owned(),
        width_px: 640,
        height_px: 480,
        bits: 10,
        shutter: "global".to_owned(),
        exposure_us: 2000.0,
        optics: "pinhole_90, f/2".to_owned(),
        rung: "sampled".to_owned(),
        samples_per_pixel: 4.2,
        render_variance_ratio: Some(0.31),
    }
}

fn plan() -> PlanRecord {
    let omitted = |name: &str, bias_e, sigma_e, reason: &str| OmittedEffect {
        name: name.to_owned(),
        bias_e: Some(bias_e),
        sigma_e: Some(sigma_e),
        budget_share: Some(0.02),
        cost_ns_per_px: 0.6,
        reason: reason.to_owned(),
    };
    PlanRecord {
        kept: ["prnu", "photon_noise", "full_well", "read_noise", "column_offset"].map(str::to_owned).to_vec(),
        kept_reasons: [("prnu", "1 % of 5000 e- is 50 e- between pixels".to_owned())].into_iter().collect(),
        omitted: vec![
            omitted("dark_current", 0.02, 0.14, "0.02 e- in 2 ms at 300 K"),
            omitted("storage_leakage", 0.000_12, 0.011, "0.00012 e- in at most 35.9 ms of storage at 300 K"),
            omitted("ktc", 0.0, 0.0, "6T with correlated double sampling removes it"),
        ],
        bias_e: Some(0.020_12),
        sigma_e: Some(0.141),
        accuracy: 0.1,
        budget_e: 1.05,
        budget_used: Some(0.02),
        cost_ns_per_px: 5.9,
        cost_of_all_ns_per_px: 6.5,
        cost_of_none_ns_per_px: 2.0,
        sensor_ms_per_frame: 4.9,
        facts: vec![
            FactRecord {
                name: "depth_m".to_owned(),
                least: 0.4,
                greatest: Some(4.55),
                how: "boxes around the path".to_owned(),
            },
            FactRecord {
                name: "speed_m_per_s".to_owned(),
                least: 0.0,
                greatest: Some(0.77),
                how: "control poses".to_owned(),
            },
        ],
        tiles: vec![TileRecord { columns: [0, 640], rows: [0, 480], signal_e: [0.0, 21_000.0] }],
    }
}

fn waterfall() -> Waterfall {
    let step =
        |step: &str, start_us, end_us, slack_us| LatencyStep { step: step.to_owned(), start_us, end_us, slack_us };
    Waterfall {
        frame: vec![
            step("exposure", 0.0, 1000.0, None),
            step("wait for the row", 1000.0, 10_260.0, None),
            step("conversion", 10_260.0, 10_267.4, Some(11.9)),
            step("extractor", 10_267.4, 10_320.0, Some(23_916.0)),
            step("link", 10_320.0, 10_600.0, Some(22_700.0)),
            step("host decoding", 10_600.0, 10_900.0, Some(33_030.0)),
            step("tracker", 10_900.0, 14_000.0, Some(29_930.0)),
        ],
        first_feature: vec![step("exposure", 0.0, 1000.0, None), step("conversion", 1000.0, 1640.0, None)],
        pose_us: Some(14_000.0),
        features: 500,
        cameras: 2,
        host: "single_board_computer".to_owned(),
        measured_host_us: Some(2100.0),
    }
}

fn timing() -> Timing {
    let phase = |lane: &str, name: &str, start_us, end_us| Phase {
        lane: lane.to_owned(),
        name: name.to_owned(),
        start_us,
        end_us,
    };
    Timing {
        line_time_us: 19.333,
        frame_time_us: 33_330.7,
        fps: 30.0024,
        latency_us: 10_320.0,
        feature_latency_us: Some(71.4),
        first_feature_us: Some(640.0),
        last_feature_us: Some(57.0),
        extractor: Some(ExtractorClocks {
            required: 452_000,
            required_mean: 451_000.0,
            available: 1_599_872,
            clock_hz: 48_000_000,
            frames_over: 0,
            keeps_up: true,
            queue_most: Some(3),
            queue_depth: 16,
            remedy: String::new(),
        }),
        waterfall: waterfall(),
        clocks_per_frame: 1_599_872,
        line: vec![
            phase("row n", "settle reset", 0.0, 2.0),
            phase("row n", "reset ramp", 2.0, 2.267),
            phase("row n", "settle signal", 2.267, 5.267),
            phase("row n", "signal ramp", 5.267, 7.4),
            phase("row n\u{2212}1", "shift out", 0.0, 13.35),
            phase("link", "RAW10 packet", 0.8, 14.6),
        ],
        frame: vec![
            phase("pixels", "exposure", 0.0, 2000.0),
            phase("rows", "readout", 2000.0, 11_280.0),
            phase("link", "pixels", 2019.0, 11_300.0),
            phase("link", "features", 11_300.0, 11_600.0),
        ],
    }
}

fn bandwidth() -> Bandwidth {
    Bandwidth {
        raw_bits_per_frame: 6_144_000.0,
        container_bits_per_frame: 6_144_000.0,
        feature_bits_per_frame: 275_800.0,
        link_bits_per_s: 195_400_000.0,
        reduction: Some(6_144_000.0 / 275_800.0),
        link_utilisation: 0.204,
        link_utilisation_burst: 0.71,
    }
}

fn energy() -> EnergyAccount {
    let (frames, pixels) = (u64::from(FRAMES), 2 * 640 * 480_u64);
    let mut events = Events::default();
    for (event, per_frame) in [
        (Event::PixelReset, pixels),
        (Event::ChargeTransfer, 2 * pixels),
        (Event::ColumnSettle, 2 * pixels),
        (Event::ComparatorClock, pixels * 480),
        (Event::CounterStep, pixels * 410),
        (Event::RampStep, 2 * 480 * 1152),
        (Event::RowSelect, 2 * 480),
        (Event::ReadoutBit, pixels * 20),
        (Event::LineBufferWrite, pixels * 2),
        (Event::LineBufferRead, pixels * 14),
        (Event::ComputeOp, pixels * 40),
        (Event::ComputeMac, 900 * 700),
        (Event::LinkByte, 802_000),
        (Event::LinkBurst, 964),
    ] {
        events.add(event, per_frame * frames);
    }
    let resolved = Resolved::from_layers("sample", "", &[]).expect("the defaults hold");
    let sensor = sensel::run::SensorSetup::new(&resolved).expect("the defaults are a sensor");
    EnergyAccount::of(&events, FRAMES, 2, pixels, &sensor.power)
}

/// The account with the power of a line.
fn energy_record() -> sensel::report::energy_record::EnergyRecord {
    let resolved = Resolved::from_layers("sample", "", &[]).expect("the defaults hold");
    let sensor = sensel::run::SensorSetup::new(&resolved).expect("the defaults are a sensor");
    let line = Some(sensor.line_power().expect("its rows pass"));
    sensel::report::energy_record::EnergyRecord { line, ..(&energy()).into() }
}

fn hashes() -> Hashes {
    let hash = |letter: char| letter.to_string().repeat(64);
    Hashes { photons: hash('a'), codes: hash('b'), features: hash('c'), energy: hash('d'), poses: hash('e') }
}

fn cost() -> sensel::report::Ordered<StageCost> {
    let stages =
        [("scene", 118.0), ("pixel and adc", 9.1), ("compute", 3.9), ("link", 1.2), ("tracker", 7.9), ("report", 0.4)];
    stages.into_iter().map(|(name, ms_per_frame)| (name, StageCost { ms_per_frame })).collect()
}

/// Tiles in perspective with a shaded ball: enough to judge how marks stand out.
fn shade(x: f64, y: f64, shift: f64) -> f64 {
    let (dx, dy) = (x - 420.0 + shift, y - 200.0);
    let radius = libm::hypot(dx, dy);
    if radius < 90.0 {
        return 40.0 + 190.0 * (1.0 - libm::hypot(dx + 30.0, dy + 30.0) / 150.0).max(0.0);
    }
    let depth = if y > 260.0 { 4000.0 / (y - 240.0) } else { 30.0 + 0.02 * y };
    let across = libm::floor(((x - 320.0) * depth + shift * 40.0) / 1500.0);
    let along = libm::floor(depth / 12.0 + if y > 260.0 { 0.0 } else { libm::floor(y / 50.0) });
    let tile = (across + along).rem_euclid(2.0);
    (60.0 + 120.0 * tile) * (1.0 - libm::hypot(x - 320.0, y - 240.0) / 700.0)
}

pub fn pictures() -> FramePictures {
    let size = Size { width_px: 640, height_px: 480 };
    let picture = |(caption, shift): (&str, f64)| {
        let value = |i: usize| {
            let (x, y) = (sensel::num::f64_from_usize(i % 640), sensel::num::f64_from_usize(i / 640));
            sensel::num::u8_clipped(sensel::num::i32_truncated(shade(x, y, shift)))
        };
        let values = Plane::from_values(size, (0..size.pixel_count()).map(value).collect());
        let mark = |i: u32| Mark {
            x_px: f64::from(i * 7919 % 600) + 20.0,
            y_px: f64::from(i * 104_729 % 440) + 20.0,
            tracked: !i.is_multiple_of(3),
        };
        FramePicture { values, caption: caption.to_owned(), marks: (0..160).map(mark).collect() }
    };
    let frames = [
        ("Left camera, frame 0, 0.00 s", 0.0),
        ("Left camera, frame 150, 5.00 s", 40.0),
        ("Left camera, frame 299, 9.97 s", 90.0),
    ];
    FramePictures { strip: frames.into_iter().map(picture).collect(), waves: Some("waves.svg".to_owned()) }
}
