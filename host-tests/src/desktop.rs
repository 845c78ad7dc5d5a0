//! The desktop arm as a process of its own, clients that speak to it over TCP, and hosts at its serial port.
//!
//! Every arm listens at port 1337, as Line-us does, of a loopback address of its own (Linux answers at
//! all of 127.0.0.0/8), so that tests run side by side.

mod client;
mod motion;
mod process;
pub mod serial;
mod web;

pub use client::{Client, TERMINATOR};
pub use motion::Motion;
pub use process::{
    Desktop, PORT, Run, WEB_PORT, binary, draw, own_address, target_folder, wait_until,
};
pub use web::{Answer, Web, WebSocket};
