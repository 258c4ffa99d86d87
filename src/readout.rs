//! The sequencer: line and frame times, exposure windows, rolling or global shutter, in clocks of rational frequencies.
