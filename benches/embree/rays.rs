//! Embree as the tracer's peer: makes packets of rays (metres) for both sides, writes the files of Embree's program, builds it and reads
//! its answers.

// The bench and the test each use their part.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::num::{f32_nearest, f64_from_usize, low_u32, u64_from};
use sensel::scene::Scene;
use sensel::scene::lanes::{Floats, LANES};
use sensel::scene::tracer::Packet;

pub const BATHROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bathroom/bathroom.glb");
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/embree/embree.cpp");

/// Columns and rows of a view.
const VIEW_PX: [usize; 2] = [640, 480];
/// Focal length: 90 degrees from left to right.
const FOCAL_PX: f64 = 320.0;

/// Where a view is taken from, its turn about the upright axis and its tilt downwards in degrees, and whether its rays lie off their
/// pixels'
/// centres, each by a draw of its own.
struct View {
    eye_m: [f64; 3],
    turn_deg: f64,
    tilt_deg: f64,
    jittered: bool,
}

/// Views of the furnished room from its free half, where the scenario's rig moves, and from where its author put a camera.
const VIEWS: [View; 6] = [
    View { eye_m: [0.745, 1.262, -0.892], turn_deg: 20.0, tilt_deg: 5.0, jittered: false },
    View { eye_m: [0.745, 1.262, -0.892], turn_deg: 143.0, tilt_deg: 12.0, jittered: true },
    View { eye_m: [0.745, 1.262, -0.892], turn_deg: 260.0, tilt_deg: -8.0, jittered: false },
    View { eye_m: [0.007, 0.912, -0.228], turn_deg: 49.0, tilt_deg: -1.0, jittered: true },
    View { eye_m: [0.007, 0.912, -0.228], turn_deg: 95.0, tilt_deg: 10.0, jittered: false },
    View { eye_m: [0.007, 0.912, -0.228], turn_deg: 5.0, tilt_deg: 30.0, jittered: true },
];

/// The furnished room.
pub fn bathroom() -> Scene {
    let bytes = std::fs::read(BATHROOM).expect("the furnished room lies among the scenes");
    Scene::from_glb("bathroom", &bytes).expect("the furnished room is a scene")
}

/// Corners of all triangles of a scene.
pub fn triangles_m(scene: &Scene) -> Vec<[[f32; 3]; 3]> {
    (0..scene.mesh.triangles.len()).map(|triangle| scene.mesh.corners_m(triangle)).collect()
}

/// Primary rays of all views in blocks of four by four pixels.
pub fn primary_rays() -> Vec<Packet> {
    let mut packets = Vec::new();
    for (number, view) in VIEWS.iter().enumerate() {
        let turned =
            DQuat::from_rotation_y(view.turn_deg.to_radians()) * DQuat::from_rotation_x(view.tilt_deg.to_radians());
        for y in (0..VIEW_PX[1]).step_by(4) {
            for x in (0..VIEW_PX[0]).step_by(4) {
                let mut packet = idle();
                for lane in 0..LANES {
                    let pixel = [x + lane % 4, y + lane / 4];
                    let offset_px = sub_pixel(
                        view.jittered,
                        DrawKey::root(u64_from(number)).with(u64_from(pixel[1] * VIEW_PX[0] + pixel[0])),
                    );
                    let across = [0, 1].map(|axis| {
                        f64_from_usize(pixel[axis]) + offset_px[axis] - 0.5 * f64_from_usize(VIEW_PX[axis])
                    });
                    let direction = turned * DVec3::new(across[0], -across[1], -FOCAL_PX).normalize();
                    set(&mut packet, lane, view.eye_m.map(f32_nearest), direction.to_array().map(f32_nearest));
                }
                packets.push(packet);
            }
        }
    }
    packets
}

/// Where in its pixel a ray lies.
fn sub_pixel(jittered: bool, key: DrawKey) -> [f64; 2] {
    let bits = key.0;
    let share = |word: u64| f64::from(low_u32(word & 0xFFFF)) / 65536.0;
    if jittered { [share(bits), share(bits >> 16)] } else { [0.5; 2] }
}

/// A packet whose lanes wait for their rays.
pub fn idle() -> Packet {
    let zero = Floats::splat(0.0);
    Packet { origin_m: [zero; 3], direction: [Floats::splat(1.0), zero, zero], t_min: zero, t_max: Floats::splat(-1.0) }
}

/// Gives a lane a ray of unlimited length.
pub fn set(packet: &mut Packet, lane: usize, origin_m: [f32; 3], direction: [f32; 3]) {
    for axis in 0..3 {
        packet.origin_m[axis].0[lane] = origin_m[axis];
        packet.direction[axis].0[lane] = direction[axis];
    }
    packet.t_max.0[lane] = f32::MAX;
}

/// Embree's program with the files of one question.
pub struct Peer {
    program: PathBuf,
    folder: PathBuf,
}

/// Distance and triangle of each ray, `f32::MAX` and `MISS` where it met none.
pub struct Answers {
    pub t: Vec<f32>,
    pub triangle: Vec<u32>,
}

impl Peer {
    /// Builds the program and writes the question into a folder.
    ///
    /// # Errors
    /// No compiler, no Embree, no folder to write into.
    pub fn new(folder: &Path, triangles_m: &[[[f32; 3]; 3]], packets: &[Packet]) -> Result<Self, String> {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let program = folder.join("embree");
        let mut compiler = Command::new("g++");
        compiler.args(["-O3", "-march=native", "-o"]).arg(&program).args([SOURCE, "-lembree3"]);
        let output = compiler.output().map_err(|error| format!("g++: {error}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            return Err(format!("g++ with Debian's libembree-dev: {}", said.lines().next().unwrap_or("it failed")));
        }
        let peer = Self { program, folder: folder.to_owned() };
        let triangles = triangles_m.iter().flatten().flatten().flat_map(|value| value.to_le_bytes()).collect();
        peer.write("triangles", triangles)?;
        let rows = |packet: &Packet| {
            let [x, y, z] = packet.origin_m;
            let [dx, dy, dz] = packet.direction;
            [x, y, z, dx, dy, dz, packet.t_min, packet.t_max].map(|row| row.0)
        };
        let rays = packets.iter().flat_map(rows).flatten().flat_map(f32::to_le_bytes).collect();
        peer.write("rays", rays)?;
        Ok(peer)
    }

    fn write(&self, name: &str, bytes: Vec<u8>) -> Result<(), String> {
        let path = self.folder.join(name);
        std::fs::write(&path, bytes).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// The program and what it is to be called with for so many timed passes.
    pub fn command(&self, passes: u32, options: &[&str]) -> Vec<String> {
        let file = |name: &str| self.folder.join(name).to_string_lossy().into_owned();
        let mut words =
            vec![self.program.to_string_lossy().into_owned(), file("triangles"), file("rays"), file("answers")];
        words.push(passes.to_string());
        words.extend(options.iter().map(|&option| option.to_owned()));
        words
    }

    /// What the last run of the program answered.
    ///
    /// # Errors
    /// It wrote no answers.
    pub fn answers(&self) -> Result<Answers, String> {
        let path = self.folder.join("answers");
        let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let words: Vec<u32> = bytes.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
        let mut answers = Answers { t: Vec::new(), triangle: Vec::new() };
        for block in words.chunks_exact(2 * LANES) {
            answers.t.extend(block[..LANES].iter().map(|&bits| f32::from_bits(bits)));
            answers.triangle.extend(&block[LANES..]);
        }
        Ok(answers)
    }
}
