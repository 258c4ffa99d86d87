//! Whole runs over links that send rows now and then, flip bits, or are slower than the readout.

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::link::{Mode, PlannedPacket, decode};
use sensel::num::f64_from_u64;
use sensel::report::Report;
use sensel::report::html::{FramePictures, html};
use sensel::run::{NoClock, NoProgress, SensorSetup, Session, Setup};

use crate::common::assets::KeptBakes;

const BOX: &str = include_str!("../../scenes/box/scene.toml");
/// A ninth of VGA: small, with some sixty corners.
const SMALL: [&str; 4] = ["sensor.width=208", "sensor.height=160", "run.samples_per_pixel=4", "scene.bake=direct"];

fn resolved(set: &[&str]) -> Resolved {
    let set: Vec<String> = SMALL.iter().chain(set).map(|&assignment| assignment.to_owned()).collect();
    Resolved::from_layers("box", BOX, &set).unwrap()
}

/// A run of the small box before its first frame.
pub fn session(set: &[&str]) -> Result<Session, Error> {
    Session::new(Setup::new(resolved(set), &KeptBakes, &NoProgress)?)
}

/// Report, and all packets of both cameras as they arrived.
fn run(frames: u32, set: &[&str]) -> (Report, [Vec<u8>; 2]) {
    let mut session = session(set).unwrap();
    let mut packets = [Vec::new(), Vec::new()];
    for _ in 0..frames {
        let frame = session.step(&NoClock).unwrap();
        for (all, camera) in packets.iter_mut().zip(&frame.cameras) {
            all.extend_from_slice(&camera.packets);
        }
    }
    (session.report("box").unwrap(), packets)
}

#[test]
fn rows_every_third_frame_save_bits_and_energy_and_no_feature() {
    let (every, _) = run(7, &[]);
    let (third, packets) = run(7, &["link.frames_every=3"]);
    for (one, other) in [
        (&every.hashes.photons, &third.hashes.photons),
        (&every.hashes.codes, &third.hashes.codes),
        (&every.hashes.features, &third.hashes.features),
    ] {
        assert_eq!(one, other);
    }
    assert_eq!((every.link.frames_with_rows, third.link.frames_with_rows), (14, 6));
    assert_eq!(every.tracking.ate_m, third.tracking.ate_m);
    assert_eq!(every.features, third.features);
    assert!(third.features.median_tracked.unwrap() > 12.0, "{:?}", third.features);
    for bytes in &packets {
        let decoded = decode(bytes);
        assert!(decoded.counts.clean() && decoded.frames.iter().all(|frame| frame.whole));
        let carried: Vec<bool> = decoded.frames.iter().map(|frame| frame.picture.is_some()).collect();
        assert_eq!(carried, [true, false, false, true, false, false, true]);
        assert!(decoded.frames.iter().all(|frame| !frame.features.is_empty()));
    }
    let (all, some) = (&every.bandwidth, &third.bandwidth);
    assert!((some.container_bits_per_frame - all.container_bits_per_frame * 3.0 / 7.0).abs() < 1e-6);
    // Four of seven frames leave out 160 rows of 266 bytes per camera, and their features need no more headers than one a feature.
    let saved_bits = (all.link_bits_per_s - some.link_bits_per_s) / third.timing.fps;
    let rows_bits = 4.0 / 7.0 * f64::from(2 * 160 * 266 * 8);
    let found: f64 = third.frames.iter().map(|frame| f64::from(frame.found)).sum::<f64>() / 7.0;
    assert!(saved_bits >= rows_bits - 1.0 && saved_bits < rows_bits + 18.0 * 8.0 * found, "{saved_bits}, {rows_bits}");
    assert!(third.energy.blocks.get("link").unwrap() < every.energy.blocks.get("link").unwrap());
    let html = html(&third, &FramePictures::default());
    assert!(html.contains("Frames that carried rows"));
}

#[test]
fn flipped_bits_are_counted_in_the_report_and_no_false_feature_reaches_the_tracker() {
    let (clean, _) = run(4, &[]);
    let (noisy, packets) = run(4, &["link.bit_error_rate=3e-5", "link.line_sync=true"]);
    let (again, same) = run(4, &["link.bit_error_rate=3e-5", "link.line_sync=true"]);
    assert_eq!(packets, same);
    assert_eq!(noisy.link, again.link);
    assert_eq!((clean.link.bits_flipped, clean.link.packets_refused, clean.link.frames_damaged), (0, 0, 0));
    // The sensor knows nothing of it.
    assert_eq!((&clean.hashes.codes, &clean.hashes.features), (&noisy.hashes.codes, &noisy.hashes.features));
    let link = &noisy.link;
    // Flips are Poisson in number: four standard deviations, the seed being fixed.
    let bits = 8.0 * packets.iter().map(|bytes| bytes.len() as f64).sum::<f64>();
    let expected = bits * 3e-5;
    let flipped = f64_from_u64(link.bits_flipped);
    assert!((flipped - expected).abs() < 4.0 * expected.sqrt(), "{flipped} flips, {expected} expected");
    println!("{link:?}");
    assert!(link.packets_refused > 20 && link.rows_lost > 20 && link.frames_damaged > 4);
    assert_eq!(link.packets_refused, link.headers_refused + link.payloads_refused + link.packets_cut_short);
    let html = html(&noisy, &FramePictures::default());
    for row in ["Bits flipped on the way", "Headers corrected", "Payloads refused", "Rows lost", "Frames damaged"] {
        assert!(html.contains(row), "{row}");
    }
}

#[test]
fn a_link_that_loses_almost_everything_ends_in_figures_and_not_in_an_error() {
    for mode in ["both", "frames", "features"] {
        let (report, _) = run(2, &["link.bit_error_rate=0.01", &format!("link.mode={mode}")]);
        assert!(report.link.bits_flipped > 1000, "{mode}: {:?}", report.link);
        assert_eq!(report.tracking.tracked_fraction, 0.0, "{mode}");
        assert!(report.to_json().is_ok());
    }
}

#[test]
fn a_readout_faster_than_its_link_is_refused_or_stalls() {
    // 208 columns, 10 bit, 40 MHz on one lane: a row's packet takes 260 + 6 bytes at 10 MHz and its way in and out.
    let slow = [
        "link.frequency_hz=40000000",
        "link.mode=frames",
        "sensor.readout.hts=960",
        "sensor.adc.bits=8",
        "sensor.adc.clock_hz=960000000",
    ];
    let refused = SensorSetup::new(&resolved(&slow)).unwrap_err().to_string();
    assert!(refused.contains("sensor.readout.hts") && refused.contains("packet"), "{refused}");
    let stalls: Vec<&str> = slow.into_iter().chain(["link.when_full=stall"]).collect();
    let setup = SensorSetup::new(&resolved(&stalls)).unwrap();
    let flow = setup.flow_of(0).unwrap();
    assert!(flow.rows_stalled > 100 && flow.fifo_rows_most == 1, "{flow:?}");
    // In a steady stall a row takes its packet's time.
    let packet = setup.link.line_packet_time(208, 8).unwrap().0;
    assert_eq!(flow.rows_end.0 - flow.lead.0, 159 * packet - setup.link.burst_exit().0);
    let late_s = setup.row_delays_s().unwrap();
    assert_eq!(late_s.len(), 160);
    assert!(late_s.windows(2).all(|pair| pair[0] <= pair[1]));
    // A FIFO of all rows takes them as they come.
    let deep: Vec<&str> = slow.into_iter().chain(["link.fifo_rows=160"]).collect();
    let setup = SensorSetup::new(&resolved(&deep)).unwrap();
    let flow = setup.flow_of(0).unwrap();
    assert!(flow.stalled.0 == 0 && flow.fifo_rows_most > 2, "{:?}", flow.fifo_rows_most);
    assert!(setup.row_delays_s().unwrap().is_empty());
    // The depth that was needed is enough, and one row less is not.
    let most = flow.fifo_rows_most;
    for (fifo_rows, stalls) in [(most, false), (most - 1, true)] {
        let depth = format!("link.fifo_rows={fifo_rows}");
        let set: Vec<&str> = slow.into_iter().chain(["link.when_full=stall", &depth]).collect();
        let flow = SensorSetup::new(&resolved(&set)).unwrap().flow_of(0).unwrap();
        assert_eq!(flow.rows_stalled > 0, stalls, "{depth}");
    }
    let rolling: Vec<&str> = stalls.iter().copied().chain(["sensor.readout.shutter=rolling"]).collect();
    let refused = SensorSetup::new(&resolved(&rolling)).unwrap_err().to_string();
    assert!(refused.contains("link.when_full") && refused.contains("rolling"), "{refused}");
}

#[test]
fn rows_that_wait_in_a_stall_leak_longer() {
    let slow = [
        "link.frequency_hz=40000000",
        "sensor.readout.hts=960",
        "sensor.adc.bits=8",
        "link.mode=frames",
        "sensor.adc.clock_hz=960000000",
        "link.when_full=stall",
        "sensor.pixel.storage_dark_e_per_s=50000.0",
    ];
    let (stalled, _) = run(1, &slow);
    let deep: Vec<&str> = slow.into_iter().chain(["link.fifo_rows=160"]).collect();
    let (deep, _) = run(1, &deep);
    assert!(stalled.link.rows_stalled > 200 && deep.link.rows_stalled == 0, "{:?}", stalled.link);
    assert!(stalled.link.stalled_us_per_frame > 100.0);
    let (late, soon) = (stalled.frames[0].mean_code_dn, deep.frames[0].mean_code_dn);
    assert!(late > soon, "{late} DN after a wait, {soon} without");
}

#[test]
fn the_configurations_order_of_packets_is_that_of_the_stream() {
    let setup = SensorSetup::new(&resolved(&[])).unwrap();
    assert_eq!(setup.link.mode, Mode::Both);
    let flow = setup.flow_of(200).unwrap();
    let (first, last) = (flow.sent.first().unwrap(), flow.sent.last().unwrap());
    assert_eq!((first.packet, last.packet), (PlannedPacket::FrameStart, PlannedPacket::FrameEnd));
    let times = setup.link_times(200).unwrap();
    assert!(times.feature_latency_s.unwrap() < times.tail_s && times.stalled_s == 0.0);
    // Spread over the height, features are nearly all gone when the last row is read; the rest waits for the extractor.
    let behind = |sent: &&sensel::link::Sent| sent.start >= flow.rows_end;
    let count =
        |sent: &sensel::link::Sent| if let PlannedPacket::Features { count, .. } = sent.packet { count } else { 0 };
    let waiting: u32 = flow.sent.iter().filter(behind).map(count).sum();
    assert!((1..100).contains(&waiting), "{waiting} of 200 behind the rows");
    let last_row_s = 159.0 * setup.schedule.line_time_s();
    assert!(last_row_s + times.last_bit_s > times.last_feature_s.unwrap(), "{times:?}");
}
