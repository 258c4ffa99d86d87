//! Inside a frame: what cannot show is not drawn, what does not differ is not done twice, and no bit changes.

use crate::common::assets::KeptBakes;
use sensel::config::Resolved;
use sensel::draw::{DrawKey, fill_uniforms};
use sensel::effects::chain::{BlackRows, Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::num::{f32_nearest, f64_from_usize};
use sensel::optics::{Camera, Exposure, ImagePath, Mosaic, Psf, Sampling, expose_by, render};
use sensel::pixel::DefectKind;
use sensel::plane::Plane;
use sensel::run::{NoClock, NoProgress, SensorSetup, Session, Setup};
use sensel::scene::Illuminant;
use sensel::units::{CameraIndex, FrameIndex, RowIndex, Size, Span};

use super::{TIMES, cases, parameters};

const WIDE: Size = Size { width_px: 333, height_px: 24 };

/// Rows of black, of light far beyond the well, of what is between, and of means on both sides of where draws stop.
fn patchwork(parameters: &Parameters, case: u64) -> Plane<f32> {
    let efficiency = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    let full_e = f64::from(sensel::pixel::saturated_from_e(&parameters.pixel));
    let mut uniforms = vec![0; WIDE.pixel_count()];
    fill_uniforms(DrawKey::root(case), &mut uniforms);
    let row_kinds = uniforms.clone();
    let value = |at: usize| {
        let (row, column) = (at / 333, at % 333);
        let share = f64::from(uniforms[at]) / 4_294_967_296.0;
        // A kind for each 64 columns, but in every third row one for all.
        let kind = row_kinds[row * 333 + if row % 3 == 0 { 0 } else { column / 64 }] % 5;
        let mean_e = match kind {
            0 => 0.0,
            1 => full_e * (1.0 + 20.0 * share),
            2 => full_e * (0.999 + 0.002 * share),
            3 => full_e * share,
            _ => 20.0 * share,
        };
        f32_nearest(mean_e / efficiency)
    };
    Plane::from_values(WIDE, (0..WIDE.pixel_count()).map(value).collect())
}

fn hits(of: &[(&'static str, u64)], name: &str) -> u64 {
    of.iter().find(|(found, _)| *found == name).map_or(0, |(_, hits)| *hits)
}

#[test]
fn draws_that_cannot_show_in_black_and_saturated_pixels_change_no_bit() {
    let quiet: &[&str] =
        &["sensor.pixel.dsnu_e=2.0", "sensor.pixel.prnu=0.02", "sensor.pixel.dark_current_e_per_s=900.0"];
    let lagging =
        [quiet, &["sensor.pixel.image_lag=0.02", "sensor.pixel.dcnu=0.5", "sensor.pixel.hot_ppm=9000.0"]].concat();
    let stored = [
        quiet,
        &["sensor.pixel.type=6T", "sensor.pixel.storage_leakage_per_s=5.0", "sensor.pixel.parasitic_light=0.001"],
    ];
    let small = [quiet, &["sensor.pixel.full_well_e=40.0"]].concat();
    let huge = [quiet, &["sensor.pixel.full_well_e=3e7"]].concat();
    let blooming = [quiet, &["sensor.pixel.blooming=0.5"]].concat();
    let (mut saved, mut compared) = (0, 0);
    for set in [quiet.to_vec(), lagging, stored.concat(), small, huge, blooming] {
        let parameters = parameters(&set);
        let chain = || Chain::new(parameters.clone(), effects::build_all(&parameters), 3, 4);
        for case in 0..4 {
            let photons = patchwork(&parameters, case);
            let times = vec![TIMES; photons.height_px()];
            let before_e = Plane::filled(WIDE, 300.0_f32);
            let capture = Capture { before_e: Some(&before_e), ..Capture::single(CameraIndex(1), FrameIndex(2)) };
            let quick = chain().capture(&photons, capture, &times);
            let slow = chain().drawing_for_all().capture(&photons, capture, &times);
            assert_eq!(quick.codes, slow.codes, "{set:?}, case {case}");
            assert_eq!(quick.charge_e, slow.charge_e, "{set:?}, case {case}");
            let electrons = |chain: Chain| chain.electrons(&photons, capture, &times);
            assert_eq!(electrons(chain()), electrons(chain().drawing_for_all()), "{set:?}, case {case}");
            saved += hits(&slow.hits, "shot_noise") - hits(&quick.hits, "shot_noise");
            if set.contains(&"sensor.pixel.blooming=0.5") {
                assert_eq!(quick.hits, slow.hits, "what is beyond the well spills, so every draw counts");
            }
            compared += 1;
        }
    }
    println!("{saved} draws saved in {compared} frames of {}", WIDE.pixel_count());
    assert!(saved > 10_000 && compared == 24, "{saved} draws saved in {compared} frames");
}

/// The second reading of a dual-gain pixel has the greater well: what is full for the first alone is drawn.
#[test]
fn a_pixel_with_two_wells_is_full_when_the_greater_one_is() {
    let assignments: Vec<String> = ["scene.generator=box", "sensor.preset=hdr_dual_gain"].map(str::to_owned).to_vec();
    let setup = SensorSetup::new(&Resolved::from_layers("test", "", &assignments).unwrap()).unwrap();
    let names = effects::names();
    let chain = || setup.chain(setup.parameters.adc.gain, [&names, &names], 1, 2);
    let window = setup.schedule.geometry().window();
    let size = Size { width_px: window.width_px, height_px: window.height_px };
    let second = setup.second.as_ref().unwrap();
    let efficiency = setup.electrons_per_photon();
    // From dark to twice the greater well, through both.
    let most = 2.0 * second.pixel.full_well_e / efficiency;
    let last = f64_from_usize(size.pixel_count());
    let plane = Plane::from_values(
        size,
        (0..size.pixel_count()).map(|at| f32_nearest(most * f64_from_usize(at) / last)).collect(),
    );
    let times = vec![RowTimes { exposure_s: 0.01, storage_s: 0.0, readout_s: 0.0 }; plane.height_px()];
    let capture = Capture::single(CameraIndex(0), FrameIndex(0));
    let (quick, slow) =
        (chain().capture(&plane, capture, &times), chain().drawing_for_all().capture(&plane, capture, &times));
    assert_eq!(quick.codes, slow.codes);
    let saved = hits(&slow.hits, "shot_noise") - hits(&quick.hits, "shot_noise");
    let pixels = slow.codes.values().len();
    println!("{saved} draws saved of {} in both readings of {pixels} pixels", hits(&slow.hits, "shot_noise"));
    // Nearly half of the wedge is beyond the greater well, in both readings.
    let share = f64_from_usize(usize::try_from(saved).unwrap()) / f64_from_usize(2 * pixels);
    assert!((0.4..0.5).contains(&share), "{share}");
}

#[test]
fn optical_black_rows_draw_no_light() {
    let parameters = parameters(&["sensor.pixel.dark_current_e_per_s=100.0"]);
    let black = BlackRows { rows: 8, first_row: 24, clamp: true };
    let chain = Chain::new(parameters.clone(), effects::build_all(&parameters), 3, 4).with_black_rows(black);
    let photons = Plane::filled(WIDE, 500.0_f32);
    let times = vec![TIMES; photons.height_px()];
    let captured = chain.capture(&photons, Capture::single(CameraIndex(0), FrameIndex(0)), &times);
    assert_eq!(hits(&captured.hits, "shot_noise"), 333 * 24, "the lit rows alone");
    assert_eq!(hits(&captured.hits, "dark_current"), 333 * 32, "black rows have dark current");
    let all = chain.drawing_for_all().capture(&photons, Capture::single(CameraIndex(0), FrameIndex(0)), &times);
    assert_eq!(captured.codes, all.codes);
}

#[test]
fn columns_and_pixels_without_a_flaw_are_not_touched_for_it() {
    let set: Vec<&str> = cases::ALL_PRESENT.to_vec();
    let parameters = parameters(&set);
    let (camera, die) = (CameraIndex(0), 6);
    let chain = Chain::new(parameters.clone(), effects::build_all(&parameters), 5, die);
    let photons = Plane::filled(WIDE, 500.0_f32);
    let captured = chain.capture(&photons, Capture::single(camera, FrameIndex(0)), &vec![TIMES; 24]);
    let found = sensel::pixel::defects(&parameters.pixel, die, camera, WIDE);
    let of = |is: fn(&DefectKind) -> bool| found.iter().filter(|defect| is(&defect.kind)).count();
    let kinds: [(&str, fn(&DefectKind) -> bool); 2] = [
        ("hot_pixels", |kind| matches!(kind, DefectKind::Hot { .. })),
        ("dead_pixels", |kind| matches!(kind, DefectKind::Dead)),
    ];
    for (name, is) in kinds {
        assert_eq!(hits(&captured.hits, name), u64::try_from(of(is)).unwrap(), "{name}");
    }
    // A pattern that all columns lack is no pass at all.
    let plain = super::parameters(&[]);
    assert!(effects::build_all(&plain).iter().all(|effect| !effect.name().starts_with("column")));
}

fn camera(set: &[&str]) -> (Setup, Camera) {
    let mut assignments = vec![
        "scene.generator=box",
        "scene.bake=direct",
        "motion.kind=still",
        "motion.offset_m=[0.0, 1.5, 0.3]",
        "sensor.width=64",
        "sensor.height=48",
        "rig.baseline_mm=0.0",
        "run.frames=3",
        "run.samples_per_pixel=2",
    ];
    assignments.extend(set);
    let assignments: Vec<String> = assignments.into_iter().map(str::to_owned).collect();
    let resolved = Resolved::from_layers("test", "", &assignments).unwrap();
    let setup = Setup::new(resolved, &KeptBakes, &NoProgress).unwrap();
    let camera = setup.windows[0].clone();
    (setup, camera)
}

/// Counts what a camera asks the renderer for.
fn renders_of(camera: &Camera) -> u32 {
    let count = std::cell::Cell::new(0);
    let ideal = |camera: &Camera| {
        count.set(count.get() + 1);
        Ok(Exposure { photons: Plane::filled(camera.size, 1.0), render_variance_ratio: 0.0, rays: 0 })
    };
    expose_by(Illuminant::D65, camera, &ideal).unwrap();
    count.get()
}

#[test]
fn a_monochrome_picture_is_rendered_once_for_all_bands() {
    let (_, plain) = camera(&[]);
    assert_eq!(renders_of(&plain), 1);
    let path = ImagePath {
        magnification: [1.0; 4],
        psf: Psf { defocus_um: 5.0, ..plain_psf() },
        optical_crosstalk: 0.0,
        electrical_crosstalk: [0.0; 4],
    };
    let blurred = plain.clone().with_image_path(&path).unwrap();
    assert_eq!(renders_of(&blurred), 1, "bands that share a mapping share a render, blurred or not");
    let apart = ImagePath { magnification: [1.0, 1.001, 1.002, 1.0], ..path };
    assert_eq!(renders_of(&plain.clone().with_image_path(&apart).unwrap()), 3, "bands with mappings of their own");
    let (colour, _) =
        Mosaic::parse("RGGB", &[('R', [0.6, 0.0, 0.0, 0.0]), ('G', [0.0, 0.6, 0.0, 0.0]), ('B', [0.0, 0.0, 0.6, 0.0])])
            .unwrap();
    let colour = plain.with_mosaic(colour).with_image_path(&path).unwrap();
    assert_eq!(renders_of(&colour), 3, "behind filters each band is blurred on its own");
}

fn plain_psf() -> Psf {
    Psf { f_number: 2.0, diffraction: false, defocus_um: 0.0, aberration_um: 0.0 }
}

#[test]
fn a_rolling_shutter_costs_a_still_scene_nothing() {
    let (setup, camera) = camera(&[]);
    let scene = setup.world.scene().unwrap();
    let pose = |_: f64| setup.motion.world_from_body(0.0).unwrap();
    let at = |row_s: f64| -> Vec<Span> {
        (0..48).map(|row| f64::from(row) * row_s).map(|start_s| Span { start_s, end_s: start_s + 0.002 }).collect()
    };
    for sampling in [
        Sampling::fixed(4, DrawKey::root(1)),
        Sampling { tolerance: 0.5, samples_max: 64, ..Sampling::fixed(4, DrawKey::root(1)) },
    ] {
        let global = render(scene, &camera, &at(0.0), &pose, sampling);
        let rolling = render(scene, &camera, &at(1e-4), &pose, sampling);
        assert_eq!(global.photons, rolling.photons, "the same picture to the last bit");
        assert_eq!(global.rays, rolling.rays, "by as many rays");
        assert!(global.rays > 48 * 64);
    }
}

#[test]
fn frames_of_a_still_scene_after_the_first_send_no_ray_and_are_what_they_would_be() {
    let run = |frames: u32| {
        let (setup, _) = camera(&[]);
        assert!(setup.is_still());
        let mut session = Session::new(setup).unwrap();
        let seen: Vec<Plane<f32>> = (0..frames)
            .map(|_| session.step(&NoClock).unwrap().cameras.swap_remove(0).photons.as_ref().clone())
            .collect();
        let samples = session.report("still").unwrap().scenario.samples_per_pixel;
        (seen, samples * f64::from(frames))
    };
    let ((one, first), (all, sum)) = (run(1), run(3));
    assert!(
        (first - sum).abs() < 1e-9 && first >= 2.0,
        "{first} rays per pixel in the first frame, {sum} in all three"
    );
    assert!(all.iter().all(|photons| *photons == one[0]));
    // The slow twin: the frame rendered anew, by the same samples.
    let (setup, camera) = camera(&[]);
    let key = DrawKey::root(setup.fidelity.render.seed).with(1).with(0).with(0);
    let spans: Vec<Span> = (0..48).map(|row| setup.sensor.schedule.exposure(FrameIndex(2), RowIndex(row))).collect();
    let pose = |t_s: f64| setup.motion.world_from_body(t_s).unwrap();
    let sampling = Sampling {
        samples_per_pixel: 2,
        samples_max: setup.fidelity.render.samples_max,
        reflections: setup.fidelity.render.reflections,
        follows_gloss: setup.fidelity.render.follows_gloss,
        electrons_per_photon: setup.fidelity.render.quantum_efficiency,
        saturation_photons: f32_nearest(setup.fidelity.render.saturation_photons()),
        ..Sampling::fixed(2, key)
    };
    let anew = setup.world.render((0, &camera), &spans, &pose, sampling, None).unwrap();
    assert_eq!(anew.photons, one[0]);
    // What moves is rendered in every frame.
    let (moving, _) = self::camera(&["motion.kind=sway"]);
    assert!(!moving.is_still());
}
