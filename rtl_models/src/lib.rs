//! Bit-true twins of the sensor's digital blocks: no floats, no allocator, no `unsafe`.
#![no_std]
#![forbid(unsafe_code)]

pub mod ramp_adc;
