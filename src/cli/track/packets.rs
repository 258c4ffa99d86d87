//! Packets that a run kept, as the host received them: reads one file a camera, packets of all its frames back to back, damaged as they may
//! be, and gives the features of one frame of the rig after the other, with the time of each row. Numbers and times of frames rise.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read as _, Take};
use std::path::{Path, PathBuf};

use sensel::compute::Extractor;
use sensel::error::Error;
use sensel::files::{content_error, io_error};
use sensel::link::{Decoder, LinkCounts, Received};
use sensel::num::{u64_from, u64_half_even};
use sensel::run::{Host, SensorSetup};

use super::rig_frame::RigFrame;

/// Bytes that are read at once.
const PIECE_BYTES: usize = 1 << 20;
/// Frame numbers in short packets go from 1 to this and begin again.
const NUMBERS: u64 = 65_535;
/// Frames that are read ahead at most, for one whose embedded line says which frame of the run it is.
const AHEAD_FRAMES: usize = 64;

/// The file of a camera's packets.
pub fn file(folder: &Path, camera: usize) -> PathBuf {
    folder.join(format!("cam{camera}.csi2"))
}

/// Packets of all cameras.
pub struct Packets<'a> {
    sensor: &'a SensorSetup,
    streams: Vec<PacketStream>,
    host: Host,
    extractors: Vec<Extractor>,
}

impl<'a> Packets<'a> {
    /// Opens the files of so many cameras. Fails on a file that is not there.
    pub fn open(folder: &Path, cameras: usize, sensor: &'a SensorSetup) -> Result<Self, Error> {
        let wants_pictures = !sensor.link.mode.sends_features();
        let streams = (0..cameras).map(|camera| PacketStream::open(file(folder, camera), wants_pictures));
        let streams = streams.collect::<Result<Vec<_>, Error>>()?;
        let extractors = vec![Extractor::new(&sensor.extractor); cameras];
        Ok(Self { sensor, streams, host: Host::default(), extractors })
    }

    /// What was right and wrong on all links so far; complete after the last frame.
    pub fn counts(&self) -> LinkCounts {
        let mut counts = LinkCounts::default();
        self.streams.iter().for_each(|stream| counts.merge(&stream.counts));
        counts
    }

    fn next_frame(&mut self) -> Result<Option<RigFrame>, Error> {
        let mut next = None;
        for stream in &mut self.streams {
            let number = stream.next_number(self.sensor)?;
            next = match (next, number) {
                (Some(a), Some(b)) => Some(u64::min(a, b)),
                (one, other) => one.or(other),
            };
        }
        let Some(number) = next else { return Ok(None) };
        let mut received = Vec::with_capacity(self.streams.len());
        for stream in &mut self.streams {
            received.push(stream.take(number, self.sensor)?);
        }
        let frame = self.host.receive(self.sensor, &mut self.extractors, (number, received))?;
        let timestamp_ns = u64_half_even(frame.input.t_s * 1e9);
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        Ok(Some(RigFrame { number, timestamp_ns, features: frame.input.features, clocks: frame.input.clocks }))
    }
}

impl Iterator for Packets<'_> {
    type Item = Result<RigFrame, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}

/// One camera's packets.
struct PacketStream {
    path: PathBuf,
    file: Take<File>,
    /// None after the last byte.
    decoder: Option<Decoder>,
    ready: VecDeque<Received>,
    /// Frame of the run, and its number on the link, that was read last.
    last: Option<(u64, u16)>,
    counts: LinkCounts,
    piece: Vec<u8>,
}

impl PacketStream {
    fn open(path: PathBuf, wants_pictures: bool) -> Result<Self, Error> {
        let file = sensel::files::open::open_input(&path)?;
        let bytes = file.metadata().map_err(io_error(&path))?.len();
        // A file that grows is read as it was.
        let file = file.take(bytes);
        Ok(Self {
            path,
            file,
            decoder: Some(Decoder::new(wants_pictures)),
            ready: VecDeque::new(),
            last: None,
            counts: LinkCounts::default(),
            piece: vec![0; PIECE_BYTES],
        })
    }

    /// The next frame of the run that something arrived of; none after the last. Frames that are over, or whose number in the run is
    /// not known, are passed by.
    fn next_number(&mut self, sensor: &SensorSetup) -> Result<Option<u64>, Error> {
        while self.fill(1)? {
            if let Some(number) =
                self.number_of_first()?.filter(|&number| self.last.is_none_or(|(last, _)| number > last))
            {
                return Ok(Some(number));
            }
            let passed = self.ready.pop_front();
            passed.map_or(Ok(()), |frame| self.check_size(&frame, sensor))?;
        }
        Ok(None)
    }

    /// Reads until so many frames wait; false where the stream has fewer.
    fn fill(&mut self, frames: usize) -> Result<bool, Error> {
        while self.ready.len() < frames {
            let Some(decoder) = &mut self.decoder else { return Ok(false) };
            let length = self.file.read(&mut self.piece).map_err(io_error(&self.path))?;
            self.ready.extend(decoder.push(&self.piece[..length]));
            if length == 0 {
                let rest = self.decoder.take().map(Decoder::finish).unwrap_or_default();
                self.counts = rest.counts;
                self.ready.extend(rest.frames);
            }
        }
        Ok(true)
    }

    /// The embedded line says which frame of the run the first one is. Without it, the number on the link does, which begins again; but
    /// bits of that may be flipped too, so it has to lie between the frame before and the next one whose embedded line holds.
    fn number_of_first(&mut self) -> Result<Option<u64>, Error> {
        let mut at = 0;
        let ahead = loop {
            if at == AHEAD_FRAMES || !self.fill(at + 1)? {
                break None;
            }
            let frame = &self.ready[at];
            if let Some(metadata) = frame.metadata {
                break Some((u64::from(metadata.frame.0), frame.frame_number));
            }
            at += 1;
        };
        let on_link = self.ready[0].frame_number;
        let steps = |from: u16, to: u16| (u64::from(to) + NUMBERS - u64::from(from)) % NUMBERS;
        Ok(match (self.last, ahead) {
            (_, Some((number, _))) if at == 0 => Some(number),
            (Some((last, before)), Some((next, _))) => {
                Some(last + steps(before, on_link)).filter(|&number| number <= next)
            }
            (Some((last, before)), None) => {
                let steps = steps(before, on_link);
                (steps <= u64_from(AHEAD_FRAMES)).then_some(last + steps)
            }
            (None, Some((next, behind))) => next.checked_sub(steps(on_link, behind)),
            (None, None) => Some(u64::from(on_link).saturating_sub(1)),
        })
    }

    /// What arrived of a frame: of several that damage made of one, the first whose embedded line holds.
    fn take(&mut self, number: u64, sensor: &SensorSetup) -> Result<Option<Received>, Error> {
        let mut best: Option<Received> = None;
        while self.fill(1)? && self.number_of_first()? == Some(number) {
            let Some(frame) = self.ready.pop_front() else { break };
            self.check_size(&frame, sensor)?;
            self.last = Some((number, frame.frame_number));
            if best.as_ref().is_none_or(|best| best.metadata.is_none() && frame.metadata.is_some()) {
                best = Some(frame);
            }
        }
        Ok(best)
    }

    fn check_size(&self, frame: &Received, sensor: &SensorSetup) -> Result<(), Error> {
        let Some(found) = frame.shape.and_then(|shape| shape.size()).filter(|size| *size != sensor.size) else {
            return Ok(());
        };
        let [found, said] = [found, sensor.size].map(|size| format!("{}x{}", size.width_px, size.height_px));
        Err(content_error(&self.path, format!("holds pictures of {found}; config.toml beside it says {said}")))
    }
}
