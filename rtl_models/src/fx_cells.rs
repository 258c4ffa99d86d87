//! Lists of the best corners of each cell, twin of `verilog/fx_cells.sv`. Stores corners that have a full patch; reads a bank out by
//! cells from left to right, best corner first.

use crate::fx_config::FxBackConfig;

/// Most entries of a list.
pub const PER_CELL_MAX: usize = 4;

/// A corner as the lists hold it; positions in pixels of its octave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListedCorner {
    /// Column.
    pub x_px: u16,
    /// Row.
    pub y_px: u16,
    /// FAST score in DN of the pipeline.
    pub score: u16,
    /// What decides: the score, or the Harris code.
    pub rank: u16,
    /// Arc differences of the 3x3 neighbourhood by rows, for the fit.
    pub resp: [u16; 9],
}

/// One cell's corners, best first; of equal rank the earlier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellList {
    used: u8,
    corners: [ListedCorner; PER_CELL_MAX],
}

impl CellList {
    /// Puts a corner behind all of equal or higher rank; of a list of `entries_max` the last falls out. Returns whether one did.
    fn insert(&mut self, corner: ListedCorner, entries_max: usize) -> bool {
        let used = usize::from(self.used);
        let at = self.corners[..used].partition_point(|held| held.rank >= corner.rank);
        if at < entries_max {
            self.corners[at..entries_max].rotate_right(1);
            self.corners[at] = corner;
        }
        let full = used == entries_max;
        self.used += u8::from(!full);
        full
    }
}

/// A bank that is to be walked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BankWalk {
    /// Octave of the bank.
    pub octave: usize,
    /// Parity of the cell row.
    pub bank: usize,
    /// Cells to visit; none for a walk of one clock.
    pub columns: u32,
}

/// The lists and their walker; the lists are borrowed, `FxBackConfig::lists` of them.
#[derive(Debug)]
pub struct FxCells<'a> {
    lists: &'a mut [CellList],
    entries_max: usize,
    cell_log2: u32,
    /// First list of each octave's bank 0, and the number of cells in a bank.
    octaves: [(usize, usize); 4],
    held: Option<(usize, ListedCorner)>,
    active: bool,
    walk: BankWalk,
    column: usize,
    index: usize,
}

impl<'a> FxCells<'a> {
    /// Empty lists. Panics on another number of lists than the config's.
    pub fn new(config: &FxBackConfig, lists: &'a mut [CellList]) -> Self {
        assert_eq!(lists.len(), config.lists(), "two banks of lists an octave");
        let mut first = 0;
        let octaves = core::array::from_fn(|octave| {
            let cells = config.cells(octave);
            let list_range = (first, cells);
            first += 2 * cells;
            list_range
        });
        let entries_max = usize::try_from(config.per_cell).expect("at most four");
        let mut cells = Self {
            lists,
            entries_max,
            cell_log2: config.cell_log2,
            octaves,
            held: None,
            active: false,
            walk: BankWalk::default(),
            column: 0,
            index: 0,
        };
        cells.reset();
        cells
    }

    /// Back to empty lists.
    pub fn reset(&mut self) {
        self.lists.iter_mut().for_each(|list| list.used = 0);
        (self.held, self.active, self.column, self.index) = (None, false, 0, 0);
        self.walk = BankWalk::default();
    }

    fn list(&self, octave: usize, bank: usize, column: usize) -> usize {
        let (first, cells) = self.octaves[octave];
        first + bank * cells + column
    }

    /// Whether a bank is walked.
    pub fn active(&self) -> bool {
        self.active
    }

    /// The corner that the walker offers.
    pub fn entry(&self) -> Option<&ListedCorner> {
        if !self.active || self.walk.columns == 0 {
            return None;
        }
        let list = &self.lists[self.list(self.walk.octave, self.walk.bank, self.column)];
        list.corners[..usize::from(list.used)].get(self.index)
    }

    /// The walker leaves its cell in this clock.
    fn steps(&self, take: bool) -> bool {
        if !self.active || self.walk.columns == 0 {
            return false;
        }
        let list = &self.lists[self.list(self.walk.octave, self.walk.bank, self.column)];
        let used = usize::from(list.used);
        used == 0 || (take && self.index + 1 == used)
    }

    /// This clock is the walk's last, the queue taking an entry or not.
    pub fn last(&self, take: bool) -> bool {
        self.active && (self.walk.columns == 0 || (self.walk.columns == 1 && self.steps(take)))
    }

    /// Whether a clock without a corner changes anything, the queue taking an entry or not.
    pub(crate) fn moves(&self, take: bool) -> bool {
        self.held.is_some() || self.last(take) || self.steps(take) || (take && self.entry().is_some())
    }

    /// Puts a corner into its list, as two clocks do; whether one falls off it. Nothing walks that bank.
    pub(crate) fn insert(&mut self, octave: usize, corner: ListedCorner) -> bool {
        let list = self.list_of(octave, &corner);
        self.lists[list].insert(corner, self.entries_max)
    }

    fn list_of(&self, octave: usize, corner: &ListedCorner) -> usize {
        let bank = usize::from(corner.y_px >> self.cell_log2 & 1);
        self.list(octave, bank, usize::from(corner.x_px >> self.cell_log2))
    }

    /// The newcomer of the clock before pushes a corner off its list.
    pub fn lost(&self) -> bool {
        self.held.is_some_and(|(list, _)| usize::from(self.lists[list].used) == self.entries_max)
    }

    /// One rising edge: a corner of an octave may enter, a walk may begin, and the queue takes an entry or not.
    pub fn tick(&mut self, put: Option<(usize, ListedCorner)>, load: Option<BankWalk>, take: bool) {
        let (steps, last, offered) = (self.steps(take), self.last(take), self.entry().is_some());
        if let Some((list, corner)) = self.held.take() {
            self.lists[list].insert(corner, self.entries_max);
        }
        self.held = put.map(|(octave, corner)| (self.list_of(octave, &corner), corner));
        if let Some(walk) = load {
            (self.active, self.walk, self.column, self.index) = (true, walk, 0, 0);
            return;
        }
        self.active &= !last;
        if steps {
            let list = self.list(self.walk.octave, self.walk.bank, self.column);
            self.lists[list].used = 0;
            self.column += 1;
            self.walk.columns -= 1;
            self.index = 0;
        } else if offered && take {
            self.index += 1;
        }
    }
}
