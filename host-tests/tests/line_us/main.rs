//! Line-us as its clients meet it: the desktop arm over real TCP.

mod clients;
mod draw;
mod drawings;
mod flood;
mod framing;
mod memory;
mod motion;
mod picture;
