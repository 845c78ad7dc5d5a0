//! LasaurGrbl over the desktop arm's serial port.

mod draw;
mod hosts;
mod port;
mod stop;
