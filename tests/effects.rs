//! Only what a scene calls for: each effect runs over pixels where it matters and over none where it does not, and inside a frame draws
//! that cannot show are not made, without a changed bit.

#![allow(clippy::unwrap_used)]

#[path = "effects/cases.rs"]
mod cases;
#[path = "effects/document.rs"]
mod document;
#[path = "effects/numbers.rs"]
mod numbers;
#[path = "effects/within.rs"]
mod within;

use std::collections::BTreeMap;

use cases::{CASES, Case, Idle, Light};
use sensel::config::Resolved;
use sensel::effects::chain::{Capture, Captured, Chain, RowTimes};
use sensel::effects::plan::{EffectChoice, Plan, plan};
use sensel::effects::regions::{LightBounds, regions};
use sensel::effects::{self, Parameters, costs};
use sensel::num::{f32_nearest, f64_from_usize};
use sensel::pixel;
use sensel::plane::Plane;
use sensel::units::{CameraIndex, FrameIndex, Size};

const SIZE: Size = Size { width_px: 96, height_px: 32 };
const TIMES: RowTimes = RowTimes { exposure_s: 0.01, storage_s: 0.005, readout_s: 0.0 };

/// A sensor on which every effect is off or far too weak to matter, and what is set over it.
fn parameters(set: &[&str]) -> Parameters {
    let mut assignments = vec!["scene.generator=box"];
    assignments.extend(cases::QUIET);
    assignments.extend(set);
    let assignments: Vec<String> = assignments.into_iter().map(str::to_owned).collect();
    let resolved = Resolved::from_layers("test", "", &assignments).unwrap();
    Parameters { pixel: resolved.scenario.pixel().unwrap(), adc: resolved.scenario.adc().unwrap() }
}

fn planned(parameters: &Parameters, signal_e: [f64; 2]) -> Plan {
    let efficiency = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    let [photons_min, photons_max] = signal_e.map(|signal_e| signal_e / efficiency);
    let light = LightBounds { photons_min, photons_max };
    let dies = pixel::die_spread(&parameters.pixel, 6, 1, SIZE);
    let regions = regions(parameters, light, TIMES.exposure_s, TIMES.storage_s, dies);
    plan(effects::build_all(parameters), &regions, 0.1, &EffectChoice::parse("auto", &[]).unwrap())
}

/// A frame of a wedge between two signals, by the effects that the plan keeps.
fn captured(parameters: &Parameters, signal_e: [f64; 2]) -> (Plan, Captured) {
    let mut plan = planned(parameters, signal_e);
    let kept = std::mem::take(&mut plan.effects);
    let chain = Chain::new(parameters.clone(), kept, 5, 6);
    let efficiency = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    let last = f64_from_usize(SIZE.pixel_count() - 1);
    let photons = |at: usize| {
        let share = f64_from_usize(at) / last;
        f32_nearest((signal_e[0] + share * (signal_e[1] - signal_e[0])) / efficiency)
    };
    let plane = Plane::from_values(SIZE, (0..SIZE.pixel_count()).map(photons).collect());
    let times = vec![TIMES; plane.height_px()];
    let captured = chain.capture(&plane, Capture::single(CameraIndex(0), FrameIndex(0)), &times);
    (plan, captured)
}

fn signal_e(light: Light) -> [f64; 2] {
    match light {
        Light::Dark => [0.0, 1e-4],
        Light::Room => [50.0, 2000.0],
        Light::Beyond => [500.0, 20_000.0],
    }
}

/// An effect that is new to the list fails here until it has a case of both kinds.
#[test]
fn every_effect_runs_over_pixels_where_its_scene_calls_for_it_and_over_none_where_not() {
    let names: Vec<&str> = CASES.iter().map(|case| case.effect).collect();
    assert_eq!(names, effects::names(), "one case for each effect, in physical order");
    let mut hits = BTreeMap::new();
    for Case { effect, called, idle } in CASES {
        let (plan, frame) = captured(&parameters(called.set), signal_e(called.light));
        let of = |frame: &Captured| frame.hits.iter().find(|(name, _)| name == effect).map_or(0, |(_, hits)| *hits);
        let words: Vec<String> = plan.omitted.iter().map(|effect| effect.words(plan.budget_e)).collect();
        assert!(of(&frame) > 0, "{effect} is called for and ran nowhere: {words:?}");
        hits.insert(*effect, of(&frame));
        let (set, light) = match idle {
            Idle::There { set, light } | Idle::Absent { set, light } => (set, light),
        };
        let parameters = parameters(set);
        let (plan, frame) = captured(&parameters, signal_e(*light));
        assert_eq!(of(&frame), 0, "{effect} is not called for");
        let is_there = effects::build_all(&parameters).iter().any(|built| built.name() == *effect);
        let is_left_out = plan.omitted.iter().any(|omitted| omitted.name == *effect);
        let expected = matches!(idle, Idle::There { .. });
        assert_eq!(
            (is_there, is_left_out),
            (expected, expected),
            "{effect}: a sensor that has it, and a plan that leaves it out"
        );
    }
    println!("pixels of {}: {hits:?}", SIZE.pixel_count());
    // Defects act on their own pixels alone: 5 % of 3,072 are 154, and so often sparse ones are fewer than all.
    for sparse in ["dead_pixels", "hot_pixels", "stuck_pixels", "rts_noise"] {
        assert!((50..600).contains(&hits[sparse]), "{sparse}: {}", hits[sparse]);
    }
    for everywhere in ["prnu", "shot_noise", "blooming", "image_lag", "read_noise", "row_noise"] {
        assert_eq!(hits[everywhere], 3072, "{everywhere}");
    }
}

/// Whatever a configuration makes of an effect has a row in the table of costs, and each row is of an effect of the list.
#[test]
fn every_effect_has_a_measured_cost_in_each_of_its_cases() {
    let mut seen = Vec::new();
    for cds in ["none", "analog", "digital"] {
        for ramp in [&[][..], &["sensor.adc.ramp=piecewise", "sensor.adc.ramp_points=[[0.5, 0.25]]"]] {
            for dcnu in ["0.0", "0.5"] {
                let mut set = vec![format!("sensor.adc.cds={cds}"), format!("sensor.pixel.dcnu={dcnu}")];
                set.extend(cases::ALL_PRESENT.iter().chain(ramp).map(|set| (*set).to_owned()));
                let set: Vec<&str> = set.iter().map(String::as_str).collect();
                for effect in effects::build_all(&parameters(&set)) {
                    let case = (effect.name(), effect.cost_case());
                    assert!(costs::ns_per_px(effect.as_ref()) > 0.0, "{case:?} has no cost");
                    if !seen.contains(&case) {
                        seen.push(case);
                    }
                }
            }
        }
    }
    for row in costs::COSTS {
        assert!(seen.contains(&(row.effect, row.case)), "no configuration makes {row:?}");
    }
    let mut order: Vec<&str> = costs::COSTS.iter().map(|row| row.effect).collect();
    order.dedup();
    assert_eq!(order, effects::names(), "the table stands in physical order");
    println!("{} cases of {} effects", seen.len(), order.len());
}

#[test]
fn an_effect_that_is_left_out_is_told_in_words_with_its_budget() {
    let parameters = parameters(&["sensor.pixel.dark_current_e_per_s=10.0"]);
    let efficiency = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    let light = LightBounds { photons_min: 100.0 / efficiency, photons_max: 2000.0 / efficiency };
    let regions = regions(&parameters, light, 12e-6, 0.0, pixel::ANY_DIE);
    let made = plan(effects::build_all(&parameters), &regions, 0.1, &EffectChoice::parse("auto", &[]).unwrap());
    let words: Vec<String> = made.omitted.iter().map(|effect| effect.words(made.budget_e)).collect();
    let dark = words.iter().find(|words| words.starts_with("dark current")).unwrap();
    // 10 e-/s in 12 us.
    assert!(dark.starts_with("dark current left out: 0.00012 e- at 12 us and 300 K, budget 1"), "{dark}");
    // The parts of the budget are those of the sum.
    let parts: f64 = made.omitted.iter().map(|effect| effect.budget_share).sum();
    assert!((parts - made.budget_used).abs() < 1e-12 && made.budget_used > 0.0 && made.budget_used <= 1.0, "{parts}");
    let all = made.cost_ns_per_px + made.omitted.iter().map(|effect| effect.cost_ns_per_px).sum::<f64>();
    assert!((all - made.cost_of_all_ns_per_px).abs() < 1e-9);
}
