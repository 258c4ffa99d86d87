//! The decoder written from the standard over streams that the link packs: all containers, lanes, modes, random shapes and pixels.

use std::path::Path;
use std::process::Command;

use sensel::compute::Feature;
use sensel::draw::mix;
use sensel::events::Events;
use sensel::files::picture::read_grey;
use sensel::link::{Batch, FrameMetadata, FrameOut, LinkParams, Mode, RawKind, pack_frame};
use sensel::plane::Plane;
use sensel::units::{FrameIndex, Size};

use super::{judge, root, scratch, text_of};
use sensel::words::{PositionPx, Turns};

/// Frames of one shape: their bytes, their pictures, the payload bytes of their feature packets, and their line starts.
struct Stream {
    size: Size,
    bytes: Vec<u8>,
    pictures: Vec<Option<Plane<u16>>>,
    feature_bytes: u64,
    line_starts: u64,
}

fn stream(seed: u64, kind: RawKind, mode: Mode) -> Stream {
    let draw = |field: u64| mix(mix(seed) ^ field);
    let below = |field: u64, bound: u64| u32::try_from(draw(field) % bound).unwrap();
    // Every container takes multiples of 8; RAW8 and RAW16 any width, RAW12 pairs, the others fours.
    let group = match kind {
        RawKind::Raw8 | RawKind::Raw16 => 1,
        RawKind::Raw12 => 2,
        RawKind::Raw6 | RawKind::Raw10 | RawKind::Raw14 => 4,
        RawKind::Raw7 => 8,
    };
    let size = Size { width_px: group * (1 + below(0, 90)), height_px: 1 + below(1, 30) };
    let frames_every = if mode == Mode::Both { 1 + below(2, 3) } else { 1 };
    let line_sync = mode.sends_codes() && below(3, 2) == 0;
    let lanes = 1 + below(4, 4);
    let params =
        LinkParams { format: Some(kind), frames_every, line_sync, ..LinkParams::new(lanes, 300_000_000, mode) };
    let mut stream = Stream { size, bytes: Vec::new(), pictures: Vec::new(), feature_bytes: 0, line_starts: 0 };
    for number in 0..4 {
        let code = |i: usize| {
            u16::try_from(draw(1000 + (u64::from(number) << 32) + i as u64) & ((1 << kind.bits()) - 1)).unwrap()
        };
        let codes = Plane::from_values(size, (0..size.pixel_count()).map(code).collect());
        let features: Vec<Feature> = (0..below(10 + u64::from(number), 40))
            .map(|i| Feature {
                x: PositionPx::from_bits(u16::try_from(i).unwrap()),
                y: PositionPx::from_bits(7),
                score: 200,
                angle: Turns::from_bits(3),
                octave: 0,
                descriptor: [u8::try_from(i).unwrap(); 32],
            })
            .collect();
        let batches = [Batch { features: u32::try_from(features.len() / 2).unwrap(), after_row: size.height_px / 2 }];
        let out = FrameOut {
            virtual_channel: u8::try_from(below(5, 4)).unwrap(),
            metadata: FrameMetadata { frame: FrameIndex(number), ..FrameMetadata::default() },
            codes: Some(&codes),
            bits: kind.bits(),
            features: Some(&features),
            batches: &batches,
            features_per_gap: below(6, 5),
        };
        let traffic = params.traffic_of(&out.packets(&params), size, kind.bits()).unwrap();
        stream.feature_bytes += traffic.feature_bits / 8;
        stream.bytes.extend(pack_frame(&out, &params, &mut Events::default()).unwrap());
        let carries = params.sends_codes_in(FrameIndex(number));
        stream.line_starts += if carries && line_sync { size.height_px.into() } else { 0 };
        stream.pictures.push(carries.then_some(codes));
    }
    stream
}

/// Pictures that the judge unpacked are those that were sent. It leaves out the frames without rows, and judges no RAW16 pixel.
fn compare(stream: &Stream, kind: RawKind, folder: &Path) -> u32 {
    let mut compared = 0;
    for (number, picture) in stream.pictures.iter().enumerate() {
        let file = folder.join(format!("{number:06}.png"));
        assert_eq!(file.exists(), picture.is_some(), "{}", file.display());
        if let Some(picture) = picture.as_ref().filter(|_| kind != RawKind::Raw16) {
            assert_eq!(&read_grey(&file).unwrap().0, picture, "{}", file.display());
            compared += 1;
        }
    }
    compared
}

#[test]
fn the_standard_decoder_unpacks_random_streams_of_every_container_and_mode() {
    let folder = scratch("streams");
    std::fs::create_dir_all(&folder).unwrap();
    let (mut streams, mut pictures, mut refused) = (0, 0, 0);
    for kind in RawKind::ALL {
        for mode in [Mode::Frames, Mode::Features, Mode::Both] {
            let seed =
                100 * u64::from(kind.bits()) + u64::from(mode.sends_codes()) + 2 * u64::from(mode.sends_features());
            let stream = stream(seed, kind, mode);
            let (file, png) = (folder.join(format!("{seed}.csi2")), folder.join(format!("{seed}")));
            std::fs::write(&file, &stream.bytes).unwrap();
            let (width, height) = (stream.size.width_px.to_string(), stream.size.height_px.to_string());
            let shape = ["--expect-width", &width, "--expect-height", &height];
            let png_text = text_of(&png);
            let mut arguments = vec![text_of(&file), "--png".to_owned(), png_text];
            arguments.extend(shape.map(str::to_owned));
            let found = judge("csi2_check.py", &arguments.iter().map(String::as_str).collect::<Vec<_>>());
            let rows = stream.pictures.iter().flatten().count() as u64 * u64::from(stream.size.height_px);
            assert_eq!(found["frames"], 4, "seed {seed}: {found}");
            assert_eq!(found["packets"][kind.name()].as_u64().unwrap_or(0), rows, "seed {seed}: {found}");
            assert_eq!(
                found["packets"]["line_start"].as_u64().unwrap_or(0),
                stream.line_starts,
                "seed {seed}: {found}"
            );
            assert_eq!(found["feature_bytes"], stream.feature_bytes, "seed {seed}: {found}");
            pictures += compare(&stream, kind, &png);
            refused += refuses_a_flip(&stream, seed, &file);
            streams += 1;
        }
    }
    println!("{streams} streams, {pictures} pictures");
    assert!((streams, refused) == (21, 21) && pictures > 36, "{pictures} pictures");
}

/// The judge sees any flipped bit too.
fn refuses_a_flip(stream: &Stream, seed: u64, file: &Path) -> u32 {
    let mut bytes = stream.bytes.clone();
    let bit = usize::try_from(mix(seed)).unwrap() % (8 * bytes.len());
    bytes[bit / 8] ^= 1 << (bit % 8);
    std::fs::write(file, &bytes).unwrap();
    let python = std::env::var("SENSEL_JUDGE_PYTHON").unwrap();
    let output = Command::new(python).arg(root().join("tests/judges/csi2_check.py")).arg(file).output().unwrap();
    u32::from(output.status.code() == Some(1))
}
