//! Running check: converts every Nth row again on the next rung, clock by clock or in Verilog, and reports the first difference. Draws
//! are keyed by name, so both rungs convert the same samples.

use super::assets::Assets;
use super::setup::Setup;
use crate::effects::chain::{Capture, Chain, RowTimes};
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{index, u32_from};
use crate::plane::Plane;
use crate::rtl_simulator::SharedRtlSimulator;
use crate::units::RowIndex;

/// Rows that are converted once more.
pub(super) struct RowCheck {
    every: u32,
    /// The rung of the run, and the one above it.
    rungs: [Rung; 2],
    /// What runs the Verilog, if that is the rung above.
    verilog: Option<SharedRtlSimulator>,
    /// The chain of the rung above, at the gain in effect.
    above: Option<Chain>,
    pub rows: u64,
}

impl RowCheck {
    /// Every `every`-th row of a run on the rung `sampled` or `clocked`. Above `clocked` stands the Verilog, from these assets. Fails on
    /// a run on another rung, 0 rows, no Verilog where it is needed.
    pub fn new(setup: &Setup, every: u32, assets: &dyn Assets) -> Result<Self, Error> {
        if every == 0 {
            return Err(Error::key("--check-every", every, "use 1 (every row) or more"));
        }
        let (above, verilog) = match setup.fidelity.rung {
            Rung::Sampled => (Rung::Clocked, None),
            Rung::Clocked => {
                let simulator = assets.rtl_simulator().map_err(|error| {
                    let reason = format!("the rung above clocked is rtl: {error}; without it, sampled");
                    Error::key("--check-every", every, reason)
                })?;
                (Rung::Rtl, Some(SharedRtlSimulator::new(simulator)))
            }
            Rung::Expected | Rung::Rtl => {
                let reason = "this rung has none above it that a run can hold it to; use sampled or clocked";
                return Err(Error::key("--check-every", setup.fidelity.rung.name(), reason));
            }
        };
        Ok(Self { every, rungs: [setup.fidelity.rung, above], verilog, above: None, rows: 0 })
    }

    /// The rung that rows are held to.
    pub fn rung(&self) -> Rung {
        self.rungs[1]
    }

    /// The gain has changed: the converters are others.
    pub fn forget_chain(&mut self) {
        self.above = None;
    }

    /// Converts rows of one exposure again; `make_chain` makes the run's own chain. Fails on the first code that differs, both ways; a
    /// Verilog that does not answer.
    pub fn check(
        &mut self,
        make_chain: impl FnOnce() -> Chain,
        photons: &Plane<f32>,
        capture: Capture<'_>,
        times: &[RowTimes],
        codes: &Plane<u16>,
    ) -> Result<(), Error> {
        let rows: Vec<RowIndex> = (0..u32_from(codes.height_px())).step_by(index(self.every)).map(RowIndex).collect();
        let above =
            self.above.get_or_insert_with(|| make_chain().on_rung(self.rungs[1]).in_verilog(self.verilog.as_ref()));
        let again = above.codes_of_rows(photons, capture, times, &rows);
        self.verilog.as_ref().map_or(Ok(()), SharedRtlSimulator::check)?;
        self.rows += crate::num::u64_from(rows.len());
        for (row, again) in rows.iter().zip(&again) {
            if let Some(column) = first_difference(codes.row(index(row.0)), again) {
                let (code, right) = (codes.at(column, index(row.0)), again[column]);
                let [rung, above] = self.rungs.map(Rung::name);
                return Err(Error::Run(format!(
                    "camera {}, frame {}, slot {}, row {}, column {column}: {rung} gives code {code}, {above} gives {right}",
                    capture.camera.0, capture.frame.0, capture.slot, row.0
                )));
            }
        }
        Ok(())
    }
}

/// Column of the first code that differs.
fn first_difference(codes: &[u16], again: &[u16]) -> Option<usize> {
    assert!(codes.len() == again.len(), "both rungs read the same columns");
    codes.iter().zip(again).position(|(one, other)| one != other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Resolved;
    use crate::num::u64_from;
    use crate::run::probe::PictureId;
    use crate::run::row_times::row_times;
    use crate::run::{NoClock, NoFiles, NoProgress, Session};
    use crate::units::{CameraIndex, FrameIndex};

    fn setup(more: &[&str]) -> Setup {
        // A target needs no light to be baked.
        let small = "seed = 5\n[scene]\ntarget = \"flat\"\n[run]\nsamples_per_pixel = 1\n[rig]\nbaseline_mm = 0.0\n[sensor]\n\
            width = 64\nheight = 48\n";
        let more: Vec<String> = more.iter().map(|&assignment| assignment.to_owned()).collect();
        let resolved = Resolved::from_layers("test", small, &more).unwrap();
        Setup::new(resolved, &NoFiles, &NoProgress).unwrap()
    }

    /// A code that is put wrong in a row that is looked at is named with both answers; in a row between, it passes.
    #[test]
    fn a_deliberate_fault_is_found_in_every_row_that_is_looked_at_and_in_no_other() {
        let setup = setup(&[]);
        let picture = PictureId { frame: FrameIndex(0), camera: 0 };
        let photons = setup.exposures_at(picture).unwrap().swap_remove(0).photons;
        let schedule = setup.sensor.schedule.for_camera(CameraIndex(0));
        let times = row_times(&schedule, FrameIndex(0), 0, &[]);
        let capture = Capture::single(CameraIndex(0), FrameIndex(0));
        let codes = setup.first_chain().capture(&photons, capture, &times).codes;
        let own = || setup.first_chain();
        let mut check = RowCheck::new(&setup, 5, &NoFiles).unwrap();
        check.check(own, &photons, capture, &times, &codes).unwrap();
        assert_eq!(check.rows, 10);
        let (mut found, mut passed) = (0, 0);
        for row in 0..48 {
            let column = (7 * row) % 64;
            let mut faulty = codes.clone();
            let right = faulty.at(column, row);
            faulty.row_mut(row)[column] = right ^ 1;
            match check.check(own, &photons, capture, &times, &faulty) {
                Err(error) => {
                    let words = error.to_string();
                    let wanted =
                        format!("row {row}, column {column}: sampled gives code {}, clocked gives {right}", right ^ 1);
                    assert!(words.ends_with(&wanted), "{words}");
                    assert_eq!(error.exit_code(), 1);
                    found += 1;
                }
                Ok(()) => passed += 1,
            }
        }
        assert_eq!((found, passed), (10, 38));
    }

    /// Converters with every kind of disturbance: where rungs could differ at all.
    #[test]
    fn a_run_whose_rungs_agree_passes_row_by_row() {
        let disturbed =
            ["sensor.adc.kickback_uv=30.0", "sensor.adc.comparator_delay_sigma_clk=2.0", "sensor.adc.ramp_inl_lsb=1.0"];
        for more in [&[][..], &disturbed[..]] {
            let mut session = Session::new(setup(more)).unwrap();
            session.check_rows(7, &NoFiles).unwrap();
            for _ in 0..3 {
                session.step(&NoClock).unwrap();
            }
            assert_eq!(session.rows_checked(), 3 * u64_from((0..48).step_by(7).count()));
        }
    }

    #[test]
    fn a_rung_without_one_above_it_is_refused() {
        let refused = |more: &[&str], every| RowCheck::new(&setup(more), every, &NoFiles).err().unwrap();
        let clocked = refused(&["run.rung=clocked"], 1);
        assert!(clocked.exit_code() == 2 && clocked.to_string().contains("rtl"), "{clocked}");
        assert_eq!(refused(&["run.rung=expected"], 1).exit_code(), 2);
        assert_eq!(refused(&[], 0).exit_code(), 2);
    }
}
