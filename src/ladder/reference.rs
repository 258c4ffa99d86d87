//! The reference for all settings: every pixel converted clock by clock with all effects. It is sampled in two independent halves until
//! the standard error that they show is at most a third of the finest accuracy shown.

use super::clocks::MeasuredCost;
use super::errors::{PictureReference, Squares};
use super::knobs::{EffectsKnob, RAYS_MOST, RayBudget, Setting};
use super::measure::LadderBench;
use crate::compute::Feature;
use crate::effects::chain::RowSamples;
use crate::error::Error;
use crate::events::Events;
use crate::fidelity::Rung;
use crate::num::{f32_nearest, f64_from_u64, f64_from_usize, greater, u64_from};
use crate::plane::Plane;
use crate::run::Setup;
use crate::run::probe::PictureId;
use crate::scene::lit::REFLECTIONS_MAX;

/// The share of the finest accuracy that the standard error of a ladder's reference may have.
pub const SHARE: f64 = 1.0 / 3.0;
/// Pairs of renders at most. Each is made for the whole error; where images of lamps have most of it more are needed, because a pixel in
/// which no ray met one claims no error.
const ROUNDS_MAX: u32 = 32;
/// Pairs after which their number is foretold: an error of independent pairs falls with their root.
const ROUNDS_LEAST: u32 = 4;

pub struct Judged {
    pub id: PictureId,
    /// Photons of each slot.
    pub truths: Vec<PictureReference>,
    /// Samples of the first slot with all effects.
    pub samples: Vec<RowSamples>,
    /// Codes, clock by clock.
    pub codes: Plane<u16>,
    pub features: Vec<Feature>,
}

pub struct Reference {
    pub setting: Setting,
    pub judged: Vec<Judged>,
    /// Of all pictures: events of sensor and extractor.
    pub events: Events,
    /// Standard error in photon noise.
    pub standard_error: f64,
    pub pixels: u64,
    pub rays_per_pixel: f64,
    /// Per frame of the rig: render, sensor, extractor.
    pub costs: [MeasuredCost; 3],
}

/// Renders the reference of some pictures and takes it through the sensor. Its standard error is at most this share of the finest
/// accuracy. Fails on a standard error that stays too large, with the finest possible accuracy.
pub fn reference(bench: &LadderBench<'_>, ids: &[PictureId], finest: f64, share: f64) -> Result<Reference, Error> {
    let own = Setting::of(&bench.setup.resolved.scenario);
    let tolerance = (finest * share) * (finest * share);
    let rays = if bench.has_rays() {
        RayBudget::Tolerance { tolerance: greater(tolerance, 0.001), most: RAYS_MOST }
    } else {
        own.rays
    };
    let setting = Setting { rung: Rung::Clocked, rays, reflections: REFLECTIONS_MAX, effects: EffectsKnob::All, ..own };
    let mut setup = bench.setup_of(&setting)?;
    let mut halves = Halves::default();
    let mut standard_error;
    loop {
        halves.add_round(bench, &mut setup, ids)?;
        let squares = halves.squares(bench);
        standard_error = squares.mean().sqrt();
        if standard_error <= share * finest || !bench.has_rays() {
            return judged(bench, setting, &setup, ids, halves, standard_error, squares.pixels);
        }
        let ratio = standard_error / (share * finest);
        let foretold = f64::from(halves.rounds) * ratio * ratio;
        if halves.rounds == ROUNDS_MAX || (halves.rounds >= ROUNDS_LEAST && foretold > f64::from(ROUNDS_MAX)) {
            break;
        }
    }
    let would_do = standard_error / share;
    Err(Error::Run(format!(
        "the reference's standard error stays at {standard_error:.3} of photon noise; use an accuracy of {would_do:.2} or more"
    )))
}

/// Sums of independent renders, in two halves.
#[derive(Default)]
struct Halves {
    /// By picture, slot and half.
    sums: Vec<Vec<[Vec<f64>; 2]>>,
    sizes: Option<crate::units::Size>,
    rounds: u32,
    rays: u64,
    cost: MeasuredCost,
}

impl Halves {
    /// One more render for each half of each picture.
    fn add_round(&mut self, bench: &LadderBench<'_>, setup: &mut Setup, ids: &[PictureId]) -> Result<(), Error> {
        self.sums.resize_with(ids.len(), Vec::new);
        for (number, (sums, &id)) in self.sums.iter_mut().zip(ids).enumerate() {
            let share = f64_from_usize(number) / f64_from_usize(ids.len());
            bench.progress.at("reference", share);
            for half in 0..2_u32 {
                // Number 0 is the run's own render, which must not be its own judge.
                setup.fidelity.render.repeat = 1 + 2 * self.rounds + half;
                let (exposures, cost) = bench.clocks.time(|| setup.exposures_at(id));
                self.cost = self.cost.and(cost);
                for (slot, exposure) in exposures?.iter().enumerate() {
                    if sums.len() == slot {
                        let zeros = || vec![0.0; exposure.photons.values().len()];
                        sums.push([zeros(), zeros()]);
                    }
                    self.rays += exposure.rays;
                    self.sizes = Some(exposure.photons.size());
                    let sum = &mut sums[slot][crate::num::index(half)];
                    sum.iter_mut().zip(exposure.photons.values()).for_each(|(sum, &one)| *sum += f64::from(one));
                }
            }
        }
        self.rounds += 1;
        Ok(())
    }

    fn truth(&self, sums: &[Vec<f64>; 2]) -> PictureReference {
        let size = self.sizes.expect("a round was rendered");
        let rounds = f64::from(self.rounds);
        let plane = |values: Vec<f32>| Plane::from_values(size, values);
        let half = |sum: &Vec<f64>| plane(sum.iter().map(|sum| f32_nearest(sum / rounds)).collect());
        let mean = sums[0].iter().zip(&sums[1]).map(|(a, b)| f32_nearest((a + b) / (2.0 * rounds))).collect();
        PictureReference { halves: [half(&sums[0]), half(&sums[1])], photons: plane(mean) }
    }

    /// Of the first slot, which is the longest exposure.
    fn squares(&self, bench: &LadderBench<'_>) -> Squares {
        Squares::sum(self.sums.iter().map(|slots| bench.judge().standard_error(&self.truth(&slots[0]))))
    }
}

fn judged(
    bench: &LadderBench<'_>,
    setting: Setting,
    setup: &Setup,
    ids: &[PictureId],
    halves: Halves,
    standard_error: f64,
    pixels: u64,
) -> Result<Reference, Error> {
    let chain = setup.first_chain();
    let (mut judged, mut events) = (Vec::with_capacity(ids.len()), Events::default());
    let per_rig = f64::from(bench.cameras()) / f64_from_usize(ids.len());
    let mut costs = [halves.cost.times(per_rig), MeasuredCost::default(), MeasuredCost::default()];
    for (slots, &id) in halves.sums.iter().zip(ids) {
        let truths: Vec<PictureReference> = slots.iter().map(|sums| halves.truth(sums)).collect();
        let photons: Vec<Plane<f32>> = truths.iter().map(|truth| truth.photons.clone()).collect();
        let (sensed, sensor) = bench.clocks.time(|| setup.sense_at(&chain, id, &photons));
        let (found, compute) = bench.clocks.time(|| setup.features_at(&sensed.codes));
        let (features, more) = found?;
        events.merge(&sensed.events);
        events.merge(&more);
        costs[1] = costs[1].and(sensor.times(per_rig));
        costs[2] = costs[2].and(compute.times(per_rig));
        let samples = setup.samples_at(&chain, id, &photons[0]);
        judged.push(Judged { id, truths, samples, codes: sensed.codes, features });
    }
    let slots = u64_from(judged.iter().map(|one| one.truths.len()).sum::<usize>());
    let rays_per_pixel = f64_from_u64(halves.rays) / (bench.pixels() * f64_from_u64(slots));
    Ok(Reference { setting, judged, events, standard_error, pixels, rays_per_pixel, costs })
}
