//! Row counters and the queue of lists to read out, twin of `verilog/fx_dumps.sv`. Decides from row ends and loads which list is read
//! next and whether a row may start.

use crate::fx_cells::BankWalk;
use crate::fx_config::FxBackConfig;

/// Row numbers wrap here; differences are taken as signed.
const NUMBERS: u16 = 0xFFF;

/// A row of an octave; `row` is the octave's height in the virtual row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Octave.
    pub octave: usize,
    /// Row within the octave.
    pub row: u32,
    /// The row after the last.
    pub is_virtual: bool,
}

/// A dump in the queue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Job {
    ends_frame: bool,
    walks: bool,
    octave: usize,
    cell_row: u16,
}

/// The cell row that is walked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Walked {
    pub octave: usize,
    /// Row number of the frame's row 0.
    pub base: u16,
    /// Parity of the frame.
    pub frame: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct OctaveRows {
    base: u16,
    next: u16,
    frame: bool,
    end_waits: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct BankRows {
    to_dump: bool,
    /// Corners dumped and not yet loaded, under policy stall.
    waiting: u8,
    first_row: u16,
}

impl BankRows {
    fn busy(&self) -> bool {
        self.to_dump || self.waiting != 0
    }
}

/// What else happens in a clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct DumpsIn {
    /// A row whose last outputs stand.
    pub row_end: Option<Row>,
    /// This clock is the walk's last.
    pub walk_last: bool,
    /// A corner enters the queue of the engines, under policy stall.
    pub pushed: bool,
    /// A corner of (octave, bank) has been read from the ring, under policy stall.
    pub loaded: Option<(usize, usize)>,
}

/// The registers.
#[derive(Debug)]
pub struct FxDumps {
    width: u32,
    height: u32,
    cell_log2: u32,
    ring_rows: u16,
    queue: [Job; 8],
    queued: usize,
    walked: Job,
    octaves: [OctaveRows; 4],
    banks: [[BankRows; 2]; 4],
}

/// The low 12 bits.
fn number(row: u32) -> u16 {
    u16::try_from(row & u32::from(NUMBERS)).expect("twelve bits")
}

/// How far `later` is after `earlier`; `None` before it.
pub(crate) fn age(later: u16, earlier: u16) -> Option<u16> {
    let age = later.wrapping_sub(earlier) & NUMBERS;
    (age >> 11 == 0).then_some(age)
}

impl FxDumps {
    /// Registers in reset.
    pub fn new(config: &FxBackConfig) -> Self {
        Self {
            width: config.width,
            height: config.height,
            cell_log2: config.cell_log2,
            ring_rows: 1 << config.ring_log2,
            queue: [Job::default(); 8],
            queued: 0,
            walked: Job::default(),
            octaves: Default::default(),
            banks: Default::default(),
        }
    }

    /// Back to reset.
    pub fn reset(&mut self) {
        (self.queued, self.walked) = (0, Job::default());
        (self.octaves, self.banks) = Default::default();
    }

    /// The dump that a row's end triggers.
    fn trigger(&self, end: Row) -> Option<Job> {
        let (cell, height) = (1 << self.cell_log2, self.height >> end.octave);
        let job = |walks: bool, cell_row: u32| Job {
            ends_frame: end.is_virtual,
            walks,
            octave: end.octave,
            cell_row: u16::try_from(cell_row).expect("at most 4096 rows"),
        };
        if end.is_virtual {
            // At most one cell row with corners is left: the one of the last row that can hold one.
            let left = height.saturating_sub(17);
            return Some(job(height >= 33 && left % cell != cell - 1, left / cell));
        }
        let from_cell = end.row.checked_sub(15 + cell)?;
        from_cell.is_multiple_of(cell).then(|| job(true, from_cell / cell))
    }

    /// The walk that begins in this clock, the walker being idle or not.
    pub fn load(&self, walking: bool) -> Option<BankWalk> {
        let job = self.queue[..self.queued].first().filter(|_| !walking)?;
        let columns = (self.width >> job.octave).div_ceil(1 << self.cell_log2);
        let columns = if job.walks { columns } else { 0 };
        Some(BankWalk { octave: job.octave, bank: usize::from(job.cell_row & 1), columns })
    }

    pub fn walked(&self) -> Walked {
        let octave = self.walked.octave;
        Walked { octave, base: self.octaves[octave].base, frame: self.octaves[octave].frame }
    }

    /// The number of a row of the frame that an octave is in.
    pub fn row_number(&self, octave: usize, row: u16) -> u16 {
        self.octaves[octave].base.wrapping_add(row) & NUMBERS
    }

    /// How far the smoothed row of an octave that is being written, or comes next, is after another; `None` before it.
    pub fn age(&self, octave: usize, row_number: u16) -> Option<u16> {
        age(self.octaves[octave].next, row_number)
    }

    /// Whether a row may start.
    pub fn row_ok(&self, row: Row, stall_policy: bool) -> bool {
        let (octave, banks) = (&self.octaves[row.octave], &self.banks[row.octave]);
        let first_waits = row.row == 0 && (octave.end_waits || banks.iter().any(|bank| bank.to_dump));
        let bank_waits = row.row.checked_sub(4).is_some_and(|from_first| {
            let (cell_row, row_in_cell) = (from_first >> self.cell_log2, from_first % (1 << self.cell_log2));
            row_in_cell == 0 && banks[usize::from(cell_row % 2 == 1)].to_dump
        });
        let asked = octave.base.wrapping_add(number(row.row));
        let overwrites =
            |bank: &BankRows| bank.busy() && age(asked, bank.first_row).is_some_and(|rows| rows >= self.ring_rows - 10);
        let ring_waits = stall_policy && !row.is_virtual && banks.iter().any(overwrites);
        !(first_waits || bank_waits || ring_waits)
    }

    /// One rising edge.
    pub fn tick(&mut self, walking: bool, pins: DumpsIn) {
        let loads = self.load(walking).is_some();
        let ended = pins.row_end.map(|end| (end, self.trigger(end)));
        // What the trigger marks, judged by the registers before the edge.
        if let Some((end, job)) = ended {
            self.mark(end, job);
        }
        let walked = self.walked;
        if pins.walk_last {
            if walked.walks {
                self.banks[walked.octave][usize::from(walked.cell_row & 1)].to_dump = false;
            }
            if walked.ends_frame {
                let octave = &mut self.octaves[walked.octave];
                octave.base = octave.base.wrapping_add(number(self.height >> walked.octave)) & NUMBERS;
                octave.frame = !octave.frame;
                octave.end_waits = false;
            }
        }
        if pins.pushed {
            self.banks[walked.octave][usize::from(walked.cell_row & 1)].waiting += 1;
        }
        if let Some((octave, bank)) = pins.loaded {
            self.banks[octave][bank].waiting -= 1;
        }
        if loads {
            self.walked = self.queue[0];
            self.queue.copy_within(1.., 0);
            self.queued -= 1;
        }
        if let Some(job) = ended.and_then(|(_, job)| job) {
            self.queue[self.queued] = job;
            self.queued += 1;
        }
    }

    fn mark(&mut self, end: Row, job: Option<Job>) {
        let octave = &mut self.octaves[end.octave];
        let next = if end.is_virtual { self.height >> end.octave } else { end.row.saturating_sub(2) };
        octave.next = octave.base.wrapping_add(number(next)) & NUMBERS;
        octave.end_waits |= end.is_virtual;
        let base = octave.base;
        if let Some(job) = job.filter(|job| job.walks) {
            let bank = &mut self.banks[end.octave][usize::from(job.cell_row & 1)];
            if !bank.busy() {
                bank.first_row = base.wrapping_add(job.cell_row << self.cell_log2) & NUMBERS;
            }
            bank.to_dump = true;
        }
    }
}
