//! The host's tracker. Enters: decoded packets and calibration. Leaves: a pose a frame. It never sees the simulation.
