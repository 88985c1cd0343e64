//! Any bytes are an OBJ scene or an error. Every material library it names holds the same bytes again, so that one
//! input covers both formats; there are no textures.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pellucid_scene::{Assets, LoadError, NoAssets, obj};

struct Same<'a>(&'a [u8]);

impl Assets for Same<'_> {
    fn read(&self, name: &str) -> Result<Vec<u8>, LoadError> {
        if name.ends_with(".mtl") { Ok(self.0.to_vec()) } else { NoAssets.read(name) }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let _ = obj::parse(bytes, &Same(bytes));
});
