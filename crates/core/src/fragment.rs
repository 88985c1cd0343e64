//! stub
/// stub
#[derive(Debug)]
pub struct Fragment;
