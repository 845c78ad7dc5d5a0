//! Updates: the firmware's service with a server and a flash in a script's hands, in virtual time.

#[path = "../memory/chip.rs"]
#[allow(dead_code, reason = "pages do not wear out here")]
mod chip;
mod cuts;
#[path = "../memory/dice.rs"]
#[allow(dead_code, reason = "only tears are thrown here")]
mod dice;
mod machine;
mod offers;
mod refusals;
mod success;
mod trial;
