//! Photodiode, transfer gate and conversion gain. Enters: mean photons. Leaves: microvolts at the column.
