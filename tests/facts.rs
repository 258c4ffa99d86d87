//! What is known before a run against what frames show: for every bundled scene the truth lies in each fact's interval.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use glam::DVec2;
use sensel::config::Resolved;
use sensel::draw::{DrawKey, fill_uniforms};
use sensel::error::Error;
use sensel::facts::ScenarioFacts;
use sensel::num::{f64_from_usize, index};
use sensel::optics::truth::{TruthView, surfaces};
use sensel::optics::{Camera, Sampling};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::run::{Assets, NoProgress, Setup};
use sensel::scene::bake::BAKE_VERSION;
use sensel::scene::{Bake, Scene, generated};
use sensel::units::{FrameIndex, RowIndex, Span};

/// Files of a scene's folder, or of those that other scenes borrow from; and the light on as many samples of its surfaces,
/// as if it had been baked: facts are bounds for any light, and real light of the large scenes takes minutes.
struct Folder {
    path: PathBuf,
    samples: usize,
}

impl Assets for Folder {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let borrowed = ["bathroom", "photo_box"].map(|lender| scenes().join(lender).join(name));
        let path = [self.path.join(name)].into_iter().chain(borrowed).find(|path| path.is_file());
        let path = path.unwrap_or_else(|| self.path.join(name));
        std::fs::read(&path).map_err(|source| Error::Io { path: path.display().to_string(), source })
    }

    /// A bake in its stored form: irradiances from a tenth to one that differ from sample to sample, alike in all bands.
    fn load(&self, key: &str) -> Option<Vec<u8>> {
        let mut uniforms = vec![0; 2 * self.samples];
        fill_uniforms(DrawKey::root(1), &mut uniforms);
        let mut bytes = MAGIC.to_vec();
        bytes.extend_from_slice(&BAKE_VERSION.to_le_bytes());
        bytes.extend_from_slice(blake3::Hash::from_hex(key).unwrap().as_bytes());
        // Steady irradiances; none that flicker, and no lists of sources at edges or on normal maps.
        for count in [uniforms.len(), 0, 0, 0, 0, 0] {
            bytes.extend_from_slice(&u64::try_from(count).unwrap().to_le_bytes());
        }
        bytes.push(0);
        for uniform in uniforms {
            let irradiance = sensel::num::f32_nearest(0.1 + 0.9 * f64::from(uniform) / 4_294_967_296.0);
            (0..4).for_each(|_| bytes.extend_from_slice(&irradiance.to_le_bytes()));
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        // A form that is no longer read would be baked anew, for minutes.
        Bake::from_bytes("as if baked", &bytes).unwrap();
        Some(bytes)
    }
}

/// How a stored bake begins.
const MAGIC: &[u8] = b"SENSELBK";

/// Samples of light of a scene's surfaces; targets have none of their own.
fn samples(resolved: &Resolved, folder: &Path) -> usize {
    let files = Folder { path: folder.to_path_buf(), samples: 0 };
    let section = &resolved.scenario.scene;
    let read = |name: &str| files.read(name);
    let scene = match (&section.file, &section.generator) {
        (Some(file), _) => {
            let (bytes, units) = (files.read(file).unwrap(), section.file_units().unwrap());
            Scene::from_gltf_in(file, &bytes, &units, &section.surroundings, &read).unwrap()
        }
        (_, Some(generator)) => generated::scene(generator, &section.surroundings, &read).unwrap(),
        (None, None) => return 0,
    };
    scene.layout.samples.len()
}

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// The scene on a picture of 64 x 48.
fn setup(name: &str, more: &[&str]) -> Setup {
    let folder = scenes().join(name);
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    let mut assignments = vec!["sensor.width=64", "sensor.height=48", "run.frames=12"];
    assignments.extend(more);
    let assignments: Vec<String> = assignments.into_iter().map(str::to_owned).collect();
    let resolved = Resolved::from_layers("scene.toml", &text, &assignments).unwrap();
    let samples = samples(&resolved, &folder);
    Setup::new(resolved, &Folder { path: folder, samples }, &NoProgress).unwrap()
}

/// How often each fact was held against a frame, and how near the truth came to its greatest end.
#[derive(Default)]
struct Held {
    compared: u64,
    nearest: std::collections::BTreeMap<&'static str, f64>,
}

impl Held {
    /// `slack` is the rounding of the truth, as a share of it.
    fn check(&mut self, facts: &ScenarioFacts, name: &'static str, truth: f64, slack: f64, said: &str) {
        let fact = facts.of(name).unwrap();
        let room = slack * truth.abs();
        let inside = truth >= fact.least - room && truth <= fact.greatest + room;
        assert!(inside, "{name} of {said} is {truth}, not in {} to {}: {}", fact.least, fact.greatest, fact.how);
        self.compared += 1;
        if fact.greatest > 0.0 {
            let near = self.nearest.entry(name).or_default();
            *near = near.max(truth / fact.greatest);
        }
    }
}

/// f32 photons are sums of some tens of f32 samples and products: 1e-5 covers 80 roundings of 2^-23.
const PHOTON_SLACK: f64 = 1e-5;

fn row_spans(setup: &Setup, frame: FrameIndex) -> Vec<Span> {
    (0..setup.sensor.size.height_px).map(|row| setup.sensor.schedule.exposure(frame, RowIndex(row))).collect()
}

fn check_frame(setup: &Setup, camera: &Camera, number: usize, frame: FrameIndex, held: &mut Held, said: &str) {
    let facts = &setup.facts;
    let spans = row_spans(setup, frame);
    let pose = |t_s: f64| setup.motion.world_from_body(t_s).unwrap();
    let sampling = Sampling::fixed(4, DrawKey::root(7));
    let seen = setup.world.render((number, camera), &spans, &pose, sampling, None).unwrap().photons;
    let per_photon = setup.sensor.electrons_per_photon();
    let signals: Vec<f64> = seen.values().iter().map(|&photons| f64::from(photons) * per_photon).collect();
    let most = signals.iter().copied().fold(0.0, f64::max);
    let least = signals.iter().copied().fold(f64::INFINITY, f64::min);
    for signal_e in [least, most, signals.iter().sum::<f64>() / f64_from_usize(signals.len())] {
        held.check(facts, "signal_e", signal_e, PHOTON_SLACK, said);
        held.check(facts, "well_filling", signal_e / setup.sensor.parameters.pixel.full_well_e, PHOTON_SLACK, said);
    }
    if most > 0.0 {
        held.check(facts, "contrast", (most - least) / (most + least), PHOTON_SLACK, said);
    }
    check_tiles(facts, &seen, per_photon, held, said);
    // Where the lens is dark nothing is seen.
    let width = seen.width_px();
    let lit = (0..signals.len()).filter(|&at| signals[at] > 0.0);
    let position_px = |at: usize| DVec2::new(f64_from_usize(at % width), f64_from_usize(at / width));
    let bearings = lit.filter_map(|at| camera.lens.unproject(position_px(at)));
    let widest = bearings.map(|bearing| 2.0 * libm::acos(bearing.z).to_degrees()).fold(0.0, f64::max);
    assert!(widest <= facts.of("field_of_view_deg").unwrap().greatest, "{widest} degrees of {said}");
    held.compared += 1;
    if let Some(scene) = setup.world.scene() {
        spans.iter().for_each(|&span| held.check(facts, "lamp_level", f64::from(scene.lamp_level(span)), 1e-6, said));
    }
    check_geometry(setup, camera, &spans, &pose, held, said);
}

fn check_tiles(facts: &ScenarioFacts, seen: &Plane<f32>, per_photon: f64, held: &mut Held, said: &str) {
    assert_eq!(facts.tiles.len(), 9);
    let mut pixels = 0;
    for tile in &facts.tiles {
        let [first, end] = tile.columns.map(index);
        let [top, bottom] = tile.rows.map(index);
        for row in top..bottom {
            for &photons in &seen.row(row)[first..end] {
                let signal_e = f64::from(photons) * per_photon;
                let room_e = PHOTON_SLACK * signal_e;
                let inside = signal_e >= tile.signal_e[0] - room_e && signal_e <= tile.signal_e[1] + room_e;
                assert!(inside, "{signal_e} e- in {tile:?} of {said}");
                pixels += 1;
            }
        }
        held.compared += 1;
    }
    assert_eq!(pixels, seen.values().len(), "tiles cover the picture once");
}

/// Depth, field of view, speeds, and how far pictures of points move.
fn check_geometry(
    setup: &Setup,
    camera: &Camera,
    spans: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    held: &mut Held,
    said: &str,
) {
    let facts = &setup.facts;
    for span in [spans[0], spans[spans.len() - 1]] {
        for t_s in [span.start_s, span.middle_s(), span.end_s] {
            let state = setup.motion.state(t_s).unwrap();
            held.check(facts, "speed_m_per_s", state.velocity_m_per_s.length(), 1e-9, said);
            held.check(facts, "turn_deg_per_s", state.angular_velocity_rad_per_s.length().to_degrees(), 1e-9, said);
        }
    }
    let [width, height] = [camera.size.width_px, camera.size.height_px].map(f64::from);
    let Some(scene) = setup.world.scene() else { return };
    let view = TruthView::new(camera, spans.iter().map(|span| span.middle_s()).collect(), world_from_body);
    let found = surfaces(scene.scene(), &view);
    let at = |t_s: f64| world_from_body(t_s).then(&camera.body_from_camera);
    let readout = [spans[0].middle_s(), spans[spans.len() - 1].middle_s()];
    for (row, span) in spans.iter().enumerate() {
        for column in 0..index(camera.size.width_px) {
            let range_m = found.range_m.at(column, row);
            if !range_m.is_finite() {
                continue;
            }
            held.check(facts, "depth_m", range_m, 1e-6, said);
            let position_px = DVec2::new(f64_from_usize(column), f64_from_usize(row));
            let Some(bearing) = camera.lens.unproject(position_px) else { continue };
            let point_m = at(span.middle_s()).point(bearing * range_m);
            for (name, ends_s) in
                [("motion_over_exposure_px", [span.start_s, span.end_s]), ("motion_over_readout_px", readout)]
            {
                let positions = ends_s.map(|t_s| camera.lens.project(at(t_s).inverse().point(point_m)));
                let in_view = |position: &DVec2| {
                    position.x >= -0.5 && position.y >= -0.5 && position.x <= width - 0.5 && position.y <= height - 0.5
                };
                if let [Some(from), Some(to)] = positions.map(|position| position.filter(in_view)) {
                    held.check(facts, name, (to - from).length(), 1e-9, said);
                }
            }
        }
    }
}

fn held_against(setup: &Setup, held: &mut Held, said: &str) {
    for frame in [0, 5, 11].map(FrameIndex) {
        for (number, camera) in setup.windows.iter().enumerate().take(2) {
            check_frame(setup, camera, number, frame, held, &format!("{said}, camera {number}, frame {}", frame.0));
        }
    }
}

#[test]
fn the_truth_of_every_bundled_scene_lies_within_each_fact() {
    let mut held = Held::default();
    let mut names: Vec<String> = std::fs::read_dir(scenes())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("scene.toml").is_file())
        .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    for name in &names {
        let setup = setup(name, &[]);
        assert!(setup.facts.facts.iter().all(|fact| fact.least <= fact.greatest && !fact.how.is_empty()), "{name}");
        held_against(&setup, &mut held, name);
    }
    // The bundled scenes have steady light and global shutters of wide lenses: what they lack.
    let others: [(&str, &[&str]); 3] = [
        (
            "box",
            &[
                "sensor.readout.shutter=rolling",
                "motion.kind=spin",
                "motion.rate_deg_per_s=200.0",
                "sensor.preset=rggb_rolling",
            ],
        ),
        (
            "flat",
            &["scene.flicker.waveform=pwm", "scene.flicker.frequency_hz=120.0", "sensor.readout.exposure_us=3000.0"],
        ),
        ("box", &["optics.preset=kb4_190", "motion.kind=run"]),
    ];
    for (name, more) in others {
        let setup = setup(name, more);
        held_against(&setup, &mut held, &format!("{name} with {more:?}"));
    }
    println!(
        "{} scenes, {} comparisons; nearest to the greatest end: {:.3?}",
        names.len(),
        held.compared,
        held.nearest
    );
    assert!(names.len() >= 12 && held.compared > 100_000, "{} scenes, {}", names.len(), held.compared);
    // The bounds are not idle: of the light at least half is reached somewhere, of the motion a tenth.
    assert!(held.nearest["signal_e"] > 0.5, "{:?}", held.nearest);
    assert!(
        held.nearest["motion_over_exposure_px"] > 0.1 && held.nearest["motion_over_readout_px"] > 0.1,
        "{:?}",
        held.nearest
    );
}

#[test]
fn a_still_scene_has_no_motion_and_a_known_distance() {
    let setup = setup("flat", &[]);
    for name in ["motion_over_exposure_px", "motion_over_readout_px", "speed_m_per_s", "turn_deg_per_s"] {
        let fact = setup.facts.of(name).unwrap();
        assert_eq!((fact.least, fact.greatest), (0.0, 0.0), "{name}: {}", fact.how);
    }
    assert!(setup.is_still());
}
