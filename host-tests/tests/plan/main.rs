//! A plotter's jobs: how long they take, and what holds for any of them.

mod jobs;
mod properties;
mod times;
mod way;
