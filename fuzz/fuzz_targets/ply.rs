//! Any bytes are a PLY scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pellucid_scene::{NoAssets, ply};

fuzz_target!(|bytes: &[u8]| {
    let _ = ply::parse(bytes, &NoAssets);
});
