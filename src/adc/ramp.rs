//! The ramp as its levels: the level in nV of the ramp at each clock, from checked parameters.
//!
//! Ramp level k is where the ramp is after k clocks, k = 0 its bottom. A plain linear ramp has level k at
//! round(k span / 2^b) nV, halves up, in closed form. Every other ramp is a table: its shape (equal steps, straight pieces, or given
//! levels), plus the bow of its generator, behind the lag of the line that carries it, rounded half-even to nV.
//!
//! The lag is that of a first-order system (a driver's output resistance and the line's capacitance): y' = (x - y) / tau. For
//! an input that is straight between clocks the solution is exact, `y[k+1] = x[k+1] - m tau + (y[k] - x[k] + m tau) exp(-1 / tau)`
//! with m = x[k+1] - x[k]; for equal steps s it is y[k] = s (k - tau (1 - exp(-k / tau))).

use super::params::{AdcParams, Ramp};
use crate::error::Error;
use crate::num::{f64_from_i64, f64_from_u64, f64_from_usize, greater, i64_half_even, index, u32_from};

/// The levels of a ramp; they never fall.
#[derive(Clone, Debug, PartialEq)]
pub struct RampLevels {
    bits: u32,
    span_nv: i64,
    /// Levels 0 to 2^b - 1 of a ramp that is not plainly linear.
    table_nv: Option<Vec<i64>>,
}

impl RampLevels {
    /// Builds the levels. Fails on keys that do not go with the ramp's shape, and ramps that fall somewhere, by the key that makes them
    /// fall.
    pub fn new(params: &AdcParams) -> Result<Self, Error> {
        check_keys(params)?;
        let table_nv = if params.has_equal_steps() { None } else { Some(table_nv(params)?) };
        let ramp_levels = Self { bits: params.bits, span_nv: params.span_nv(), table_nv };
        ramp_levels.check_pedestal(params)?;
        Ok(ramp_levels)
    }

    /// Whether the steps are equal, in closed form.
    pub fn has_equal_steps(&self) -> bool {
        self.table_nv.is_none()
    }

    /// Where the ramp is after `k` clocks, in nV above its bottom.
    pub fn ramp_level_nv(&self, k: u32) -> i64 {
        match &self.table_nv {
            None => linear_level_nv(self.bits, self.span_nv, k),
            Some(table_nv) => table_nv[index(k)],
        }
    }

    /// How many of the ramp's levels 1 to `most` are at or below a column's level.
    pub fn count(&self, level_nv: i64, most: u32) -> u32 {
        if most == 0 || level_nv < self.ramp_level_nv(1) {
            return 0;
        }
        if level_nv >= self.ramp_level_nv(most) {
            return most;
        }
        match &self.table_nv {
            None => {
                // Ramp level k is at or below s when 2 k span < (2 s + 1) 2^b; the level lies below 2^16 spans, so nothing overflows.
                let count = (((2 * level_nv + 1) << (self.bits - 1)) - 1) / self.span_nv;
                u32::try_from(count).expect("fewer than `most` levels")
            }
            Some(table_nv) => u32_from(table_nv[1..=index(most)].partition_point(|&ramp_nv| ramp_nv <= level_nv)),
        }
    }

    /// The least and the greatest step between neighbouring levels, in nV.
    pub fn steps_nv(&self) -> (i64, i64) {
        let last = (1_u32 << self.bits) - 1;
        let steps = (0..last).map(|k| self.ramp_level_nv(k + 1) - self.ramp_level_nv(k));
        steps.fold((i64::MAX, 0), |(least, most), step| (least.min(step), most.max(step)))
    }

    /// No signal must give the black level: the ramp level above the pedestal lies above it.
    fn check_pedestal(&self, params: &AdcParams) -> Result<(), Error> {
        let pedestal = params.pedestal_lsb();
        if self.has_equal_steps()
            || pedestal == params.code_max()
            || self.ramp_level_nv(pedestal + 1) > self.ramp_level_nv(pedestal)
        {
            return Ok(());
        }
        let reason = format!(
            "the ramp is flat after level {pedestal}, that of a column without signal; use a black level on a rising part"
        );
        Err(Error::key("sensor.adc.black_level_dn", params.black_level_dn, reason))
    }
}

/// Ramp level k of equal steps, halves up.
pub(super) fn linear_level_nv(bits: u32, span_nv: i64, k: u32) -> i64 {
    (i64::from(k) * span_nv + (1 << (bits - 1))) >> bits
}

/// Keys of one shape have no meaning under another.
fn check_keys(params: &AdcParams) -> Result<(), Error> {
    let shape = params.ramp;
    if shape != Ramp::Piecewise && !params.ramp_points.is_empty() {
        let reason = format!("a {} ramp has no points; use [] or ramp = \"piecewise\"", shape.name());
        return Err(Error::key("sensor.adc.ramp_points", format!("{:?}", params.ramp_points), reason));
    }
    if shape != Ramp::Table && !params.ramp_table_uv.is_empty() {
        let reason = format!("a {} ramp has no table; use [] or ramp = \"table\"", shape.name());
        let value = format!("{} levels", params.ramp_table_uv.len());
        return Err(Error::key("sensor.adc.ramp_table_uv", value, reason));
    }
    if !params.has_equal_steps() && params.reset_counts_used() > params.code_max() {
        let most = params.code_max();
        let reason = format!("only a plain linear ramp goes on beyond its last level; use at most {most}");
        return Err(Error::key("sensor.adc.reset_counts", params.reset_counts, reason));
    }
    Ok(())
}

fn table_nv(params: &AdcParams) -> Result<Vec<i64>, Error> {
    let mut levels_nv = match params.ramp {
        Ramp::Linear => linear_nv(params),
        Ramp::Piecewise => piecewise_nv(params)?,
        Ramp::Table => given_nv(params)?,
    };
    bow(params, &mut levels_nv);
    if let Some(k) = levels_nv.windows(2).position(|pair| pair[1] < pair[0]) {
        // The shapes themselves rise, so only the bow can turn them.
        let reason = format!("the ramp falls after level {k}; use a value nearer to 0");
        return Err(Error::key("sensor.adc.ramp_inl_lsb", params.ramp_inl_lsb, reason));
    }
    settle(params.ramp_settling_clk, &mut levels_nv);
    Ok(levels_nv.into_iter().map(i64_half_even).collect())
}

/// Share of the counts at ramp level k.
fn share(bits: u32, k: usize) -> f64 {
    f64_from_usize(k) / f64_from_u64(1 << bits)
}

fn linear_nv(params: &AdcParams) -> Vec<f64> {
    let span_nv = f64_from_i64(params.span_nv());
    (0..=index(params.code_max())).map(|k| share(params.bits, k) * span_nv).collect()
}

fn piecewise_nv(params: &AdcParams) -> Result<Vec<f64>, Error> {
    let refuse = |reason: &str| Error::key("sensor.adc.ramp_points", format!("{:?}", params.ramp_points), reason);
    let points = &params.ramp_points;
    if points.is_empty() || points.len() > 64 {
        return Err(refuse("a piecewise ramp has 1 to 64 points; use [[0.5, 0.25]]"));
    }
    let mut knots = vec![[0.0, 0.0]];
    knots.extend(points.iter().copied());
    knots.push([1.0, 1.0]);
    if !knots.windows(2).all(|pair| pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1]) {
        return Err(refuse("shares of counts and of span must rise from above 0 to below 1; use [[0.5, 0.25]]"));
    }
    let span_nv = f64_from_i64(params.span_nv());
    let mut piece = 0;
    let levels = (0..=index(params.code_max())).map(|k| {
        let x = share(params.bits, k);
        while x > knots[piece + 1][0] {
            piece += 1;
        }
        let ([x0, y0], [x1, y1]) = (knots[piece], knots[piece + 1]);
        span_nv * (y0 + (y1 - y0) * ((x - x0) / (x1 - x0)))
    });
    Ok(levels.collect())
}

fn given_nv(params: &AdcParams) -> Result<Vec<f64>, Error> {
    let table_uv = &params.ramp_table_uv;
    let refuse = |value: String, reason: String| Error::key("sensor.adc.ramp_table_uv", value, reason);
    let edges = index(params.code_max());
    if table_uv.len() != edges {
        let reason = format!("a ramp of {} bits has {edges} levels; use as many", params.bits);
        return Err(refuse(format!("{} levels", table_uv.len()), reason));
    }
    let mut before_uv = 0.0;
    for (number, &level_uv) in table_uv.iter().enumerate() {
        if !(level_uv >= before_uv && level_uv <= params.full_scale_uv) {
            let reason = format!(
                "level {} must lie between the one before it, {before_uv}, and full_scale_uv, {}",
                number + 1,
                params.full_scale_uv
            );
            return Err(refuse(level_uv.to_string(), reason));
        }
        before_uv = level_uv;
    }
    let levels_nv = table_uv.iter().map(|&level_uv| 1000.0 * level_uv / params.gain);
    Ok(std::iter::once(0.0).chain(levels_nv).collect())
}

/// The generator's current falls as its output rises: a parabola over the span (finite output resistance, to first order).
fn bow(params: &AdcParams, levels_nv: &mut [f64]) {
    let height_nv = 1000.0 * params.ramp_inl_lsb * params.lsb_uv();
    for (k, level_nv) in levels_nv.iter_mut().enumerate() {
        let x = share(params.bits, k);
        *level_nv += height_nv * (4.0 * x * (1.0 - x));
    }
}

fn settle(tau_clk: f64, levels_nv: &mut [f64]) {
    if tau_clk == 0.0 {
        return;
    }
    let stays = libm::exp(-1.0 / tau_clk);
    let mut lagged_nv = levels_nv[0];
    let mut before_nv = levels_nv[0];
    for level_nv in levels_nv {
        let drag_nv = (*level_nv - before_nv) * tau_clk;
        let next_nv = *level_nv - drag_nv + (lagged_nv - before_nv + drag_nv) * stays;
        before_nv = *level_nv;
        // The lag of a ramp that never falls never falls; rounding must not make it.
        lagged_nv = greater(lagged_nv, next_nv);
        *level_nv = lagged_nv;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Cds;
    use crate::adc::params::tests::paper_adc;

    fn refused(params: &AdcParams) -> String {
        RampLevels::new(params).unwrap_err().to_string()
    }

    #[test]
    fn a_table_of_the_linear_levels_gives_the_linear_ramp() {
        let linear = RampLevels::new(&paper_adc()).unwrap();
        let levels_uv = (1..1024).map(|k| f64_from_i64(linear.ramp_level_nv(k)) / 1000.0).collect();
        let table = AdcParams { ramp: Ramp::Table, ramp_table_uv: levels_uv, ..paper_adc() };
        let table = RampLevels::new(&table).unwrap();
        assert!(linear.has_equal_steps() && !table.has_equal_steps());
        for k in 0..1024 {
            assert_eq!(linear.ramp_level_nv(k), table.ramp_level_nv(k), "level {k}");
        }
        for level_nv in (-300_000..110_300_000).step_by(1_117) {
            assert_eq!(linear.count(level_nv, 1023), table.count(level_nv, 1023), "{level_nv} nV");
            assert_eq!(linear.count(level_nv, 128), table.count(level_nv, 128), "{level_nv} nV");
        }
    }

    #[test]
    fn the_lag_of_equal_steps_is_the_closed_form() {
        for tau_clk in [0.05, 1.0, 7.5, 300.0, 1e4] {
            let params = AdcParams { ramp_settling_clk: tau_clk, ..paper_adc() };
            let ramp_levels = RampLevels::new(&params).unwrap();
            let step_nv = 1000.0 * params.lsb_uv();
            for k in 0..1024_u32 {
                let clocks = f64::from(k);
                let exact_nv = step_nv * (clocks - tau_clk * (1.0 - libm::exp(-clocks / tau_clk)));
                // Half a nanovolt of rounding; the recursion's and the closed form's own rounding stay below 1e-4 nV:
                // 1024 steps of 2^-53 of at most tau steps (1e9 nV).
                let error_nv = (f64_from_i64(ramp_levels.ramp_level_nv(k)) - exact_nv).abs();
                assert!(error_nv <= 0.5 + 1e-3, "tau {tau_clk}, level {k}: {error_nv} nV");
            }
        }
    }

    #[test]
    fn pieces_meet_at_their_points_and_the_gain_divides_every_shape() {
        let points = vec![[0.25, 0.125], [0.5, 0.25]];
        let params = AdcParams { ramp: Ramp::Piecewise, ramp_points: points, ..paper_adc() };
        let doubled = AdcParams { gain: 2.0, ..params.clone() };
        let (whole, halved) = (RampLevels::new(&params).unwrap(), RampLevels::new(&doubled).unwrap());
        for (k, share) in [(0, 0.0), (256, 0.125), (512, 0.25), (768, 0.625)] {
            assert_eq!(whole.ramp_level_nv(k), i64_half_even(110e6 * share));
            assert_eq!(halved.ramp_level_nv(k), i64_half_even(55e6 * share));
        }
        assert_eq!(whole.steps_nv(), (53_710, 161_133));
    }

    #[test]
    fn the_bow_is_as_high_as_it_says_in_the_middle_and_zero_at_the_ends() {
        for inl_lsb in [-12.5, 3.0] {
            let params = AdcParams { ramp_inl_lsb: inl_lsb, ..paper_adc() };
            let (bowed, plain) = (RampLevels::new(&params).unwrap(), RampLevels::new(&paper_adc()).unwrap());
            let middle_nv = f64_from_i64(bowed.ramp_level_nv(512) - plain.ramp_level_nv(512));
            // Both levels are rounded to whole nanovolts.
            assert!((middle_nv - 1000.0 * inl_lsb * params.lsb_uv()).abs() <= 1.0, "{middle_nv} nV");
            assert_eq!(bowed.ramp_level_nv(0), 0);
        }
    }

    #[test]
    fn keys_that_do_not_go_with_the_shape_and_ramps_that_fall_are_refused_by_name() {
        let bad = [
            (AdcParams { ramp_points: vec![[0.5, 0.2]], ..paper_adc() }, "ramp_points", "piecewise"),
            (AdcParams { ramp_table_uv: vec![1.0], ..paper_adc() }, "ramp_table_uv", "table"),
            (AdcParams { ramp: Ramp::Piecewise, ..paper_adc() }, "ramp_points", "1 to 64 points"),
            (
                AdcParams { ramp: Ramp::Piecewise, ramp_points: vec![[0.5, 0.2], [0.4, 0.3]], ..paper_adc() },
                "ramp_points",
                "must rise",
            ),
            (
                AdcParams { ramp: Ramp::Piecewise, ramp_points: vec![[0.5, f64::NAN]], ..paper_adc() },
                "ramp_points",
                "must rise",
            ),
            (AdcParams { ramp: Ramp::Table, ramp_table_uv: vec![1.0; 7], ..paper_adc() }, "7 levels", "1023 levels"),
            (
                AdcParams {
                    bits: 2,
                    black_level_dn: 1,
                    cds: Cds::None,
                    ramp: Ramp::Table,
                    ramp_table_uv: vec![1.0, 3.0, 2.0],
                    ..paper_adc()
                },
                "ramp_table_uv = 2",
                "level 3",
            ),
            (
                AdcParams { bits: 4, black_level_dn: 3, cds: Cds::None, ramp_inl_lsb: 5.0, ..paper_adc() },
                "ramp_inl_lsb = 5",
                "falls after level",
            ),
            (AdcParams { reset_counts: 1024, ramp_inl_lsb: 0.5, ..paper_adc() }, "reset_counts = 1024", "1023"),
            (
                AdcParams {
                    bits: 2,
                    black_level_dn: 1,
                    cds: Cds::None,
                    ramp: Ramp::Table,
                    ramp_table_uv: vec![5.0, 5.0, 9.0],
                    ..paper_adc()
                },
                "black_level_dn = 1",
                "rising part",
            ),
        ];
        for (params, key, reason) in bad {
            let message = refused(&params);
            assert!(message.contains(key) && message.contains(reason), "{message}");
        }
    }
}
