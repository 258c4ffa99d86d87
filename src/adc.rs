//! Column converters. Enters: microvolts. Leaves: codes in LSB.
