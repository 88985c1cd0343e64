//! Holds techniques and backends against the oracle: the code behind the tests, and later behind `pellucid verify`.
//!
//! [`images`] compares pictures as the contract says: agreeing, ambiguous and unexplained pixels. [`layers`] compares
//! captures fragment by fragment, for techniques that may not differ at all.
#![forbid(unsafe_code)]

pub mod images;
pub mod layers;
