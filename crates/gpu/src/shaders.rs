//! The linked shaders, made by `build.rs`.

include!(concat!(env!("OUT_DIR"), "/linked_shaders.rs"));

/// A constant of a shader's source.
#[cfg(test)]
pub(crate) fn constant(source: &str, name: &str) -> u64 {
    let value = source.split(&format!("const {name}: u32 = ")).nth(1).and_then(|rest| rest.split("u;").next());
    value.and_then(|value| value.parse().ok()).unwrap_or_else(|| panic!("{name}"))
}
