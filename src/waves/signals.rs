//! Records values at instants, and gives the changes of each signal in time order. Repeated values are dropped.

/// How a signal's value is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalKind {
    /// An unsigned number of so many bits, 1 to 64; one bit is a pin.
    Bits(u32),
    /// A two's complement number of so many bits, 2 to 64.
    Signed(u32),
    /// A real number; the signal's name ends in its unit.
    Real,
}

/// What a signal stands at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// The low bits of the word; two's complement where the signal is signed.
    Bits(u64),
    /// A real number.
    Real(f64),
    /// Not computed: the line is not one of those that were asked for. Real signals do not have it: they hold their value.
    Unknown,
}

/// One signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// The part of the sensor that it belongs to.
    pub scope: String,
    /// Its name within that.
    pub name: String,
    /// How it is read.
    pub kind: SignalKind,
}

/// A signal by its index in [`Waves::signals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SignalId(pub usize);

/// A signal takes a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalChange {
    /// Since the frame's first clock.
    pub time_ps: u64,
    /// Which signal.
    pub signal: SignalId,
    /// From then on.
    pub value: Value,
}

/// Signals and all their changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Waves {
    /// In the order of the data, signals of one scope together.
    pub signals: Vec<Signal>,
    /// In the order of time, then of signals; every signal has its first value at time 0.
    pub changes: Vec<SignalChange>,
    /// When the frame is read and the last row that is shown has left; no change comes later.
    pub end_ps: u64,
}

impl Waves {
    /// The signal of a name.
    pub fn find(&self, scope: &str, name: &str) -> Option<SignalId> {
        self.signals.iter().position(|signal| signal.scope == scope && signal.name == name).map(SignalId)
    }

    /// All values of one signal with their instants.
    pub fn of(&self, signal: SignalId) -> Vec<(u64, Value)> {
        let own = self.changes.iter().filter(|change| change.signal == signal);
        own.map(|change| (change.time_ps, change.value)).collect()
    }
}

/// Collects changes.
#[derive(Debug, Default)]
pub struct Recorder {
    signals: Vec<Signal>,
    held: Vec<Value>,
    changes: Vec<SignalChange>,
}

impl Recorder {
    /// Adds a signal that starts at a value. Signals of one scope must be added together.
    pub fn add(&mut self, scope: &str, name: &str, kind: SignalKind, value: Value) -> SignalId {
        let signal = SignalId(self.signals.len());
        self.signals.push(Signal { scope: scope.to_owned(), name: name.to_owned(), kind });
        self.held.push(value);
        self.changes.push(SignalChange { time_ps: 0, signal, value });
        signal
    }

    /// A signal stands at a value from an instant on. A signal's own instants must not fall.
    pub fn set(&mut self, signal: SignalId, time_ps: u64, value: Value) {
        let held = &mut self.held[signal.0];
        if *held != value {
            *held = value;
            self.changes.push(SignalChange { time_ps, signal, value });
        }
    }

    /// From an instant on nothing is known of these signals.
    pub fn forget(&mut self, signals: impl IntoIterator<Item = SignalId>, time_ps: u64) {
        for signal in signals {
            self.set(signal, time_ps, Value::Unknown);
        }
    }

    /// The changes in the order of time; of several at one instant a signal keeps the last.
    pub fn finish(self, end_ps: u64) -> Waves {
        let Self { signals, mut changes, .. } = self;
        changes.sort_by_key(|change| (change.time_ps, change.signal));
        let mut kept: Vec<SignalChange> = Vec::with_capacity(changes.len());
        let mut held = vec![None; signals.len()];
        for (at, change) in changes.iter().enumerate() {
            let next = changes.get(at + 1);
            let is_last = next.is_none_or(|next| (next.time_ps, next.signal) != (change.time_ps, change.signal));
            if is_last && held[change.signal.0] != Some(change.value) {
                held[change.signal.0] = Some(change.value);
                kept.push(*change);
            }
        }
        let end_ps = end_ps.max(kept.last().map_or(0, |change| change.time_ps));
        Waves { signals, changes: kept, end_ps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_come_in_the_order_of_time_and_repeat_nothing() {
        let mut recorder = Recorder::default();
        let a = recorder.add("s", "a", SignalKind::Bits(1), Value::Unknown);
        let b = recorder.add("s", "b_uv", SignalKind::Real, Value::Real(0.0));
        recorder.set(b, 30, Value::Real(1.5));
        recorder.set(b, 40, Value::Real(1.5));
        recorder.set(a, 0, Value::Bits(0));
        // A pulse of no length is none.
        recorder.set(a, 20, Value::Bits(1));
        recorder.set(a, 20, Value::Bits(0));
        recorder.set(a, 50, Value::Bits(1));
        let waves = recorder.finish(60);
        assert_eq!(waves.find("s", "b_uv"), Some(b));
        assert_eq!(waves.of(a), [(0, Value::Bits(0)), (50, Value::Bits(1))]);
        assert_eq!(waves.of(b), [(0, Value::Real(0.0)), (30, Value::Real(1.5))]);
        assert!(waves.changes.is_sorted_by_key(|change| change.time_ps));
        assert_eq!((waves.changes.len(), waves.end_ps), (4, 60));
    }
}
