//! The cost of each effect in each of its cases: a frame with it less the frame without.

use sensel::config::Resolved;
use sensel::effects::chain::{Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters, costs};
use sensel::pixel::SampledLevels;
use sensel::plane::Plane;
use sensel::units::{CameraIndex, FrameIndex, Size};

use super::medians_s;

const SIZE: Size = Size { width_px: 640, height_px: 120 };
const ROUNDS: usize = 61;

/// Every effect at once, of the strength of real sensors.
const ALL_PRESENT: &[&str] = &[
    "sensor.pixel.prnu=0.01",
    "sensor.pixel.parasitic_light=1e-4",
    "sensor.pixel.dead_ppm=100.0",
    "sensor.pixel.dark_current_e_per_s=50.0",
    "sensor.pixel.hot_ppm=100.0",
    "sensor.pixel.hot_dark_e_per_s=1000.0",
    "sensor.pixel.dsnu_e=1.0",
    "sensor.pixel.blooming=0.5",
    "sensor.pixel.image_lag=0.01",
    "sensor.pixel.storage_leakage_per_s=0.5",
    "sensor.pixel.gain_compression=0.05",
    "sensor.die_gain_sigma=0.01",
    "sensor.pixel.rts_ppm=1000.0",
    "sensor.pixel.rts_amplitude_uv=100.0",
    "sensor.pixel.flicker_uv_per_rthz=5.0",
    "sensor.pixel.ktc_noise_uv=200.0",
    "sensor.adc.column_bias_ua=5.0",
    "sensor.pixel.stuck_ppm=100.0",
    "sensor.adc.column_gain_sigma=0.001",
    "sensor.die_offset_uv=100.0",
    "sensor.adc.column_offset_uv=100.0",
    "sensor.adc.column_offset_residual_uv=10.0",
    "sensor.adc.column_noise_uv=20.0",
    "sensor.adc.row_noise_uv=20.0",
    "sensor.adc.row_offset_uv=20.0",
    "sensor.adc.comparator_noise_uv=20.0",
    "sensor.adc.ramp_noise_uv=20.0",
    "sensor.adc.ramp_jitter_ps=500.0",
    "sensor.adc.supply_ripple_uv=20.0",
];

fn parameters(more: &[&str]) -> Parameters {
    let set = ["scene.generator=box"].iter().chain(ALL_PRESENT).chain(more);
    let set: Vec<String> = set.map(|text| (*text).to_owned()).collect();
    let scenario = Resolved::from_layers("bench", "", &set).expect("the keys are known").scenario;
    Parameters { pixel: scenario.pixel().expect("in range"), adc: scenario.adc().expect("in range") }
}

/// A frame of a ramp from dark to nearly the full well, by the effects of these names.
fn frame<'a>(parameters: &Parameters, keeps: impl Fn(&str) -> bool) -> Box<dyn FnMut() + 'a> {
    let mut built = effects::build_all(parameters);
    built.retain(|effect| keeps(effect.name()));
    let chain = Chain::new(parameters.clone(), built, 1, 2);
    let per_photon = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    let most = (0.9 * parameters.pixel.full_well_e / per_photon) as f32;
    let row = (0..SIZE.width_px).map(move |column| most * column as f32 / SIZE.width_px as f32);
    let photons = Plane::from_values(SIZE, row.cycle().take(SIZE.pixel_count()).collect());
    let times = vec![RowTimes { exposure_s: 0.01, storage_s: 0.001, readout_s: 0.0 }; SIZE.height_px as usize];
    let mut number = 0;
    Box::new(move || {
        number += 1;
        let capture = Capture::single(CameraIndex(0), FrameIndex(number));
        std::hint::black_box(chain.capture(&photons, capture, &times));
    })
}

fn ns_per_px(seconds: f64) -> f64 {
    1e9 * seconds / SIZE.pixel_count() as f64
}

pub fn print() {
    let bent = ["sensor.adc.ramp=piecewise", "sensor.adc.ramp_points=[[0.5, 0.25]]"];
    let analog = &["sensor.pixel.type=3T", "sensor.adc.cds=analog"][..];
    let digital = &["sensor.pixel.type=3T", "sensor.adc.cds=digital"][..];
    let settings: [(&str, Vec<&str>); 6] = [
        ("one sample", [&["sensor.pixel.type=3T", "sensor.adc.cds=none"][..]].concat()),
        ("difference", analog.to_vec()),
        ("both samples", digital.to_vec()),
        ("dcnu", [analog, &["sensor.pixel.dcnu=0.5"]].concat()),
        ("bent ramp", [analog, &bent[..]].concat()),
        ("bent ramp, both samples", [digital, &bent[..]].concat()),
    ];
    let mut table: Vec<(String, String, f64)> = Vec::new();
    for (words, set) in &settings {
        let parameters = parameters(set);
        let built = effects::build_all(&parameters);
        let fresh: Vec<(&'static str, &'static str)> = built
            .iter()
            .map(|effect| (effect.name(), effect.cost_case()))
            .filter(|(name, case)| !table.iter().any(|row| row.0 == *name && row.1 == *case))
            .collect();
        // On top of shot noise, so that charge is as uneven as charge is; and shot noise on top of nothing. Where the reset is converted
        // too, on top of another noise of the samples besides: resets that are all equal stand on an edge, which the quick path
        // of the converter leaves to the slow one, and the first noise would be paid for by what that saves.
        let is_both = parameters.adc.cds.samples() == SampledLevels::Both;
        let beside = |own: &str| match (is_both, own) {
            (false, _) => "shot_noise",
            (true, "read_noise") => "ktc_noise",
            (true, _) => "read_noise",
        };
        let among = |names: Vec<&'static str>| frame(&parameters, move |name| names.contains(&name));
        let mut jobs = vec![
            among(vec![]),
            among(vec!["shot_noise"]),
            among(vec!["shot_noise", "read_noise"]),
            among(vec!["shot_noise", "ktc_noise"]),
        ];
        jobs.extend(fresh.iter().map(|&(own, _)| among(vec!["shot_noise", beside(own), own])));
        jobs.push(frame(&parameters, |_| true));
        let times = medians_s(ROUNDS, &mut jobs);
        let of = |job: usize| ns_per_px(times[job]);
        println!("{words}: without effects {:.2} ns per pixel", of(0));
        for (at, (name, case)) in fresh.iter().enumerate() {
            let without = match (*name, beside(name)) {
                ("shot_noise", _) => 0,
                (_, "read_noise") => 2,
                (_, "ktc_noise") => 3,
                _ => 1,
            };
            let cost = of(4 + at) - of(without);
            println!("    cost(\"{name}\", \"{case}\", {:.2}),", cost.max(0.01));
            table.push(((*name).to_owned(), (*case).to_owned(), cost));
        }
        let sum: f64 = built.iter().map(|effect| costs::ns_per_px(effect.as_ref())).sum();
        let base = costs::without_effects_ns_per_px(parameters.adc.cds.samples());
        println!(
            "{words}: all effects measured {:.1}, predicted {:.1} ns per pixel",
            of(jobs_last(&times)),
            base + sum
        );
    }
}

fn jobs_last(times: &[f64]) -> usize {
    times.len() - 1
}
