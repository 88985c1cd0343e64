//! Any bytes are an STL scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pellucid_scene::{NoAssets, stl};

fuzz_target!(|bytes: &[u8]| {
    let _ = stl::parse(bytes, &NoAssets);
});
