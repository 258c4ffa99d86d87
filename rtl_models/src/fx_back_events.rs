//! Event-driven form of the back half: takes a row's pixels and corners at once and skips clocks in which only descriptors change.

use super::{FxBack, ListedCorner, Policy};

impl FxBack<'_> {
    /// Whether the back half is idle: no list is read or waits, no corner waits, no engine runs.
    pub fn is_idle(&self) -> bool {
        let engines = self.idle.iter().take(self.engines.len()).all(|&idle| idle);
        engines && self.fifo.used() == 0 && !self.cells.active() && self.dumps.load(false).is_none()
    }

    /// Clocks from now on that change descriptors alone, while no pixel, corner or end of a row comes; `u64::MAX` where nothing
    /// is under way. After them a clock is due in which something else changes, or a record becomes valid.
    pub(crate) fn quiet_clocks(&self, policy: Policy) -> u64 {
        let (start, late) = self.head_leaves(policy);
        let walks = self.cells.moves(self.fifo.room(policy, false)) || self.dumps.load(self.cells.active()).is_some();
        if self.load.is_some() || start || late || walks {
            return 0;
        }
        let left = self.engines[self.turn].clocks_to_done(self.engine_config());
        left.map_or(u64::MAX, u64::from)
    }

    /// So many quiet clocks, in which a row waits or none does.
    pub(crate) fn advance(&mut self, clocks: u64, stalled: bool) {
        let build = self.engine_config();
        self.engines.iter_mut().for_each(|engine| engine.advance(build, clocks));
        if stalled {
            let clocks = u32::try_from(clocks & u64::from(u32::MAX)).expect("the low 32 bits");
            self.counts.stalled = self.counts.stalled.wrapping_add(clocks);
        }
    }

    /// The smoothed pixels of a row from column 3 on, from the clock on in which the row may start: until it ends, no patch that
    /// is read has the rows that they overwrite.
    pub(crate) fn write_row<T: Copy + Into<u16>>(&mut self, octave: usize, row: u32, smoothed: &[T]) {
        let row = u16::try_from(row).expect("pictures have at most 4096 rows");
        self.ring.write_row(octave, 3, self.dumps.row_number(octave, row), smoothed);
    }

    /// A corner of that row: until it ends, no list of its cell row is walked.
    pub(crate) fn put(&mut self, octave: usize, corner: ListedCorner) {
        let taken = self.has_patch(octave, &corner);
        let lost = taken && self.cells.insert(octave, corner);
        let counts = &mut self.counts;
        counts.corners = counts.corners.wrapping_add(1);
        counts.without_patch = counts.without_patch.wrapping_add(u32::from(!taken));
        counts.unselected = counts.unselected.wrapping_add(u32::from(lost));
    }
}
