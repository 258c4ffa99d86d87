//! Entries come back in every bit or not at all.

use std::sync::{Arc, Mutex};

use super::*;
use crate::files::scratch::Scratch;

/// Photons with noise, a black border and extreme values.
fn exposure(seed: u64, size: Size) -> Exposure {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut values = Vec::new();
    for pixel in 0..size.pixel_count() {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let noise = f32::from(crate::num::low_u16(crate::num::low_u32(state))) * 0.01;
        values.push(if pixel % 17 == 0 { 0.0 } else { 900.0 + noise });
    }
    let last = values.len() - 1;
    (values[0], values[last]) = (f32::MAX, f32::MIN_POSITIVE);
    Exposure { photons: Plane::from_values(size, values), render_variance_ratio: 0.123, rays: 77 }
}

fn bits(exposure: &Exposure) -> (Size, Vec<u32>, u64, u64) {
    let bits = exposure.photons.values().iter().map(|value| value.to_bits()).collect();
    (exposure.photons.size(), bits, exposure.render_variance_ratio.to_bits(), exposure.rays)
}

/// A store, and what it says.
fn store_in(scratch: &Scratch, capacity_bytes: u64) -> (PhotonFiles, Arc<Mutex<Vec<String>>>) {
    let said = Arc::new(Mutex::new(Vec::new()));
    let told = Arc::clone(&said);
    let say = move |text: &str| told.lock().unwrap().push(text.to_owned());
    (PhotonFiles::open(scratch.path(), capacity_bytes, say).unwrap(), said)
}

#[test]
fn an_entry_comes_back_in_every_bit() {
    let mut tried = 0;
    for (width_px, height_px) in [(1, 1), (1, 7), (9, 1), (31, 17), (160, 120)] {
        for seed in 1..4 {
            let mut seen = exposure(seed, Size { width_px, height_px });
            seen.render_variance_ratio = [0.5, f64::INFINITY, f64::NAN][tried % 3];
            assert_eq!(
                bits(&decode(&encode(&seen, None)).unwrap()),
                bits(&seen),
                "{width_px} x {height_px}, seed {seed}"
            );
            tried += 1;
        }
    }
    assert_eq!(tried, 15);
}

#[test]
fn rounded_photons_come_back_in_every_bit_from_less_than_half_the_bytes() {
    let size = Size { width_px: 160, height_px: 120 };
    let mut seen = exposure(3, size);
    let exact_bytes = encode(&seen, None).len();
    let rounding = Rounding::new(0.3).unwrap();
    rounding.round(&mut seen, 0.6);
    let coded = encode(&seen, Some(rounding));
    assert_eq!(bits(&decode(&coded).unwrap()), bits(&seen));
    // The noise here is 0 to 655 photons on 900: 60 levels, or 6 bits in place of some 18.
    assert!(coded.len() * 5 < exact_bytes * 2, "{} of {exact_bytes} bytes", coded.len());
}

#[test]
fn every_flipped_byte_of_200_entries_is_found_said_and_replaced() {
    let scratch = Scratch::new();
    let (store, said) = store_in(&scratch, 1 << 24);
    let mut flips = 0;
    for number in 0..200_u64 {
        let seen = exposure(number + 1, Size { width_px: 5, height_px: 4 });
        let key = blake3::hash(&number.to_le_bytes()).to_hex().to_string();
        store.keep(&key, &seen, None);
        let path = scratch.path().join(format!("{key}.entry"));
        let whole = std::fs::read(&path).unwrap();
        for at in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << (at % 8);
            std::fs::write(&path, &flipped).unwrap();
            assert!(store.load(&key).is_none(), "entry {number}, byte {at}");
            flips += 1;
        }
        store.keep(&key, &seen, None);
        assert_eq!(bits(&store.load(&key).unwrap()), bits(&seen));
    }
    let said = said.lock().unwrap();
    assert_eq!(said.len(), flips, "every one is said");
    assert!(flips > 200 * 60, "{flips}");
    assert!(said.iter().all(|text| text.contains("damaged") && text.contains(".entry")));
    assert_eq!(store.counts().damaged, u64_from(flips));
}

#[test]
fn two_stores_that_fill_one_folder_at_once_lose_and_tear_nothing() {
    let scratch = Scratch::new();
    let folder = scratch.path();
    let size = Size { width_px: 33, height_px: 21 };
    let key = |number: u64| blake3::hash(&number.to_le_bytes()).to_hex().to_string();
    std::thread::scope(|threads| {
        for _ in 0..2 {
            threads.spawn(|| {
                let store = PhotonFiles::open(folder, 1 << 26, |text| panic!("{text}")).unwrap();
                for round in 0..3 {
                    for number in 0..40 {
                        match store.load(&key(number)) {
                            Some(seen) => assert_eq!(bits(&seen), bits(&exposure(number, size)), "round {round}"),
                            None => store.keep(&key(number), &exposure(number, size), None),
                        }
                    }
                }
            });
        }
    });
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 40, "no unfinished file is left");
}

#[test]
fn a_store_keeps_to_its_size_and_says_what_it_cannot_hold() {
    let scratch = Scratch::new();
    let (store, said) = store_in(&scratch, 20_000);
    let size = Size { width_px: 40, height_px: 20 };
    for number in 0..60_u64 {
        store.keep(&blake3::hash(&number.to_le_bytes()).to_hex(), &exposure(number + 1, size), None);
        let bytes: u64 = std::fs::read_dir(scratch.path()).unwrap().map(|e| e.unwrap().metadata().unwrap().len()).sum();
        assert!(bytes <= 20_000, "{bytes} after {number}");
    }
    assert!(said.lock().unwrap().is_empty());
    store.keep(&"ab".repeat(32), &exposure(1, Size { width_px: 300, height_px: 300 }), None);
    store.keep(&"cd".repeat(32), &exposure(1, Size { width_px: 300, height_px: 300 }), None);
    assert_eq!(said.lock().unwrap().len(), 1, "said once");
}

#[test]
fn bytes_of_any_kind_are_no_entry_and_no_panic() {
    let whole = encode(&exposure(3, Size { width_px: 6, height_px: 6 }), None);
    for cut in 0..whole.len() {
        assert!(decode(&whole[..cut]).is_none(), "cut to {cut}");
    }
    let mut huge = whole;
    huge[4..12].fill(0xff);
    assert!(decode(&huge).is_none());
    assert!(decode(&[]).is_none());
}
