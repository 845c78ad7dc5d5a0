//! LasaurGrbl sessions without a machine ([`rig`]), the checksum as the page computes it ([`oracle`]), and hosts as
//! they are seen on the wire ([`host`]).

pub mod host;
pub mod oracle;
pub mod rig;
