//! Any bytes are a glTF scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pellucid_scene::{NoAssets, gltf};

fuzz_target!(|bytes: &[u8]| {
    let _ = gltf::parse(bytes, &NoAssets);
});
