//! The row of frames: the time of a scenario's first VGA frame as its user renders it, over that of Embree's one ray a pixel from the same
//! position, one thread each.

use std::path::Path;
use std::time::Instant;

use glam::DVec2;
use sensel::num::{f32_nearest, f64_from_usize};
use sensel::run::Setup;
use sensel::scene::lanes::LANES;
use sensel::scene::tracer::Packet;
use sensel::simd;

use super::rays::{Peer, idle, set, triangles_m};
use super::scenario::first_frame;
use super::{LEVELS, keep_to, ourselves};

/// What the parent calls its child's work.
pub const WORK: &str = "frame";
const SCENES: [&str; 3] = ["bathroom", "hall", "street"];
/// Render variance over photon variance that is asked for.
const TOLERANCES: [&str; 3] = ["", "0.4", "0.1"];
/// Frames that each of our processes times, after one that it does not.
const FRAMES: u32 = 5;
const PASSES: u32 = 15;

/// Prints the rows; gives back whether all ran.
pub fn rows() -> bool {
    let mut fine = true;
    for scene in SCENES {
        let session = first_frame(scene, &[]);
        let setup = session.setup();
        let geometry = setup.world.scene().expect("a scene with geometry").scene();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("embree_frame");
        let peer = Peer::new(&folder, &triangles_m(geometry), &centre_rays(setup));
        for tolerance in TOLERANCES {
            for level in LEVELS.into_iter().filter(|&level| level <= simd::level()) {
                let row = peer.as_ref().map_err(Clone::clone).and_then(|peer| {
                    let ours = || ourselves(&format!("{WORK} {scene} {tolerance}"), level);
                    let theirs = || super::embree::embree_s(peer, PASSES);
                    let (first, second, third, fourth) = (ours()?, theirs()?, theirs()?, ours()?);
                    Ok((first.min(fourth), second.min(third)))
                });
                let tolerance = if tolerance.is_empty() { "default" } else { tolerance };
                let named = format!(
                    r#""work":"frame 640x480","scene":"{scene}","tolerance":"{tolerance}","peer":"embree","level":"{level:?}""#
                );
                match row {
                    Ok((ours_s, peer_s)) => println!(
                        r#"{{{named},"ours_ms":{:.1},"peer_ms":{:.2},"time_ratio":{:.1}}}"#,
                        1e3 * ours_s,
                        1e3 * peer_s,
                        ours_s / peer_s
                    ),
                    Err(reason) => {
                        println!(r#"{{{named},"failed":"{}"}}"#, reason.replace(['\\', '"', '\n'], " "));
                        fine = false;
                    }
                }
            }
        }
        for tolerance in TOLERANCES {
            let session = first_frame(scene, &keys(tolerance));
            let seen = &session.next_exposures().expect("a sound scenario")[0][0];
            let rays = f64::from(u32::try_from(seen.rays).expect("a frame")) / 307_200.0;
            let asked = if tolerance.is_empty() { "default" } else { tolerance };
            println!(
                r#"{{"work":"frame 640x480","scene":"{scene}","tolerance":"{asked}","stated":{:.3},"rays_per_pixel":{rays:.2}}}"#,
                seen.render_variance_ratio
            );
        }
    }
    fine
}

fn keys(tolerance: &str) -> Vec<&'static str> {
    match tolerance {
        "0.4" => vec!["run.render_tolerance=0.4"],
        "0.1" => vec!["run.render_tolerance=0.1"],
        _ => Vec::new(),
    }
}

/// Seconds of our best frame at a level, of a scene at a tolerance.
pub fn ours_s(of: &str, level: &str) -> f64 {
    keep_to(level);
    let mut words = of.split(' ');
    let (scene, tolerance) = (words.next().expect("a scene"), words.next().unwrap_or(""));
    let session = first_frame(scene, &keys(tolerance));
    let mut best_s = f64::INFINITY;
    for _ in 0..=FRAMES {
        let begin = Instant::now();
        std::hint::black_box(session.next_exposures().expect("a sound scenario"));
        best_s = best_s.min(begin.elapsed().as_secs_f64());
    }
    best_s
}

/// Rays through the pixels' centres as the run begins, in blocks of four by four pixels.
fn centre_rays(setup: &Setup) -> Vec<Packet> {
    let camera = &setup.windows[0];
    let world_from_body = setup.motion.world_from_body(0.0).expect("a motion has a start");
    let pose = world_from_body.then(&camera.body_from_camera);
    let mut packets = Vec::new();
    for y in (0..480).step_by(4) {
        for x in (0..640).step_by(4) {
            let mut packet = idle();
            for lane in 0..LANES {
                let position_px = DVec2::new(f64_from_usize(x + lane % 4), f64_from_usize(y + lane / 4));
                if let Some(bearing) = camera.lens.unproject(position_px) {
                    let direction = pose.direction(bearing).normalize();
                    set(
                        &mut packet,
                        lane,
                        pose.translation_m.to_array().map(f32_nearest),
                        direction.to_array().map(f32_nearest),
                    );
                }
            }
            packets.push(packet);
        }
    }
    packets
}
