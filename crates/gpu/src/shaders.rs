//! The linked shaders, made by `build.rs`.

include!(concat!(env!("OUT_DIR"), "/linked_shaders.rs"));
