//! A test for each file of `tests/scenarios/`: the whole firmware on a scripted board, in virtual time.

use host_tests::scenario;
use libtest_mimic::{Arguments, Failed, Trial};
use std::path::Path;
use std::process::ExitCode;
use std::{fs, io};

fn main() -> io::Result<ExitCode> {
    let arguments = Arguments::from_args();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenarios"));
    let mut trials = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path
            .extension()
            .is_none_or(|extension| extension != "scenario")
        {
            continue;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = name.replace('-', "_");
        trials.push(Trial::test(name, move || {
            let text = fs::read_to_string(&path)?;
            let played = scenario::play(&path.to_string_lossy(), &text);
            played.map_err(|failure| Failed::from(failure.to_string()))
        }));
    }
    trials.sort_by(|a, b| a.name().cmp(b.name()));
    Ok(libtest_mimic::run(&arguments, trials).exit_code())
}
