//! LasaurGrbl sessions: hosts' transcripts, a noisy line, and any bytes at all.

mod any_bytes;
mod noise;

mod transcripts;
