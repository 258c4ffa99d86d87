//! What a person reads: pose error, bits, joules, latency, and what the simulation cost in time.
