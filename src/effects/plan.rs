//! The planner: from facts and bounds to the list of effects that a scene calls for.
//!
//! An effect is left out only if all that is left out stays, in every region, within
//! `bias^2 + variance <= (accuracy * sigma_t)^2`. An effect that cannot state a bound stays. The bound holds up to the image,
//! before quantisation; decisions downstream can flip on any difference.

use super::costs;
use crate::effect::{Domain, Effect, Omission};
use crate::facts::{Facts, readable};

/// A region with the noise its pixels have anyway.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// What is known of it.
    pub facts: Facts,
    /// Least total temporal noise of a pixel of the region, sigma in electrons.
    pub sigma_e: f64,
}

/// An effect that was left out, with its bound (the greatest over regions).
#[derive(Clone, Debug, PartialEq)]
pub struct Omitted {
    /// The effect's name.
    pub name: &'static str,
    /// Bound of the systematic part in electrons.
    pub bias_e: f64,
    /// Sigma of the random part in electrons.
    pub sigma_e: f64,
    /// The share of the budget that it takes, in the region where all omitted effects together take most: biases add absolutely, so its
    /// part of the mean square error is its bias times the sum of all biases, plus its variance. 0 with a budget of 0.
    pub budget_share: f64,
    /// Predicted time that leaving it out saves.
    pub cost_ns_per_px: f64,
    /// Why, as the plan prints it.
    pub reason: String,
}

/// An effect that stays, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptEffect {
    /// The effect's name.
    pub name: &'static str,
    /// What its absence could change at most, root of the mean square, in electrons; none where it cannot say.
    pub error_e: Option<f64>,
    /// Predicted.
    pub cost_ns_per_px: f64,
    /// Why, as the plan prints it.
    pub reason: String,
}

impl Omitted {
    /// A sentence for a person: "dark current left out: 0.00012 e- at 12 us and 300 K, budget 0.31 e-".
    pub fn words(&self, budget_e: f64) -> String {
        words(self.name, "left out", &self.reason, budget_e)
    }
}

impl KeptEffect {
    /// A sentence for a person: "prnu kept: 1 % of 2000 e- is 20 e- between pixels, budget 0.31 e-".
    pub fn words(&self, budget_e: f64) -> String {
        words(self.name, "kept", &self.reason, budget_e)
    }
}

fn words(name: &str, decision: &str, reason: &str, budget_e: f64) -> String {
    format!("{} {decision}: {reason}, budget {} e-", name.replace('_', " "), readable(budget_e))
}

/// What runs and what does not, with the bound of all that is left out together.
pub struct Plan {
    /// Effects to run, in physical order.
    pub effects: Vec<Box<dyn Effect>>,
    /// The same effects with their reasons.
    pub kept: Vec<KeptEffect>,
    /// Left out, in physical order.
    pub omitted: Vec<Omitted>,
    /// Sum of all omissions in the region where it is greatest.
    pub bound: Omission,
    /// Budget of the tightest region: accuracy times its sigma, in electrons.
    pub budget_e: f64,
    /// Share of the budget that all omissions together take, as mean square errors, where it is greatest.
    pub budget_used: f64,
    /// Predicted cost of the kept effects in nanoseconds per pixel.
    pub cost_ns_per_px: f64,
    /// Predicted cost of all effects.
    pub cost_of_all_ns_per_px: f64,
}

/// What the user asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EffectChoice {
    /// The planner decides.
    Auto {
        /// Kept regardless of their bound.
        added: Vec<String>,
        /// Left out regardless of their bound; the plan still states it.
        removed: Vec<String>,
    },
    /// Every effect whose parameters are not zero.
    All,
    /// None at all: expected charge, ideal converters.
    None,
}

impl EffectChoice {
    /// Reads "auto", "all", "none" or "+name,-name". Fails on a part that is none of these, and names it.
    pub fn parse(text: &str, known: &[&str]) -> Result<Self, String> {
        let (mut added, mut removed) = (Vec::new(), Vec::new());
        match text.trim() {
            "all" => return Ok(Self::All),
            "none" => return Ok(Self::None),
            "auto" => return Ok(Self::Auto { added, removed }),
            _ => {}
        }
        for part in text.split(',').map(str::trim) {
            let (list, name) = match (part.strip_prefix('+'), part.strip_prefix('-')) {
                (Some(name), _) => (&mut added, name),
                (_, Some(name)) => (&mut removed, name),
                _ => return Err(format!("'{part}' is not auto, all, none, +name or -name")),
            };
            if !known.contains(&name) {
                return Err(format!("effect '{name}' is not known; known: {}", known.join(", ")));
            }
            list.push(name.to_owned());
        }
        Ok(Self::Auto { added, removed })
    }
}

/// Bound of what an effect's absence changes at the end of the chain: its own, times the greatest slope of what comes after it.
pub fn bound(effect: &dyn Effect, facts: &Facts) -> Option<Omission> {
    let spill = if effect.domain() < Domain::ArrayElectrons { facts.spill_slope_max } else { 1.0 };
    let slope = spill * facts.gain_slope_max;
    let own = effect.omission(facts)?;
    Some(Omission { bias_e: slope * own.bias_e, variance_e2: slope * slope * own.variance_e2 })
}

/// Decides which effects run. `accuracy` is the share of a pixel's own noise that all omissions together may reach.
pub fn plan(effects: Vec<Box<dyn Effect>>, regions: &[Region], accuracy: f64, choice: &EffectChoice) -> Plan {
    assert!(accuracy >= 0.0, "a negative error budget cannot be met");
    assert!(!regions.is_empty(), "a plan needs at least one region");
    let omissions: Vec<Vec<Option<Omission>>> = effects
        .iter()
        .map(|effect| regions.iter().map(|region| bound(effect.as_ref(), &region.facts)).collect())
        .collect();
    let omit = choose(&effects, &omissions, regions, accuracy, choice);
    let all = sums(&omissions, &omit, regions.len());
    let budgets_e: Vec<f64> = regions.iter().map(|region| accuracy * region.sigma_e).collect();
    let fullest = fullest_region(&all, &budgets_e);
    let share_of =
        |error_e2: f64| if error_e2 > 0.0 { error_e2 / (budgets_e[fullest] * budgets_e[fullest]) } else { 0.0 };

    let mut plan = Plan {
        effects: Vec::new(),
        kept: Vec::new(),
        omitted: Vec::new(),
        bound: worst(&all),
        budget_e: budgets_e.iter().fold(f64::INFINITY, |least, &budget_e| crate::num::lesser(least, budget_e)),
        budget_used: share_of(all[fullest].error_e2()),
        cost_ns_per_px: 0.0,
        cost_of_all_ns_per_px: effects.iter().map(|effect| costs::ns_per_px(effect.as_ref())).sum(),
    };
    for (index, effect) in effects.into_iter().enumerate() {
        let widest = worst_region(&omissions[index]);
        let reason = effect.reason(&regions[widest].facts);
        let cost_ns_per_px = costs::ns_per_px(effect.as_ref());
        if omit[index] {
            let bound = omissions[index][widest].unwrap_or(Omission { bias_e: f64::INFINITY, variance_e2: 0.0 });
            let sigma_e = bound.variance_e2.sqrt();
            let own = omissions[index][fullest].unwrap_or(bound);
            let budget_share = share_of(own.bias_e * all[fullest].bias_e + own.variance_e2);
            let name = effect.name();
            plan.omitted.push(Omitted { name, bias_e: bound.bias_e, sigma_e, budget_share, cost_ns_per_px, reason });
        } else {
            let error_e = omissions[index][widest].map(|bound| bound.error_e2().sqrt());
            plan.cost_ns_per_px += cost_ns_per_px;
            plan.kept.push(KeptEffect { name: effect.name(), error_e, cost_ns_per_px, reason });
            plan.effects.push(effect);
        }
    }
    plan // Both lists are still in the order in which light and charge meet the effects.
}

fn choose(
    effects: &[Box<dyn Effect>],
    omissions: &[Vec<Option<Omission>>],
    regions: &[Region],
    accuracy: f64,
    choice: &EffectChoice,
) -> Vec<bool> {
    let (added, removed) = match choice {
        EffectChoice::All => return vec![false; effects.len()],
        EffectChoice::None => return vec![true; effects.len()],
        EffectChoice::Auto { added, removed } => (added, removed),
    };
    let named = |list: &[String], index: usize| list.iter().any(|name| name == effects[index].name());
    let mut omit: Vec<bool> = (0..effects.len()).map(|index| named(removed, index)).collect();
    // The budget is for what the planner leaves out; what the user removed is stated in the bound but not charged to it.
    let mut planned = vec![false; effects.len()];
    let mut by_error: Vec<usize> = (0..effects.len()).filter(|&index| !omit[index] && !named(added, index)).collect();
    by_error.sort_by(|&a, &b| share(&omissions[a], regions).total_cmp(&share(&omissions[b], regions)));
    for index in by_error {
        if omissions[index].iter().any(Option::is_none) {
            continue;
        }
        planned[index] = true;
        let within = sums(omissions, &planned, regions.len()).iter().zip(regions).all(|(sum, region)| {
            let budget_e = accuracy * region.sigma_e;
            sum.error_e2() <= budget_e * budget_e // False for NaN: an effect without a bound stays.
        });
        planned[index] = within;
        omit[index] = within;
    }
    omit
}

/// Greatest mean square error over the region's own noise variance; infinite without a bound.
fn share(omissions: &[Option<Omission>], regions: &[Region]) -> f64 {
    omissions.iter().zip(regions).fold(0.0, |most, (omission, region)| {
        let share = omission.map_or(f64::INFINITY, |omission| omission.error_e2() / (region.sigma_e * region.sigma_e));
        crate::num::greater(most, if share.is_nan() { 0.0 } else { share })
    })
}

fn sums(omissions: &[Vec<Option<Omission>>], omit: &[bool], regions: usize) -> Vec<Omission> {
    let mut sums = vec![Omission::NONE; regions];
    for (row, _) in omissions.iter().zip(omit).filter(|(_, omit)| **omit) {
        for (sum, omission) in sums.iter_mut().zip(row) {
            *sum = sum.and(omission.unwrap_or(Omission { bias_e: f64::INFINITY, variance_e2: 0.0 }));
        }
    }
    sums
}

/// Where all omissions together take most of the budget.
fn fullest_region(sums: &[Omission], budgets_e: &[f64]) -> usize {
    first_greatest(sums.len(), |region| sums[region].error_e2() / (budgets_e[region] * budgets_e[region]))
}

/// The first of the indices with the greatest value.
fn first_greatest(count: usize, value: impl Fn(usize) -> f64) -> usize {
    (1..count).fold(0, |most, at| if value(at) > value(most) { at } else { most })
}

fn worst(sums: &[Omission]) -> Omission {
    let worse = |worst: Omission, &sum: &Omission| if sum.error_e2() > worst.error_e2() { sum } else { worst };
    sums.iter().fold(Omission::NONE, worse)
}

fn worst_region(omissions: &[Option<Omission>]) -> usize {
    first_greatest(omissions.len(), |region| omissions[region].map_or(f64::INFINITY, Omission::error_e2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::EffectNumber;
    use crate::effect::{Domain, Identity, RowPass};

    struct SampleEffect {
        name: &'static str,
        omission: Option<Omission>,
    }

    impl Effect for SampleEffect {
        fn identity(&self) -> Identity {
            Identity { name: self.name, number: EffectNumber(0), domain: Domain::Electrons }
        }
        fn omission(&self, _: &Facts) -> Option<Omission> {
            self.omission
        }
        fn reason(&self, _: &Facts) -> String {
            String::new()
        }
        fn apply(&self, _: &mut RowPass<'_>) {}
    }

    fn region(sigma_e: f64) -> Region {
        let facts = Facts {
            signal_e_min: 0.0,
            signal_e_max: 100.0,
            is_capped: false,
            frame_e_max: 100.0,
            dark_mean_e: 0.0,
            dark_rms_e: 0.0,
            exposure_s: 0.01,
            storage_s_max: 0.0,
            temperature_k: 300.0,
            dies: crate::pixel::ANY_DIE,
            conversion_gain_uv_per_e: 10.0,
            spill_slope_max: 1.0,
            gain_slope_max: 1.0,
        };
        Region { facts, sigma_e }
    }

    fn sample(name: &'static str, bias_e: f64, variance_e2: f64) -> Box<dyn Effect> {
        Box::new(SampleEffect { name, omission: Some(Omission { bias_e, variance_e2 }) })
    }

    fn auto() -> EffectChoice {
        EffectChoice::parse("auto", &[]).unwrap()
    }

    #[test]
    fn biases_add_absolutely_so_three_small_ones_can_be_too_many() {
        // Budget 1 e-: each bias of 0.4 e- fits, two make 0.8, three make 1.2 and do not.
        let effects = vec![sample("a", 0.4, 0.0), sample("b", 0.4, 0.0), sample("c", 0.4, 0.0)];
        let plan = plan(effects, &[region(10.0)], 0.1, &auto());
        assert_eq!(plan.omitted.len(), 2);
        assert_eq!(plan.kept.len(), 1);
        assert!((plan.bound.bias_e - 0.8).abs() < 1e-12);
    }

    #[test]
    fn a_bound_grows_by_the_slope_of_what_comes_after() {
        let mut spilling = region(1.0);
        (spilling.facts.spill_slope_max, spilling.facts.gain_slope_max) = (3.0, 2.0);
        let found = bound(sample("a", 1.0, 1.0).as_ref(), &spilling.facts).unwrap();
        assert_eq!(found, Omission { bias_e: 6.0, variance_e2: 36.0 });
    }

    #[test]
    fn the_tightest_region_decides() {
        let make = || vec![sample("a", 0.4, 0.0)];
        assert_eq!(plan(make(), &[region(10.0)], 0.1, &auto()).kept.len(), 0);
        assert_eq!(plan(make(), &[region(10.0), region(1.0)], 0.1, &auto()).kept.len(), 1);
    }

    #[test]
    fn an_effect_without_a_bound_stays() {
        let unknown: Vec<Box<dyn Effect>> =
            vec![Box::new(SampleEffect { name: "x", omission: None }), sample("n", f64::NAN, 0.0)];
        assert_eq!(plan(unknown, &[region(1e9)], 0.1, &auto()).kept.len(), 2);
    }

    #[test]
    fn the_users_word_goes_before_the_budget() {
        let make = || vec![sample("big", 1e6, 0.0), sample("small", 0.0, 0.0)];
        let choice = EffectChoice::parse("-big,+small", &["big", "small"]).unwrap();
        let chosen = plan(make(), &[region(1.0)], 0.1, &choice);
        assert_eq!(chosen.omitted[0].name, "big");
        assert_eq!(chosen.kept[0].name, "small");
        assert_eq!(chosen.bound.bias_e, 1e6, "what the user removed is still stated");
        assert_eq!(plan(make(), &[region(1.0)], 0.1, &EffectChoice::All).kept.len(), 2);
        assert_eq!(plan(make(), &[region(1.0)], 0.1, &EffectChoice::None).kept.len(), 0);
        assert!(EffectChoice::parse("+other", &["big"]).is_err());
    }
}
