//! Random designs of one small sensor, by keyed draws: they differ behind the lens, so their runs share photons.

use rand::RngExt as _;
use rand::seq::IndexedRandom as _;
use sensel::draw::DrawKey;

/// Pairs and seeds of the published table.
pub const PAIRS: usize = 20;
/// As above.
pub const SEEDS: usize = 200;
/// Names the draw of the designs. A method that was changed after a look at the table is held against a new draw.
pub const DRAW: u64 = 1;
/// The same for replicates.
pub const REPLICATES_DRAW: u64 = 3;
/// Runs of each design in a study of replicates.
pub const REPLICATES: usize = 8;
/// The room and the sensor that all designs share.
pub const ROOM: &str = include_str!("room.toml");

/// A design: keys of the configuration with their values.
pub type Design = Vec<String>;

/// So many designs of a draw.
pub fn random(count: usize, draw: u64) -> Vec<Design> {
    let mut stream = DrawKey::root(draw).stream();
    let mut design = || {
        let mut one_of = |values: &[&'static str]| *values.choose(&mut stream).expect("values to choose from");
        let mut design = vec![
            format!("sensor.adc.bits={}", one_of(&["5", "6", "8", "10"])),
            format!("compute.threshold={}", one_of(&["8", "10", "12", "16"])),
            format!("compute.descriptor_bits={}", one_of(&["128", "256"])),
            format!("compute.per_cell={}", one_of(&["1", "2"])),
        ];
        let noise_uv: f64 = stream.random_range(60.0..600.0);
        design.push(format!("sensor.pixel.read_noise_uv={noise_uv:.0}"));
        design
    };
    (0..count).map(|_| design()).collect()
}
