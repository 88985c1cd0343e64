//! Passes that techniques share, one file each. Twins of their shaders: `shaders/pass`.

pub(crate) mod gather;
pub(crate) mod grid;
pub(crate) mod opaque;
pub(crate) mod ordered;
pub(crate) mod picture;
pub(crate) mod prefix_sum;
pub(crate) mod whole_window;
