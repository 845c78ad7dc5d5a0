//! Tests of Quill from outside, and what they need: an independent model of the arm ([`model`]), the
//! core's session and machine without a firmware around them ([`mod@bench`]), and the desktop arm as a
//! process with clients over TCP ([`desktop`]); some of these clients are written in Python ([`python`]).

pub mod bench;
pub mod desktop;
pub mod model;
pub mod python;
pub mod scenario;
pub mod scripted;
