//! Measures each setting's pictures: cost, and error against the reference. Renders and chains are each measured once, however many
//! combinations share them.

use super::clocks::MeasuredCost;
use super::errors::{CodeError, SharedFeatures, Squares, feature_f1};
use super::knobs::Setting;
use super::measure::LadderBench;
use super::reference::{Judged, Reference};
use crate::energy::EnergyAccount;
use crate::error::Error;
use crate::events::Events;
use crate::num::{f64_from_u64, f64_from_usize, u32_from, u64_from};
use crate::plane::Plane;
use crate::run::Setup;

/// What the lens saw at one setting of rays and reflections.
pub struct Rendered {
    /// Rays and reflections count.
    pub setting: Setting,
    /// By picture and slot.
    pub photons: Vec<Vec<Plane<f32>>>,
    /// Of each picture.
    pub errors: Vec<Squares>,
    /// Per frame of the rig.
    pub cost: MeasuredCost,
    pub rays_per_pixel: f64,
}

/// A chain from photons to codes: a rung with its effects.
pub struct Sensing {
    /// Rung and effects count.
    pub setting: Setting,
    pub setup: Setup,
    /// Of each picture: what the effects left out change.
    pub errors: Vec<Squares>,
    /// Per frame of the rig, on photons of the reference.
    pub cost: MeasuredCost,
}

/// What came out of a render and a chain together, against the reference.
#[derive(Clone, Copy, Debug)]
pub struct RenderedCodes {
    pub codes: CodeError,
    pub features: SharedFeatures,
    /// Of sensor and extractor, over the reference's, less 1.
    pub energy_error: f64,
    /// Of the extractor, per frame of the rig.
    pub compute: MeasuredCost,
}

pub fn mean_square(errors: &[Squares]) -> f64 {
    Squares::sum(errors.iter().copied()).mean()
}

/// Renders every setting's pictures `repeats` times, in turns; the first pass gives the error, every pass the cost.
pub fn render_all(
    bench: &LadderBench<'_>,
    reference: &Reference,
    settings: &[Setting],
    repeats: u32,
) -> Result<Vec<Rendered>, Error> {
    let setups: Vec<Setup> = settings.iter().map(|setting| bench.setup_of(setting)).collect::<Result<_, _>>()?;
    let pictures = reference.judged.len();
    let mut best = vec![vec![MeasuredCost::UNKNOWN; pictures]; settings.len()];
    let mut rendered: Vec<Rendered> = Vec::with_capacity(settings.len());
    let (steps, mut done) = (f64_from_usize(settings.len()) * f64::from(repeats), 0.0);
    for repeat in 0..repeats {
        for (number, setup) in setups.iter().enumerate() {
            bench.progress.at("renders", done / steps);
            done += 1.0;
            let mut one = Rendered {
                setting: settings[number].clone(),
                photons: Vec::new(),
                errors: Vec::new(),
                cost: MeasuredCost::default(),
                rays_per_pixel: 0.0,
            };
            for (picture, judged) in reference.judged.iter().enumerate() {
                let (seen, cost) = rendered_picture(bench, setup, judged)?;
                best[number][picture] = best[number][picture].best(cost);
                one.rays_per_pixel += seen.rays_per_pixel / f64_from_usize(pictures);
                one.errors.push(seen.error);
                one.photons.push(seen.photons);
            }
            if repeat == 0 {
                rendered.push(one);
            }
        }
    }
    for (one, best) in rendered.iter_mut().zip(best) {
        one.cost = per_rig(bench, &best);
    }
    Ok(rendered)
}

/// Renders a setting's pictures, in an order that is spread over all of them at every time, until there is no hope for it any more.
/// Photons are not kept; errors stand in the order of the frames.
pub fn render_until(
    bench: &LadderBench<'_>,
    reference: &Reference,
    setting: &Setting,
    hopeless: &dyn Fn(&Rendered) -> bool,
) -> Result<Rendered, Error> {
    let setup = bench.setup_of(setting)?;
    let mut order: Vec<usize> = (0..reference.judged.len()).collect();
    // The greatest steps first, as a ruler's marks are.
    order.sort_by_key(|at| at.reverse_bits());
    let (mut errors, mut costs, mut rays_per_pixel) = (Vec::new(), Vec::new(), 0.0);
    loop {
        let at = order[errors.len()];
        let (seen, cost) = rendered_picture(bench, &setup, &reference.judged[at])?;
        errors.push((at, seen.error));
        costs.push(cost);
        rays_per_pixel += seen.rays_per_pixel;
        errors.sort_by_key(|(at, _)| *at);
        let one = Rendered {
            setting: setting.clone(),
            photons: Vec::new(),
            errors: errors.iter().map(|(_, error)| *error).collect(),
            cost: per_rig(bench, &costs),
            rays_per_pixel: rays_per_pixel / f64_from_usize(costs.len()),
        };
        if errors.len() == order.len() || hopeless(&one) {
            return Ok(one);
        }
    }
}

struct RenderedPicture {
    photons: Vec<Plane<f32>>,
    error: Squares,
    rays_per_pixel: f64,
}

fn rendered_picture(
    bench: &LadderBench<'_>,
    setup: &Setup,
    judged: &Judged,
) -> Result<(RenderedPicture, MeasuredCost), Error> {
    let (exposures, cost) = bench.clocks.time(|| setup.exposures_at(judged.id));
    let exposures = exposures?;
    let rays: u64 = exposures.iter().map(|exposure| exposure.rays).sum();
    let seen = RenderedPicture {
        error: bench.judge().render_error(&exposures[0].photons, &judged.truths[0]),
        rays_per_pixel: f64_from_u64(rays) / (bench.pixels() * f64_from_usize(exposures.len())),
        photons: exposures.into_iter().map(|exposure| exposure.photons).collect(),
    };
    Ok((seen, cost))
}

/// Takes the reference's photons through every setting's chain this many times, in turns.
pub fn sense_all(
    bench: &LadderBench<'_>,
    reference: &Reference,
    settings: &[Setting],
    repeats: u32,
) -> Result<Vec<Sensing>, Error> {
    let sensing = |setting: &Setting| -> Result<Sensing, Error> {
        let setup = bench.setup_of(setting)?;
        let errors = effect_errors(bench, reference, &setup);
        Ok(Sensing { setting: setting.clone(), setup, errors, cost: MeasuredCost::UNKNOWN })
    };
    let mut all = settings.iter().map(sensing).collect::<Result<Vec<_>, _>>()?;
    let chains: Vec<_> = all.iter().map(|one| one.setup.first_chain()).collect();
    let mut best = vec![vec![MeasuredCost::UNKNOWN; reference.judged.len()]; settings.len()];
    for repeat in 0..repeats {
        bench.progress.at("sensors", f64::from(repeat) / f64::from(repeats));
        for (number, (one, chain)) in all.iter().zip(&chains).enumerate() {
            for (picture, judged) in reference.judged.iter().enumerate() {
                let photons: Vec<Plane<f32>> = judged.truths.iter().map(|truth| truth.photons.clone()).collect();
                let (_, cost) = bench.clocks.time(|| one.setup.sense_at(chain, judged.id, &photons));
                best[number][picture] = best[number][picture].best(cost);
            }
        }
    }
    for (one, best) in all.iter_mut().zip(best) {
        one.cost = per_rig(bench, &best);
    }
    Ok(all)
}

/// What the effects that a setup leaves out change in each picture, in electrons before quantisation, under the same draws.
fn effect_errors(bench: &LadderBench<'_>, reference: &Reference, setup: &Setup) -> Vec<Squares> {
    let (judge, chain) = (bench.judge(), setup.first_chain());
    let per_uv = 1.0 / bench.setup.sensor.parameters.pixel.conversion_gain_uv_per_e;
    let mut all = Vec::with_capacity(reference.judged.len());
    for judged in &reference.judged {
        let photons = &judged.truths[0].photons;
        let samples = setup.samples_at(&chain, judged.id, photons);
        let mut squares = Squares::default();
        // Windows and binning make fewer samples than photons; then the picture's mean light stands for a pixel's.
        let same = photons.width_px() == judged.samples[0].signal_uv.len() && photons.height_px() == samples.len();
        for (row, (found, full)) in samples.iter().zip(&judged.samples).enumerate() {
            for column in 0..found.signal_uv.len() {
                let light = if same { photons.at(column, row) } else { photons.at(0, 0) };
                if !judge.counts(light) {
                    continue;
                }
                let net = |of: &crate::effects::chain::RowSamples| {
                    f64::from(of.signal_uv[column]) - of.reset_uv.get(column).map_or(0.0, |&reset| f64::from(reset))
                };
                let error_e = per_uv * (net(found) - net(full));
                squares.sum += error_e * error_e / judge.photon_variance_e2(light);
                squares.pixels += 1;
            }
        }
        all.push(squares);
    }
    all
}

/// A render and a chain together: codes, features and energy against the reference's.
pub fn outcome(
    bench: &LadderBench<'_>,
    reference: &Reference,
    photons: &[Vec<Plane<f32>>],
    sensing: &Sensing,
) -> Result<RenderedCodes, Error> {
    let chain = sensing.setup.first_chain();
    let (mut codes, mut features, mut events) = (CodeError::default(), SharedFeatures::default(), Events::default());
    let mut costs = Vec::new();
    for (photons, judged) in photons.iter().zip(&reference.judged) {
        let sensed = sensing.setup.sense_at(&chain, judged.id, photons);
        codes.add(&sensed.codes, &judged.codes);
        let (found, cost) = bench.clocks.time(|| sensing.setup.features_at(&sensed.codes));
        let (found, more) = found?;
        features.add(feature_f1(&found, &judged.features));
        events.merge(&sensed.events);
        events.merge(&more);
        costs.push(cost);
    }
    let energy_error = energy_pj(bench, reference, &events) / energy_pj(bench, reference, &reference.events) - 1.0;
    Ok(RenderedCodes { codes, features, energy_error, compute: per_rig(bench, &costs) })
}

fn energy_pj(bench: &LadderBench<'_>, reference: &Reference, events: &Events) -> f64 {
    let sensor = &bench.setup.sensor;
    let frames = u32_from(reference.judged.len());
    let pixels = u64_from(sensor.size.pixel_count());
    EnergyAccount::of(events, frames, 1, pixels, &sensor.power).total_pj_per_frame()
}

/// Mean over pictures of one camera, for all cameras of the rig.
fn per_rig(bench: &LadderBench<'_>, costs: &[MeasuredCost]) -> MeasuredCost {
    let sum = costs.iter().fold(MeasuredCost::default(), |sum, &cost| sum.and(cost));
    sum.times(f64::from(bench.cameras()) / f64_from_usize(costs.len()))
}
