//! Holds techniques and backends against the oracle: the code behind `pellucid verify`, `pellucid compare` and the tests.
//!
//! [`suite`] lists the cases, and runs whatever renders through them. [`images`] compares pictures as the contract says:
//! agreeing, ambiguous and unexplained pixels. [`layers`] compares captures fragment by fragment. [`metrics`] measures how
//! far two pictures are apart, as the literature does. [`unsorted`] is the yardstick: blending without any order but that
//! of drawing.
#![forbid(unsafe_code)]

pub mod images;
pub mod layers;
pub mod metrics;
pub mod suite;
pub mod unsorted;
