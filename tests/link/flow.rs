//! Packets in time: which leave when, what waits for what, and what the readout has to wait for.

use sensel::link::{
    Batch, FEATURE_BYTES, Flow, FrameOut, FramePlan, LinkParams, Mode, PlannedPacket, RowPeriod, after_the_rows,
    by_cell_row, decode, evenly,
};
use sensel::units::{Clocks, Size};

use super::{OV7251, codes, features, frame, packed};

/// Lines of the OV7251's VGA mode: 928 clocks at 48 MHz, 1160 byte clocks of its lane.
fn ov7251_period(params: &LinkParams) -> RowPeriod {
    RowPeriod::new(Clocks(928), 48_000_000, params)
}

fn plan(rows: u32, sends_codes: bool, batches: &[Batch], features_per_gap: u32) -> FramePlan<'_> {
    FramePlan { rows, sends_codes, batches: Some(batches), features_per_gap }
}

/// What holds for every frame: packets follow each other, each burst has its parts, rows are not sent before they are read.
fn assert_sound(flow: &Flow, params: &LinkParams, case: &str) {
    let mut free = Clocks(0);
    for sent in &flow.sent {
        assert!(sent.start >= free, "{case}: {sent:?} begins before {free:?}");
        assert_eq!(sent.data.0 - sent.start.0, params.burst_entry().0, "{case}");
        assert_eq!(sent.data_end.0 - sent.data.0, sent.bytes.div_ceil(params.lanes.into()), "{case}");
        assert_eq!(sent.end.0 - sent.data_end.0, params.burst_exit().0, "{case}");
        if let PlannedPacket::Row(row) = sent.packet {
            assert!(sent.start >= flow.row_read[row as usize], "{case}: row {row}");
        }
        free = sent.end;
    }
    let rows = flow.row_read.len();
    // A row is read only where a row that many rows before it has left.
    let left: Vec<Clocks> = flow
        .sent
        .iter()
        .filter(|sent| matches!(sent.packet, PlannedPacket::Row(_)))
        .map(|sent| sent.data_end)
        .collect();
    for row in params.fifo_rows as usize..rows {
        assert!(flow.row_read[row] >= left[row - params.fifo_rows as usize], "{case}: row {row}");
    }
    assert!(flow.fifo_rows_most <= params.fifo_rows, "{case}");
}

#[test]
fn features_leave_in_the_gaps_between_rows_and_never_make_a_row_wait() {
    let period = ov7251_period(&OV7251);
    // Gap: 1160 - 831 clocks; a burst's 25 and 6 + 12 bytes of headers leave 286 bytes: 7 features of 40.
    let per_gap = OV7251.features_per_gap(640, 10, period).unwrap();
    assert_eq!((FEATURE_BYTES, per_gap), (40, 7));
    let batches = by_cell_row((0..480).flat_map(|row| [row; 2]), 32, 16, 480);
    // 64 features per cell row of 32 rows, complete 16 rows below it; the last two cell rows with the last row.
    assert_eq!(batches[0], Batch { features: 64, after_row: 47 });
    assert_eq!((batches.len(), batches[14].after_row, batches[13].after_row), (15, 479, 463));
    let packets = OV7251.packets(&plan(480, true, &batches, per_gap));
    let flow = OV7251.flow(&packets, 480, 800, period);
    assert_sound(&flow, &OV7251, "gaps");
    assert_eq!((flow.stalled.0, flow.rows_stalled, flow.fifo_rows_most), (0, 0, 1));
    for (row, read) in (0..).zip(&flow.row_read) {
        let sent = flow.sent.iter().find(|sent| sent.packet == PlannedPacket::Row(row)).unwrap();
        assert_eq!(sent.start, *read, "row {row} waited");
        assert_eq!(read.0, flow.lead.0 + 1160 * u64::from(row));
    }
    // Feature packets: none before row 47, none larger than the gap but after the rows.
    let mut next = 0;
    for sent in &flow.sent {
        if let PlannedPacket::Features { first, count, last, after_row } = sent.packet {
            assert_eq!(first, next);
            next += count;
            assert!(after_row >= 47 && (count <= per_gap || after_row == 479));
            assert_eq!(last, next == 960);
        }
    }
    assert_eq!(next, 960);
    // After the last row: its packet, the features of the last cell row, one packet.
    let latency = flow.feature_latency().unwrap();
    assert_eq!(latency.0, 831 + 14 + 6 + 12 + 64 * 40);
}

#[test]
fn a_worked_example_has_the_clocks_that_the_documentation_gives() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/link.md")).unwrap();
    let period = ov7251_period(&OV7251);
    let per_gap = OV7251.features_per_gap(640, 10, period).unwrap();
    let batches = evenly(500, 32, 16, 480);
    let flow = OV7251.flow(&OV7251.packets(&plan(480, true, &batches, per_gap)), 480, 800, period);
    let mut rows = Vec::new();
    let mut tell = |name: &str, clocks: u64| {
        let us = 1e6 * OV7251.seconds(Clocks(clocks));
        rows.push(format!("| {name} | {clocks} | {us:.3} |"));
    };
    tell("frame start", OV7251.short_packet_time().0);
    tell("embedded line", OV7251.long_packet_time(40).0);
    tell("row: preparation and synchronisation byte", OV7251.burst_entry().0);
    tell("row: header, payload, checksum", 806);
    tell("row: trail and exit", OV7251.burst_exit().0);
    tell("from row to row", period.clocks(1).0);
    tell("gap behind a row", period.clocks(1).0 - OV7251.line_packet_time(640, 10).unwrap().0);
    tell("packet of 7 features", OV7251.long_packet_time(12 + 7 * 40).0);
    tell("last row read to last feature byte, 500 features", flow.feature_latency().unwrap().0);
    tell("last row read to the end of the frame, 500 features", flow.tail().0);
    tell("the same, all 500 after the rows", {
        let packets = OV7251.packets(&plan(480, true, &after_the_rows(500), per_gap));
        OV7251.flow(&packets, 480, 800, period).tail().0
    });
    for row in &rows {
        assert!(text.contains(row.as_str()), "docs/link.md does not have this row:\n{}", rows.join("\n"));
    }
}

#[test]
fn a_slow_link_stalls_the_readout_by_exactly_what_it_lacks() {
    // 400 Mbit/s instead of 480: a row's 831 clocks are more than the 773.3 from row to row at 50 MHz byte clock and 928 / 60 MHz.
    let mut tried = 0;
    for fifo_rows in [1, 2, 3, 8, 64] {
        for rows in [1, 2, 9, 100, 1000] {
            let params = LinkParams { frequency_hz: 200_000_000, fifo_rows, ..OV7251 };
            let period = RowPeriod::new(Clocks(928), 60_000_000, &params);
            let packets = params.packets(&plan(rows, true, &after_the_rows(3), 0));
            let flow = params.flow(&packets, rows, 800, period);
            let case = format!("{fifo_rows} places, {rows} rows");
            assert_sound(&flow, &params, &case);
            let packet = params.line_packet_time(640, 10).unwrap().0;
            // In a steady stall rows leave back to back: row i is read when row i - D has left.
            let wanted = |row: u64| {
                let free = i64::try_from(row).unwrap() - i64::from(fifo_rows);
                let left = u64::try_from(free).map_or(0, |free| (free + 1) * packet - params.burst_exit().0);
                left.max(period.clocks(row).0)
            };
            for (row, read) in (0..).zip(&flow.row_read) {
                assert_eq!(read.0, flow.lead.0 + wanted(row), "{case}: row {row}");
            }
            let stalls = rows > fifo_rows && wanted(u64::from(rows) - 1) > period.clocks(u64::from(rows) - 1).0;
            assert_eq!(flow.stalled.0 > 0, stalls, "{case}: {:?}", flow.stalled);
            let delays = flow.delays(period);
            assert_eq!(delays.last().unwrap().0, flow.stalled.0, "{case}");
            tried += u32::from(stalls);
        }
    }
    assert!(tried >= 8, "{tried} cases stalled");
}

#[test]
fn without_rows_features_leave_as_soon_as_they_are_made() {
    let params = LinkParams { frames_every: 3, ..OV7251 };
    let period = ov7251_period(&params);
    let batches = [Batch { features: 40, after_row: 47 }, Batch { features: 3, after_row: 479 }];
    let flow = params.flow(&params.packets(&plan(480, false, &batches, 0)), 480, 800, period);
    assert_sound(&flow, &params, "no rows");
    assert!(flow.row_read.is_empty() && flow.fifo_rows_most == 0);
    let starts: Vec<u64> = flow.sent.iter().map(|sent| sent.start.0).collect();
    let lead = flow.lead.0;
    let last = lead + 479 * 1160;
    assert_eq!(starts[2..4], [lead + 47 * 1160, last]);
    assert_eq!(flow.feature_latency().unwrap().0, 14 + 6 + 12 + 3 * 40);
}

#[test]
fn every_nth_frame_carries_rows_and_every_frame_features() {
    let (codes, list) = (codes(16, 40, 10), features(25));
    let batches = [Batch { features: 9, after_row: 10 }, Batch { features: 16, after_row: 39 }];
    let mut tried = 0;
    for (frames_every, line_sync) in [(1, false), (2, false), (3, true), (7, false)] {
        let params = LinkParams { frames_every, line_sync, ..OV7251 }.checked().unwrap();
        let size = codes.size();
        let (mut bytes, mut sent) = (Vec::new(), 0);
        for number in 0..2 * frames_every {
            let out = FrameOut { batches: &batches, features_per_gap: 4, ..frame(number, &codes, 10, &list) };
            let frame_bytes = packed(&out, &params);
            let traffic = params.traffic_of(&out.packets(&params), size, 10).unwrap();
            assert_eq!(traffic.link_bytes, frame_bytes.len() as u64);
            sent += traffic.link_bytes;
            bytes.extend(frame_bytes);
        }
        let decoded = decode(&bytes);
        assert!(decoded.counts.clean(), "{:?}", decoded.counts);
        for (number, received) in decoded.frames.iter().enumerate() {
            assert!(received.whole && received.features == list);
            let carries = number % frames_every as usize == 0;
            assert_eq!(received.picture.as_ref(), carries.then_some(&codes));
        }
        // Rows in their gaps cost a header more a packet than all features behind the rows.
        let first = params.traffic(size, 10, 25).unwrap();
        let without_rows = LinkParams { mode: Mode::Features, line_sync: false, frames_every: 1, ..params };
        let others = without_rows.traffic(size, 10, 25).unwrap();
        let cycle_bytes = first.link_bytes + u64::from(frames_every - 1) * others.link_bytes;
        assert!(sent >= 2 * cycle_bytes && sent < 2 * cycle_bytes + 2 * u64::from(frames_every) * 5 * 18);
        assert_eq!((first.container_bits, others.container_bits), (40 * 8 * 20, 0));
        tried += 1;
    }
    assert_eq!(tried, 4);
    for (params, key) in [
        (LinkParams { frames_every: 0, ..OV7251 }, "link.frames_every"),
        (LinkParams { frames_every: 2, mode: Mode::Frames, ..OV7251 }, "link.frames_every"),
        (LinkParams { fifo_rows: 0, ..OV7251 }, "link.fifo_rows"),
        (LinkParams { line_sync: true, mode: Mode::Features, ..OV7251 }, "link.line_sync"),
    ] {
        assert!(params.checked().unwrap_err().to_string().contains(key));
    }
}

#[test]
fn batches_keep_the_lists_order_and_lose_nothing() {
    let mut tried = 0;
    for cell_px in [8, 31, 4096] {
        for count in [0_u32, 1, 17, 500] {
            let batches = evenly(count, cell_px, 16, 120);
            assert_eq!(batches.iter().map(|batch| batch.features).sum::<u32>(), count);
            assert!(batches.windows(2).all(|pair| pair[0].after_row < pair[1].after_row));
            assert!(batches.iter().all(|batch| batch.after_row < 120));
            for per_gap in [0, 1, 5, 4096] {
                let packets = OV7251.packets(&plan(120, true, &batches, per_gap));
                let sent: u32 = packets
                    .iter()
                    .map(|packet| if let PlannedPacket::Features { count, .. } = packet { *count } else { 0 })
                    .sum();
                assert_eq!(sent, count, "cells of {cell_px}, {per_gap} a gap");
                let lasts =
                    packets.iter().filter(|packet| matches!(packet, PlannedPacket::Features { last: true, .. }));
                assert_eq!(lasts.count(), 1);
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 48);
    // A list that steps back waits with what came before it.
    assert_eq!(by_cell_row([50, 3].into_iter(), 8, 0, 64), [Batch { features: 2, after_row: 55 }]);
    let size = Size { width_px: 8, height_px: 3 };
    assert!(OV7251.traffic(size, 8, 1 << 32).is_err());
}
