//! Counted events times a technology's constants. Enters: events and times. Leaves: energy by block.
