//! Tests of Quill from outside, and what they need: an independent model of the arm ([`model`]), the
//! core's session and machine without a firmware around them ([`mod@bench`], and for a plotter's plan
//! [`mod@plotter`]), the desktop arm as a process with clients over TCP ([`desktop`]), some of them
//! written in Python ([`python`]), and a serial session with a host at its other end ([`lasaur`]); signed images ([`manifest`]) and who
//! serves them ([`web_server`]).

pub mod bench;
pub mod desktop;
pub mod lasaur;
pub mod manifest;
pub mod model;
pub mod plotter;
pub mod python;
pub mod scenario;
pub mod scripted;
pub mod web_server;
