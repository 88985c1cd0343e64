//! stub
/// stub
#[derive(Debug)]
pub enum Resolve {
    /// s
    Blend,
}
