//! Bad input is refused by name, with an accepted value.

use sensel::config::Resolved;
use sensel::picture::{Channel, to_exr};
use sensel::plane::Plane;
use sensel::run::{NoProgress, Setup};
use sensel::scene::images::{CACHE_BYTES, Picture};

use super::{Files, grey_png_8, grey_png_16, size};

const K: &str = "40 0 23.5\n0 40 15.5\n0 0 1\n";

fn small(lines: &str, keys: &str) -> String {
    format!(
        "[scene]\nimages = \"film\"\nilluminance_lux = 100.0\n{lines}\n[rig]\nbaseline_mm = 0.0\n[run]\nframes = 2\n\
         [sensor]\nwidth = 64\nheight = 48\n{keys}"
    )
}

/// Four pictures of 48 x 32 px at 33 Hz, with a list and a camera. The second and third count for two frames at 30 Hz, whose
/// exposures stand at their ends.
fn good() -> Files {
    let mut files = Files::default();
    for number in 0..4 {
        files.0.insert(format!("film/{number:03}.png"), grey_png_8(size(48, 32), 100));
    }
    files.0.insert("film/times.csv".to_owned(), b"0\n0.03\n0.06\n0.09\n".to_vec());
    files.0.insert("film/K.txt".to_owned(), K.as_bytes().to_vec());
    files
}

fn setup(files: &Files, text: &str) -> Result<Setup, sensel::error::Error> {
    Setup::new(Resolved::from_layers("scenario.toml", text, &[])?, files, &NoProgress)
}

fn with(name: &str, bytes: &[u8]) -> Files {
    let mut files = good();
    files.0.insert(format!("film/{name}"), bytes.to_vec());
    files
}

fn without(names: &[&str]) -> Files {
    let mut files = good();
    files.0.retain(|name, _| !names.iter().any(|gone| name.ends_with(gone)));
    files
}

fn exr_with(value: f32) -> Vec<u8> {
    let mut plane = Plane::filled(size(48, 32), 0.5_f32);
    plane.row_mut(7)[5] = value;
    to_exr(&[Channel { name: "Y".to_owned(), plane }]).unwrap()
}

/// A PNG header that promises 65,535 by 65,535 pixels and holds none.
fn endless_png() -> Vec<u8> {
    let mut bytes = grey_png_8(size(48, 32), 100);
    bytes[16..20].copy_from_slice(&65_535_u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&65_535_u32.to_be_bytes());
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    bytes
}

/// ISO 3309, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| step(crc)))
}

/// An OpenEXR header whose data window ends at 65,534 by 65,534.
fn endless_exr() -> Vec<u8> {
    let mut bytes = exr_with(0.5);
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|part| part == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&65_534_i32.to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&65_534_i32.to_le_bytes());
    bytes
}

#[test]
fn good_pictures_are_taken() {
    let setup = setup(&good(), &small("", "")).unwrap();
    assert!(setup.scene_notes.iter().any(|note| note.contains("apart")), "{:?}", setup.scene_notes);
    assert!(setup.scene_notes.iter().any(|note| note.contains("black")), "{:?}", setup.scene_notes);
}

#[test]
fn bad_files_are_refused_by_name_with_what_would_do() {
    let whole = grey_png_8(size(48, 32), 100);
    let float = exr_with(0.5);
    let cases: Vec<(&str, Files, [&str; 2])> = vec![
        ("missing folder", Files::default(), ["film", "not there"]),
        ("no picture", without(&[".png"]), ["film", "no picture"]),
        ("no list", without(&["times.csv"]), ["scene.images_fps", "times.csv"]),
        ("no camera", without(&["K.txt"]), ["scene.images_camera", "K.txt"]),
        ("other size", with("002.png", &grey_png_8(size(47, 32), 100)), ["002.png", "47 x 32"]),
        ("cut PNG", with("001.png", &whole[..whole.len() / 2]), ["001.png", "PNG"]),
        ("empty PNG", with("001.png", &[]), ["001.png", "neither PNG nor OpenEXR"]),
        ("JPEG", with("001.png", &[0xff, 0xd8, 0xff, 0xe0, 0, 0]), ["001.png", "neither PNG nor OpenEXR"]),
        ("endless PNG", with("001.png", &endless_png()), ["001.png", "65535 x 65535"]),
        ("cut EXR", with("001.png", &float[..float.len() * 2 / 3]), ["001.png", "OpenEXR"]),
        ("endless EXR", with("001.png", &endless_exr()), ["001.png", "65535 x 65535"]),
        ("NaN", with("001.png", &exr_with(f32::NAN)), ["001.png", "column 5, row 7"]),
        ("infinite", with("001.png", &exr_with(f32::INFINITY)), ["001.png", "column 5, row 7"]),
        ("negative", with("001.png", &exr_with(-0.1)), ["001.png", "at least 0"]),
        ("times back", with("times.csv", b"0\n0.05\n0.04\n0.15\n"), ["times.csv", "line 3"]),
        ("words", with("times.csv", b"0\nsoon\n0.1\n0.15\n"), ["times.csv", "line 2"]),
        ("too few times", with("times.csv", b"0\n0.05\n0.1\n"), ["times.csv", "3 times for 4 pictures"]),
        ("unknown name", with("times.csv", b"0 000.png\n0.05 009.png\n"), ["times.csv", "009.png"]),
        ("way out", with("times.csv", b"0 000.png\n0.05 ../000.png\n"), ["times.csv", "../000.png"]),
        ("no matrix", with("K.txt", b"500 500 320 240"), ["K.txt", "3 x 3"]),
    ];
    let tried = cases.len();
    for (name, files, words) in cases {
        let error = setup(&files, &small("", "")).err().unwrap_or_else(|| panic!("{name} was taken"));
        assert_eq!(error.exit_code(), 2, "{name}: {error}");
        for word in words {
            assert!(error.to_string().contains(word), "{name}: {error} does not say {word}");
        }
        println!("{name}: {error}");
    }
    assert_eq!(tried, 20);
}

#[test]
fn bad_keys_are_refused_with_what_would_do() {
    let mut tried = 0;
    for (scene, keys, words) in [
        ("images_fps = 0.0", "", ["scene.images_fps", "0.001"]),
        ("images_blend = \"cubic\"", "", ["scene.images_blend", "nearest, linear"]),
        ("images_transfer = \"log\"", "", ["scene.images_transfer", "auto, srgb, linear"]),
        ("images_start_s = 0.2", "", ["run.frames", "scene.images_start_s"]),
        ("images_start_s = 0.06", "", ["run.frames", "up to 1 frames"]),
        ("images_depth = \"depth\"", "", ["scene.images", "depth"]),
        ("images_depth_per_m = 5000.0", "", ["scene.images_depth_per_m", "scene.images_depth"]),
        ("generator = \"box\"", "", ["scene.generator", "exactly one"]),
        ("reflectance = 0.5", "", ["scene.reflectance", "no effect"]),
        ("images_camera = { fx_px = 40.0 }", "", ["scene.images_camera", "horizontal_fov_deg"]),
        ("images_camera = { horizontal_fov_deg = 190.0 }", "", ["scene.images_camera.horizontal_fov_deg", "170"]),
        ("images_camera = { horizontal_fov_deg = 120.0, k1 = -0.9 }", "", ["scene.images_camera", "folds"]),
    ] {
        let error = setup(&good(), &small(scene, keys)).err().unwrap_or_else(|| panic!("{scene} was taken"));
        for word in words {
            assert!(error.to_string().contains(word), "{scene}: {error} does not say {word}");
        }
        println!("{error}");
        tried += 1;
    }
    assert_eq!(tried, 12);
    let two = small("", "").replace("\"film\"", "[\"film\", \"film\"]");
    assert!(setup(&good(), &two).err().unwrap().to_string().contains("2 folder(s) for 1 camera(s)"));
    let idle = "[scene]\ngenerator = \"box\"\nimages_fps = 10.0\n";
    assert!(setup(&good(), idle).err().unwrap().to_string().contains("scene.images_fps"));
}

#[test]
fn depth_files_are_read_in_their_own_steps_and_must_fit() {
    let mut files = good();
    for number in 0..4 {
        files.0.insert(format!("film/depth/{number:03}.png"), grey_png_16(size(48, 32), 10_000));
    }
    let text = small("images_depth = \"depth\"\nimages_depth_per_m = 5000.0", "");
    let made = setup(&files, &text).unwrap();
    assert!(made.world.has_depth());
    let depth = made.world.depth((0, &made.cameras[0]), 0.01).unwrap().unwrap();
    assert_eq!(depth.at(32, 24), 2.0);
    files.0.insert("film/depth/001.png".to_owned(), grey_png_16(size(48, 31), 10_000));
    assert!(setup(&files, &text).err().unwrap().to_string().contains("001.png"));
    files.0.remove("film/depth/001.png");
    assert!(setup(&files, &text).err().unwrap().to_string().contains("3 files for 4 pictures"));
}

#[test]
fn repeated_times_are_said_and_transparent_pictures_refused() {
    let files = with("times.csv", b"0 000.png\n0.05 001.png\n0.05 002.png\n0.15 003.png\n");
    let notes = setup(&files, &small("", "")).unwrap().scene_notes;
    assert!(notes.iter().any(|note| note.contains("repeats 1 time")), "{notes:?}");
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(8, 8, image::Rgba([9, 9, 9, 200]))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    let error = Picture::decode("a.png", bytes.get_ref(), None).unwrap_err().to_string();
    assert!(error.contains("a.png") && error.contains("transparent"), "{error}");
    const { assert!(CACHE_BYTES <= 256 << 20) };
}
