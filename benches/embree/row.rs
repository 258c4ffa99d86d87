//! Compares our packets of rays with Embree's packets of eight in the furnished room. Prints one JSON row a level: millions of rays a
//! second of both, their ratio, and whether they hit the same.

use std::path::Path;
use std::time::Instant;

use sensel::scene::lanes::{Floats, LANES};
use sensel::scene::tracer::{Hits, MISS, Packet, Stack, closest};
use sensel::scene::{Scene, bvh::Bvh};
use sensel::simd;

use super::compare::compare;
use super::rays::{Peer, bathroom, primary_rays, triangles_m};
use super::{LEVELS, keep_to, ourselves, run};

/// What the parent calls its child's work, and the peer's name.
pub const WORK: &str = "rays";
pub const PEER: &str = "embree";
/// Passes over all rays that each process times, after one that it does not.
const PASSES: u32 = 15;

/// Prints the rows; gives back whether all ran, and whether what both saw was the same.
pub fn rows() -> bool {
    let scene = bathroom();
    let (triangles, packets) = (triangles_m(&scene), primary_rays());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("embree");
    let peer = Peer::new(&folder, &triangles, &packets);
    let mut fine = true;
    for level in LEVELS.into_iter().filter(|&level| level <= simd::level()) {
        let row = peer.as_ref().map_err(Clone::clone).and_then(|peer| {
            let ours = || ourselves(WORK, level);
            let theirs = || embree_s(peer, PASSES);
            let (first, second, third, fourth) = (ours()?, theirs()?, theirs()?, ours()?);
            Ok((first.min(fourth), second.min(third)))
        });
        let work = format!("primary rays of {} triangles, 6 views of 640x480", triangles.len());
        match row {
            Ok((ours_s, peer_s)) => {
                let rays = f64::from(u32::try_from(packets.len() * LANES).expect("some millions of rays"));
                let speeds = [rays / ours_s / 1e6, rays / peer_s / 1e6];
                let speeds = format!(r#""ours_mray_per_s":{:.2},"peer_mray_per_s":{:.2}"#, speeds[0], speeds[1]);
                let ratio = peer_s / ours_s;
                println!(r#"{{"work":"{work}","peer":"{PEER}",{speeds},"ratio":{ratio:.2},"level":"{level:?}"}}"#);
            }
            Err(reason) => {
                let reason = reason.replace(['\\', '"', '\n'], " ");
                println!(r#"{{"work":"{work}","peer":"{PEER}","level":"{level:?}","failed":"{reason}"}}"#);
                fine = false;
            }
        }
    }
    fine && peer.is_ok_and(|peer| agrees(&peer, &scene, &triangles, &packets))
}

/// Seconds of Embree's best of some passes.
pub fn embree_s(peer: &Peer, passes: u32) -> Result<f64, String> {
    let words = peer.command(passes, &[]);
    let arguments: Vec<&str> = words[1..].iter().map(String::as_str).collect();
    let output = run(&words[0], &arguments)?;
    let row: serde_json::Value = serde_json::from_str(&output).map_err(|error| format!("{output:?}: {error}"))?;
    row["seconds"].as_f64().ok_or_else(|| format!("{output:?} names no seconds"))
}

/// Prints how many hits are equal to those of the run that was timed last.
fn agrees(peer: &Peer, scene: &Scene, triangles: &[[[f32; 3]; 3]], packets: &[Packet]) -> bool {
    match peer.answers() {
        Ok(theirs) => {
            let mut hits = unmet(packets.len());
            trace(&scene.bvh, packets, &mut hits);
            let found = compare(triangles, packets, &hits, &theirs);
            println!(r#"{{"work":"hits against {PEER}'s, equal to 1e-5","counts":"{found:?}"}}"#);
            found.wrong == 0
        }
        Err(reason) => {
            eprintln!("{reason}");
            false
        }
    }
}

fn unmet(packets: usize) -> Vec<Hits> {
    let zero = Floats::splat(0.0);
    vec![Hits { t: zero, triangle: [MISS; LANES], u: zero, v: zero }; packets]
}

fn trace(bvh: &Bvh, packets: &[Packet], hits: &mut [Hits]) {
    let mut stack = Stack::new();
    for (packet, hits) in packets.iter().zip(hits) {
        *hits = closest(bvh, packet, &mut stack);
    }
}

/// Seconds of our best pass at a level.
pub fn ours_s(level: &str) -> f64 {
    keep_to(level);
    let bvh = Bvh::build(&triangles_m(&bathroom()));
    let packets = primary_rays();
    let mut hits = unmet(packets.len());
    let mut best_s = f64::INFINITY;
    for _ in 0..PASSES {
        let begin = Instant::now();
        trace(&bvh, &packets, &mut hits);
        best_s = best_s.min(begin.elapsed().as_secs_f64());
        std::hint::black_box(&hits);
    }
    best_s
}
