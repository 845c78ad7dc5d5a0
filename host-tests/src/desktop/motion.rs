//! What the servos did, by a trace.

use super::process::draw;
use std::fs;
use std::path::Path;

/// Pulses of one frame after the other, rests left out.
pub struct Motion(Vec<String>);

impl Motion {
    /// Of a trace.
    ///
    /// # Panics
    /// When it cannot be read.
    pub fn of(trace: &Path) -> Self {
        let text = fs::read_to_string(trace).expect("the arm writes its trace");
        let pulses = |row: &str| row.split(',').skip(4).take(3).collect::<Vec<_>>().join(" ");
        let mut frames: Vec<String> = text.lines().skip(1).map(pulses).collect();
        frames.dedup();
        Self(frames)
    }

    /// What a client has the servos do that sends these lines to an arm of its own.
    ///
    /// # Panics
    /// When one of them is refused.
    pub fn of_a_client(lines: &str) -> Self {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let (file, trace) = (folder.path().join("a.gcode"), folder.path().join("a.csv"));
        fs::write(&file, lines).expect("there is room for a file");
        let run = draw(&file, &["--trace", &trace.to_string_lossy()]);
        assert_eq!(run.status, 0, "{}", run.stderr);
        Self::of(&trace)
    }

    /// That it is the same as another one.
    ///
    /// # Panics
    /// When it is not, with the frames around the first difference.
    pub fn assert_is(&self, expected: &Self) {
        let (ours, theirs) = (&self.0, &expected.0);
        let differs = (0..ours.len().max(theirs.len())).find(|at| ours.get(*at) != theirs.get(*at));
        let Some(at) = differs else { return };
        let around = |frames: &[String]| {
            let from = at.saturating_sub(2).min(frames.len());
            frames[from..(at + 3).min(frames.len())].join("\n  ")
        };
        panic!(
            "the servos do something else from frame {at} of {} and {} on:\n  {}\nwhere expected is\n  {}",
            ours.len(),
            theirs.len(),
            around(ours),
            around(theirs)
        );
    }
}
