//! stub
/// stub
#[derive(Debug)]
pub struct Layers;
