//! Row sequencer, twin of `verilog/readout_seq.sv`. Drives the control pins of array, ramp, columns and lanes and the electronic
//! shutter's pointer. Line lengths are clocks of `adc_clk`.

/// Run-time parameters of the sequencer. Clocks are 20 bits wide in hardware, lines and rows 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeqConfig {
    /// All rows are exposed together.
    pub global_shutter: bool,
    /// Clocks of a line.
    pub hts: u32,
    /// Lines of a frame.
    pub vts: u32,
    /// Rows read, in lines 0 .. rows-1.
    pub rows: u32,
    /// Row of line 0.
    pub first_row: u32,
    /// Distance between rows read.
    pub row_step: u32,
    /// Settling time of the reset level in clocks, at least 2.
    pub n_settle_reset: u32,
    /// Steps of the reset ramp; 0: there is none.
    pub n_ramp_reset: u32,
    /// Settling time of the signal in clocks, at least 2.
    pub n_settle_signal: u32,
    /// Steps of the signal ramp.
    pub n_ramp_signal: u32,
    /// Exposure in lines, 1 .. vts-1.
    pub exposure_lines: u32,
}

impl SeqConfig {
    /// What the hardware needs to work as described; the sentence says which rule is broken.
    pub fn check(&self) -> Result<(), &'static str> {
        let phases = [self.n_settle_reset, self.n_ramp_reset, self.n_settle_signal, self.n_ramp_signal];
        let used = phases.iter().map(|&n| u64::from(n)).sum::<u64>();
        let rule = |holds: bool, sentence| if holds { Ok(()) } else { Err(sentence) };
        rule(self.n_settle_reset >= 2 && self.n_settle_signal >= 2, "both settling times take at least 2 clocks")?;
        rule((1..=1 << 16).contains(&self.n_ramp_signal), "the signal ramp has 1 to 2^16 steps")?;
        rule(self.n_ramp_reset <= 1 << 16, "the reset ramp has at most 2^16 steps")?;
        rule(
            used <= u64::from(self.hts) && self.hts < 1 << 20,
            "a line holds both settling times and ramps, below 2^20 clocks",
        )?;
        rule((1..self.vts).contains(&self.exposure_lines), "the exposure takes 1 line to one less than the frame")?;
        rule(self.rows <= self.vts && self.vts < 1 << 16, "a frame holds all rows in fewer than 2^16 lines")
    }
}

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SeqIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Everything holds.
    pub stall: bool,
    /// Frames follow each other; when low, the sequencer stops after the frame.
    pub enable: bool,
}

/// Phase of a line; the value of the `state` pins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum SeqState {
    /// Stopped.
    #[default]
    Idle = 0,
    /// The floating diffusion was reset and settles.
    SettleReset = 1,
    /// Reset ramp, one step a clock.
    RampReset = 2,
    /// Charge was transferred and the signal settles.
    SettleSignal = 3,
    /// Signal ramp, one step a clock.
    RampSignal = 4,
    /// The rest of the line.
    Blank = 5,
}

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SeqOut {
    /// Not idle.
    pub running: bool,
    /// Phase of the line.
    pub state: SeqState,
    /// Line of the frame.
    pub line: u32,
    /// Row that is read.
    pub row: u32,
    /// The line reads a row.
    pub frame_valid: bool,
    /// The row is selected: the line reads a row and is not in its blank.
    pub line_valid: bool,
    /// Counters take the black level.
    pub clear: bool,
    /// The row's floating diffusion is reset.
    pub fd_reset: bool,
    /// Last clock of the reset level's settling.
    pub sample_reset: bool,
    /// The row's charge moves to its floating diffusion.
    pub transfer: bool,
    /// Last clock of the signal's settling.
    pub sample_signal: bool,
    /// A ramp's first step follows in two clocks.
    pub ramp_start: bool,
    /// Columns count down: the ramp is the reset ramp.
    pub ramp_down: bool,
    /// Codes go to the lanes.
    pub latch: bool,
    /// The shutter clears photodiodes: of `shutter_row`, or of all rows.
    pub shutter_reset: bool,
    /// Row under the shutter's pointer.
    pub shutter_row: u32,
    /// All rows' charges move to their storage.
    pub global_transfer: bool,
}

/// The sequencer's registers.
#[derive(Clone, Debug)]
pub struct ReadoutSeq {
    config: SeqConfig,
    running: bool,
    state: SeqState,
    clock: u32,
    left: u32,
    line: u32,
    row: u32,
    shutter_line: u32,
    shutter_row: u32,
    first: bool,
    primed: bool,
    ended: bool,
    latch: bool,
    ramp_down: bool,
}

const CLOCK_BITS: u32 = 0xF_FFFF;
const LINE_BITS: u32 = 0xFFFF;

impl ReadoutSeq {
    /// A sequencer in reset.
    pub fn new(config: SeqConfig) -> Self {
        Self {
            config,
            running: false,
            state: SeqState::Idle,
            clock: 0,
            left: 0,
            line: 0,
            row: 0,
            shutter_line: 0,
            shutter_row: 0,
            first: false,
            primed: false,
            ended: false,
            latch: false,
            ramp_down: false,
        }
    }

    /// Parameters.
    pub fn config(&self) -> &SeqConfig {
        &self.config
    }

    /// Clock within the line.
    pub fn clock(&self) -> u32 {
        self.clock
    }

    /// Pins as they stand.
    pub fn out(&self) -> SeqOut {
        let config = &self.config;
        let frame_valid = self.running && self.primed && self.line < config.rows;
        let line_valid = frame_valid && self.state != SeqState::Blank;
        let settles_reset = line_valid && self.state == SeqState::SettleReset;
        let settles_signal = line_valid && self.state == SeqState::SettleSignal;
        let ramp_follows = (settles_reset && config.n_ramp_reset != 0) || (settles_signal && config.n_ramp_signal != 0);
        let line_start = self.running && self.clock == 0;
        SeqOut {
            running: self.running,
            state: self.state,
            line: self.line,
            row: self.row,
            frame_valid,
            line_valid,
            clear: line_valid && self.clock == 1,
            fd_reset: settles_reset && self.first,
            sample_reset: settles_reset && self.left == 0,
            transfer: settles_signal && self.first,
            sample_signal: settles_signal && self.left == 0,
            ramp_start: ramp_follows && self.left == 1,
            ramp_down: self.ramp_down,
            latch: self.latch,
            shutter_reset: if config.global_shutter {
                line_start && self.shutter_line == 0
            } else {
                self.running && self.state == SeqState::SettleSignal && self.first && self.shutter_line < config.rows
            },
            shutter_row: self.shutter_row,
            global_transfer: config.global_shutter && line_start && self.primed && self.line == 0,
        }
    }

    fn line_end(&self) -> bool {
        self.clock == self.config.hts.wrapping_sub(1) & CLOCK_BITS
    }

    /// The phase that follows: the first of the order whose length is not 0.
    fn enter_next(&mut self, from: SeqState) {
        let config = &self.config;
        let order = [
            (SeqState::SettleReset, config.n_settle_reset),
            (SeqState::RampReset, config.n_ramp_reset),
            (SeqState::SettleSignal, config.n_settle_signal),
            (SeqState::RampSignal, config.n_ramp_signal),
        ];
        let found = order.into_iter().find(|&(state, length)| from < state && length != 0);
        let (state, length) = found.unwrap_or((SeqState::Blank, 1));
        (self.state, self.left, self.first) = (state, length - 1, true);
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: SeqIn) -> SeqOut {
        if pins.rst {
            *self = Self::new(self.config);
        } else if !pins.stall {
            self.latch = self.ended;
            let reads = self.running && self.primed && self.line < self.config.rows;
            self.ended = reads && self.state == SeqState::RampSignal && self.left == 0;
            self.ramp_down = match self.state {
                SeqState::SettleReset => true,
                SeqState::SettleSignal => false,
                _ => self.ramp_down,
            };
            self.first = false;
            if self.running {
                self.step(pins.enable);
            } else if pins.enable {
                self.begin();
            }
        }
        self.out()
    }

    fn begin(&mut self) {
        let config = self.config;
        self.running = true;
        self.enter_next(SeqState::Idle);
        self.clock = 0;
        self.line = config.vts.wrapping_sub(config.exposure_lines) & LINE_BITS;
        self.row = config.first_row;
        self.shutter_line = 0;
        self.shutter_row = config.first_row;
        self.primed = false;
    }

    fn step(&mut self, enable: bool) {
        let line_end = self.line_end();
        let frame_end = self.line == self.config.vts.wrapping_sub(1) & LINE_BITS;
        self.clock = if line_end { 0 } else { (self.clock + 1) & CLOCK_BITS };
        if line_end || (self.left == 0 && self.state != SeqState::Blank) {
            self.enter_next(if line_end { SeqState::Idle } else { self.state });
        } else if self.state != SeqState::Blank {
            self.left -= 1;
        }
        if !line_end {
            return;
        }
        self.next_line(frame_end);
        if frame_end && !enable {
            self.running = false;
            (self.state, self.left, self.first) = (SeqState::Idle, 0, false);
        }
    }

    fn next_line(&mut self, frame_end: bool) {
        let SeqConfig { first_row, row_step, vts, .. } = self.config;
        self.line = if frame_end { 0 } else { (self.line + 1) & LINE_BITS };
        self.row = if frame_end { first_row } else { (self.row + row_step) & LINE_BITS };
        self.primed |= frame_end;
        if self.shutter_line == vts.wrapping_sub(1) & LINE_BITS {
            (self.shutter_line, self.shutter_row) = (0, first_row);
        } else {
            self.shutter_line = (self.shutter_line + 1) & LINE_BITS;
            self.shutter_row = (self.shutter_row + row_step) & LINE_BITS;
        }
    }

    /// How many of the coming ticks, without stall and reset, leave every pin as it is: a promise for at least that many. While idle
    /// and not enabled, `u64::MAX`.
    pub fn quiet_clocks(&self, enable: bool) -> u64 {
        if self.latch || self.ended {
            return 0;
        }
        if !self.running {
            return if enable { 0 } else { u64::MAX };
        }
        let phase_moves = match self.state {
            SeqState::SettleReset => !self.ramp_down,
            SeqState::SettleSignal => self.ramp_down,
            _ => false,
        };
        if self.first || phase_moves || self.clock <= 1 {
            return 0;
        }
        // The last two clocks of a phase show on pins.
        let to_line_end = self.config.hts.saturating_sub(self.clock + 1);
        let to_phase_end = if self.state == SeqState::Blank { u32::MAX } else { self.left.saturating_sub(2) };
        to_line_end.min(to_phase_end).into()
    }

    /// The same as `clocks` ticks, which must be quiet ones.
    pub fn skip(&mut self, clocks: u64) {
        if !self.running || clocks == 0 {
            return;
        }
        let clocks = u32::try_from(clocks).expect("quiet clocks of a running sequencer stay within a line");
        self.clock += clocks;
        if self.state != SeqState::Blank {
            self.left -= clocks;
        }
    }

    /// The same as `clocks` ticks with constant `enable`, without stall and reset.
    pub fn advance(&mut self, clocks: u64, enable: bool) -> SeqOut {
        let mut clocks = clocks;
        while clocks > 0 {
            let quiet = self.quiet_clocks(enable).min(clocks);
            self.skip(quiet);
            clocks -= quiet;
            if clocks > 0 {
                self.tick(SeqIn { enable, ..SeqIn::default() });
                clocks -= 1;
            }
        }
        self.out()
    }
}
