//! What a run says of its time: latency to the last bit on the lanes, clocks of the extractor, features that the link has no time for,
//! and first frames that are like all others.

use sensel::draw::mix;
use sensel::link::PlannedPacket;
use sensel::num::{f64_from_u64, greater};
use sensel::report::record::Timing;
use sensel::run::{CameraFrame, NoClock, Session};
use sensel::units::{Clocks, FrameIndex, RowIndex};

use super::runs::session;

/// From the middle of a frame's exposure to the last bit of its last packet, from the packets of the stream and the sensor's schedule
/// alone. Every packet of features must wait for the last of its own.
fn last_bit_s(session: &Session, frame: FrameIndex, camera: &CameraFrame) -> f64 {
    let sensor = &session.setup().sensor;
    let (schedule, link) = (&sensor.schedule, &sensor.link);
    let packets = sensor.packets(frame, &sensor.batches(&camera.features_clk)).unwrap();
    let flow = sensor.flow_at(&packets, &camera.features_clk).unwrap();
    assert_eq!(flow.sent.iter().map(|sent| sent.bytes).sum::<u64>(), camera.packets.len() as u64);
    let behind_lanes_s = if schedule.shift_lane_clk().0 > 0 { schedule.line_time_s() } else { 0.0 };
    let first_row_s = schedule.slot_readout(frame, schedule.slots().len() - 1, RowIndex(0)).end_s + behind_lanes_s;
    let on_lanes_s = |clk: Clocks| first_row_s + link.seconds(clk) - link.seconds(flow.lead);
    let (rate_hz, byte_s) = (f64_from_u64(sensor.compute_hz), link.seconds(Clocks(1)));
    for sent in &flow.sent {
        if let PlannedPacket::Features { first, count, .. } = sent.packet {
            let own = &camera.features_clk[first as usize..(first + count) as usize];
            let whole_s = own.last().map_or(0.0, |&clk| first_row_s + f64_from_u64(clk + 1) / rate_hz);
            assert!(on_lanes_s(sent.start) > whole_s - 1e-3 * byte_s, "{sent:?} before its last feature");
        }
    }
    let last = flow.sent.iter().map(|sent| sent.data_end).max_by_key(|clk| clk.0).unwrap();
    on_lanes_s(last) - schedule.t_frame(frame)
}

/// Steps follow each other from the middle of the exposure; the link ends with the latency, and the pose comes after the host's work.
fn check_waterfall(timing: &Timing, has_host: bool) {
    let steps = &timing.waterfall.frame;
    assert!(steps[0].start_us.abs() < 1e-6 && steps.iter().all(|step| step.end_us > step.start_us), "{steps:?}");
    for steps in [steps, &timing.waterfall.first_feature] {
        assert!(steps.windows(2).all(|pair| pair[0].end_us == pair[1].start_us), "{steps:?}");
    }
    let link = steps.iter().find(|step| step.step == "link").unwrap();
    assert!((link.end_us - timing.latency_us).abs() < 1e-3, "{steps:?} for {}", timing.latency_us);
    let last = steps.last().unwrap();
    assert_eq!(timing.waterfall.pose_us, has_host.then_some(last.end_us));
    assert_eq!(last.step == "tracker", has_host);
}

#[test]
fn latency_ends_with_the_last_bit_of_the_last_packet_whatever_link_and_extractor() {
    let seed = 20_u64;
    let (mut ran, mut stalled, mut behind, mut over) = (0, 0, 0, 0);
    // What no sensor can be is refused before its light is baked, and another case takes its place.
    for case in 0..200_u64 {
        if ran == 30 {
            break;
        }
        let pick = |what: u64, from: &[&str]| {
            let number = mix(mix(mix(seed) ^ case) ^ what) % from.len() as u64;
            from[number as usize].to_owned()
        };
        let set = [
            pick(1, &["link.mode=both", "link.mode=features", "link.mode=frames", "link.mode=both"]),
            pick(2, &["link.frequency_hz=240000000", "link.frequency_hz=60000000", "link.frequency_hz=40000000"]),
            pick(3, &["link.when_full=stall", "link.when_full=refuse"]),
            pick(4, &["link.lanes=1", "link.lanes=2", "link.lanes=4"]),
            pick(5, &["compute.engines=1", "compute.engines=2", "compute.engines=4"]),
            pick(6, &["compute.target_features=0", "compute.target_features=30", "compute.target_features=500"]),
            pick(7, &["compute.octaves=1", "compute.octaves=2", "compute.smoothing=binomial"]),
            pick(8, &["sensor.readout.hts=928", "sensor.readout.hts=640", "sensor.readout.hts=1111"]),
            pick(9, &["compute.threshold=2", "compute.threshold=12"]),
            pick(10, &["sensor.adc.bits=8", "sensor.adc.bits=10"]),
            pick(11, &["seed=1", "compute.clock_hz=30000000", "compute.clock_hz=77777777", "host.model=none"]),
        ];
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let Ok(mut session) = session(&set) else { continue };
        let (mut latency_s, mut stamped_s, mut required_clk, mut over_here) = (0.0, 0.0, 0, 0);
        for _ in 0..2 {
            let frame = session.step(&NoClock).unwrap();
            for camera in &frame.cameras {
                latency_s = greater(latency_s, last_bit_s(&session, frame.frame, camera));
                let own_clk = camera.features_clk.last().map_or(0, |clk| clk + 1);
                required_clk = required_clk.max(own_clk);
                over_here += u64::from(own_clk > session.setup().sensor.extractor_clk_available());
                // The stream's own time stamps.
                let sent: u64 = camera.packet_times.iter().map(|packet| packet.bytes).sum();
                let stamp_s = camera.packet_times.iter().map(|packet| packet.last_bit_s).fold(0.0, greater);
                stamped_s = greater(stamped_s, stamp_s - session.setup().sensor.schedule.t_frame(frame.frame));
                assert_eq!(sent, camera.packets.len() as u64);
            }
        }
        let report = session.report("box").unwrap();
        let byte_us = 1e6 * session.setup().sensor.link.seconds(Clocks(1));
        let apart_us = (report.timing.latency_us - 1e6 * latency_s).abs();
        // Rows are read at whole byte clocks, rounded up.
        assert!(apart_us < 1.01 * byte_us, "seed {seed}, case {case}, {set:?}: {apart_us} us off");
        // Equal to the rounding of seconds of a run.
        assert!((report.timing.latency_us - 1e6 * stamped_s).abs() < 1e-3, "case {case}, {set:?}: {stamped_s}");
        check_waterfall(&report.timing, session.setup().sensor.host.is_some());
        if let Some(clocks) = report.timing.extractor {
            assert!(clocks.required >= required_clk && clocks.frames_over >= over_here, "{clocks:?}");
            assert_eq!(clocks.frames_over > 0, clocks.required > clocks.available, "{clocks:?}");
            assert_eq!(clocks.frames_over > 0, report.warnings.iter().any(|text| text.contains("extractor needed")));
            over += u32::from(clocks.frames_over > 0);
        }
        ran += 1;
        stalled += u32::from(report.link.rows_stalled > 0);
        behind += u32::from(report.timing.last_feature_us.is_some_and(|last_us| last_us > 100.0));
    }
    println!(
        "seed {seed}: {ran} ran, {stalled} stalled, {behind} had features 100 us behind the rows, {over} too many clocks"
    );
    assert!(ran == 30 && stalled >= 3 && behind >= 2, "seed {seed}: {ran} ran, {stalled} stalled, {behind} behind");
}

#[test]
fn an_extractor_that_can_need_more_clocks_than_a_frame_has_is_warned_of_beforehand() {
    // One engine makes a feature in 300 clocks: 320 in a frame of 96,000, of which the first 22,000 pass before a row of cells is whole.
    // Two octaves have room for 412.
    let short =
        ["sensor.readout.hts=480", "sensor.readout.vts=200", "sensor.readout.exposure_us=500.0", "link.lanes=4"];
    let many = [
        "compute.engines=1",
        "compute.octaves=2",
        "compute.target_features=0",
        "compute.threshold=1",
        "compute.overflow=stall",
    ];
    let set: Vec<&str> = short.into_iter().chain(many).collect();
    let mut session = session(&set).unwrap();
    let before = session.setup().sensor.extractor_warning().unwrap();
    assert!(before.contains("can need") || before.contains("needs"), "{before}");
    for _ in 0..2 {
        session.step(&NoClock).unwrap();
    }
    let report = session.report("box").unwrap();
    let clocks = report.timing.extractor.unwrap();
    // What it took is told; here the frame is long enough for the features that the picture has.
    assert_eq!(clocks.available, 480 * 200);
    assert_eq!((clocks.frames_over, clocks.required > clocks.available), (0, false), "{clocks:?}");
    assert!(report.warnings.iter().all(|text| !text.contains("extractor needed")));
    let usual = self::session(&[]).unwrap();
    assert_eq!(usual.setup().sensor.extractor_warning(), None);
}

#[test]
fn frames_that_the_extractor_overruns_are_counted_and_warned_of() {
    // Some 350 features of 300 clocks each in a frame of 62,656.
    let set = [
        "sensor.readout.hts=356",
        "sensor.readout.vts=176",
        "sensor.readout.exposure_us=500.0",
        "scene.illuminance_lux=4000.0",
        "compute.engines=1",
        "compute.target_features=0",
        "compute.threshold=1",
        "link.lanes=4",
    ];
    for overflow in ["stall", "drop_newest"] {
        let overflow_set = format!("compute.overflow={overflow}");
        let all: Vec<&str> = set.iter().copied().chain([overflow_set.as_str()]).collect();
        let mut session = session(&all).unwrap();
        let mut over = 0;
        for _ in 0..3 {
            let frame = session.step(&NoClock).unwrap();
            let late = |camera: &&CameraFrame| camera.features_clk.last().is_some_and(|&clk| clk >= 356 * 176);
            over += frame.cameras.iter().filter(late).count() as u64;
        }
        let report = session.report("box").unwrap();
        let clocks = report.timing.extractor.unwrap();
        println!("{overflow}: {clocks:?}, {over} frames with a feature after their end");
        if overflow == "stall" {
            assert!(over > 0 && clocks.frames_over >= over && clocks.required > clocks.available, "{clocks:?}");
            assert!(report.warnings.iter().any(|text| text.contains("extractor needed")), "{:?}", report.warnings);
        } else {
            assert!(report.features.lost > 0.0, "what does not fit is dropped, and counted: {:?}", report.features);
        }
    }
}

#[test]
fn short_runs_have_the_power_of_long_ones_because_no_threshold_warms_up() {
    let set = ["compute.threshold=2", "compute.target_features=40", "link.mode=features"];
    let mut session = session(&set).unwrap();
    let (mut power_mw, mut corners) = (Vec::new(), Vec::new());
    for frame in 1..=20 {
        let found = session.step(&NoClock).unwrap();
        corners.push(found.cameras[0].features.len());
        if [1, 2, 4, 20].contains(&frame) {
            power_mw.push(session.energy().power_mw());
        }
    }
    let long = power_mw[3];
    // The threshold holds corners within an eighth of the target, and features are a tenth of this sensor's energy or less.
    let same = power_mw.iter().all(|short| (short / long - 1.0).abs() < 0.01);
    assert!(same, "{power_mw:?} mW after 1, 2, 4 and 20 frames, {corners:?} features");
    let (least, most) = (*corners.iter().min().unwrap(), *corners.iter().max().unwrap());
    assert!(least * 3 > most && corners[0] > 20, "{corners:?}");
}
