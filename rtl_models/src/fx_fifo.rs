//! Queue of selected corners before the engines, twin of `verilog/fx_fifo.sv`. Reports what the overflow policy dropped.

use crate::fx_cells::ListedCorner;

/// What happens to a push that finds the queue full.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Nothing is pushed until there is room.
    #[default]
    Stall,
    /// The pushed one is lost.
    DropNewest,
    /// The one of lowest rank is lost, the newest among equals.
    DropWeakest,
}

impl Policy {
    /// The pins' value.
    pub const fn code(self) -> u8 {
        match self {
            Policy::Stall => 0,
            Policy::DropNewest => 1,
            Policy::DropWeakest => 2,
        }
    }
}

/// A corner queued for an engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueuedCorner {
    /// The corner.
    pub corner: ListedCorner,
    /// Its octave.
    pub octave: u8,
    /// Parity of its octave's frame.
    pub frame: bool,
    /// Its row, numbered on over frames, modulo 4096.
    pub row_number: u16,
}

/// The queue; its entries are borrowed.
#[derive(Debug)]
pub struct FxFifo<'a> {
    entries: &'a mut [QueuedCorner],
    used: usize,
}

impl<'a> FxFifo<'a> {
    /// An empty queue.
    pub fn new(entries: &'a mut [QueuedCorner]) -> Self {
        assert!((1..=64).contains(&entries.len()), "a queue has 1 to 64 entries");
        Self { entries, used: 0 }
    }

    /// Back to empty.
    pub fn reset(&mut self) {
        self.used = 0;
    }

    /// The oldest.
    pub fn head(&self) -> Option<&QueuedCorner> {
        self.entries[..self.used].first()
    }

    /// Candidates that wait.
    pub fn used(&self) -> usize {
        self.used
    }

    fn full(&self, pop: bool) -> bool {
        self.used == self.entries.len() && !pop
    }

    /// Whether a push is taken (or given up) in a clock with or without a pop.
    pub fn room(&self, policy: Policy, pop: bool) -> bool {
        policy != Policy::Stall || !self.full(pop)
    }

    /// Whether a push in this clock costs a candidate.
    pub fn dropped(&self, push: bool, pop: bool) -> bool {
        push && self.full(pop)
    }

    /// One rising edge; the pop comes before the push.
    pub fn tick(&mut self, policy: Policy, push: Option<QueuedCorner>, pop: bool) {
        if pop && self.used > 0 {
            self.entries.copy_within(1..self.used, 0);
            self.used -= 1;
        }
        let Some(newcomer) = push else { return };
        if self.used < self.entries.len() {
            self.entries[self.used] = newcomer;
            self.used += 1;
        } else if policy == Policy::DropWeakest {
            let lowest = self.entries.iter().map(|held| held.corner.rank).min().expect("there is an entry");
            let weakest = self.entries.iter().rposition(|held| held.corner.rank == lowest).expect("it was found");
            if newcomer.corner.rank > lowest {
                self.entries.copy_within(weakest + 1.., weakest);
                self.entries[self.used - 1] = newcomer;
            }
        }
    }
}
