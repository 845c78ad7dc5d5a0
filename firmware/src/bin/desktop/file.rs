//! Draws one file, as fast as possible.

use crate::home;
use crate::named;
use crate::options::{Dialect, Draw};
use embassy_executor::{SpawnError, Spawner};
use embassy_time::Timer;
use firmware::board::NoInputs;
use firmware::boards::desktop::VITALS;
use firmware::boards::desktop::clock::{self, Speed};
use firmware::boards::desktop::draw::{self, Outcome, Script};
use firmware::boards::desktop::draw_lasaur::{self, Listener as Replies, Sender};
use firmware::boards::desktop::flash::{self, FileFlash};
use firmware::boards::desktop::recorder::{Outputs, Recorder, Totals};
use firmware::services::House;
use firmware::services::line_us::serve;
use firmware::services::serial::{self, ReadError};
use indicatif::{ProgressBar, ProgressStyle};
use protocol_core::machine::{ArmData, Client, StopReason};
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// A file that speaks to the arm.
enum Host {
    LineUs(Script),
    Lasaur(Sender, Replies),
}

/// Draws one file in virtual time.
pub fn draw(options: Draw) -> io::Result<ExitCode> {
    static FINISHED: AtomicBool = AtomicBool::new(false);
    let bar = ProgressBar::new(0);
    let style = ProgressStyle::with_template("{bar:40} {percent}% of {bytes_total}, {eta} left");
    bar.set_style(style.map_err(io::Error::other)?);
    let path = &options.file;
    let named = |error: io::Error| named(&path.display(), error);
    let (host, outcome): (_, Box<dyn Fn() -> Outcome>) = match options.dialect {
        Dialect::LineUs => {
            let (script, outcome) = draw::open(path, bar.clone()).map_err(named)?;
            (Host::LineUs(script), Box::new(move || *outcome.borrow()))
        }
        Dialect::Lasaur => {
            let (sender, replies) = draw_lasaur::open(path, bar.clone()).map_err(named)?;
            let outcome = sender.outcome();
            (Host::Lasaur(sender, replies), Box::new(outcome))
        }
    };
    let data = ArmData::default();
    let outputs = Outputs {
        trace: options.common.trace.clone(),
        picture: options.picture.clone(),
        go_on: false,
    };
    let (recorder, servos) = Recorder::start(outputs, data, false)?;
    let (house, memory) = home::house(data, FileFlash::in_memory(flash::SIZE), true, VITALS)?;
    let album = home::album(FileFlash::in_memory(flash::DRAWINGS_SIZE))?;
    let frame = options.common.frame();

    // Nobody watches: time may always jump.
    clock::hurry(true);
    let mut spawned = Ok(());
    let spawn = |spawner: Spawner| {
        spawner.spawn(home::arm(house, servos, frame)?);
        spawner.spawn(home::storage(house, memory)?);
        spawner.spawn(home::drawings(house, album)?);
        spawner.spawn(client(host, house)?);
        Ok::<_, SpawnError>(())
    };
    clock::run(
        Speed::Max,
        |spawner| spawned = spawn(spawner),
        || FINISHED.load(Ordering::Relaxed),
    );
    spawned.map_err(io::Error::other)?;
    let totals = recorder.finish()?;
    bar.finish_and_clear();
    let outcome = outcome();
    // Nobody has to listen.
    let _ = tell(&outcome, &totals);
    let stopped = house.arm.with(|machine| machine.stopped());
    if let Some(StopReason::Limit(side)) = stopped {
        eprintln!("the arm was stopped at the edge of the table, {side:?}");
    }
    return Ok(if outcome.is_clean() && stopped.is_none() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    });

    #[embassy_executor::task]
    async fn client(host: Host, house: &'static House) {
        match (host, Client::new(0)) {
            (Host::LineUs(script), Some(client)) => serve(script, client, house).await,
            (Host::LineUs(_), None) => {}
            (Host::Lasaur(sender, replies), _) => {
                serial::serve(sender, replies, ReadError::Ended, &mut NoInputs, house).await;
            }
        }
        while house.arm.with(|machine| machine.is_busy()) {
            Timer::after_millis(1).await;
        }
        FINISHED.store(true, Ordering::Relaxed);
    }
}

fn tell(outcome: &Outcome, totals: &Totals) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let seconds = totals.moving.as_secs_f64();
    writeln!(out, "commands        {}", outcome.commands)?;
    writeln!(out, "errors          {}", outcome.errors)?;
    writeln!(out, "strokes         {}", totals.strokes)?;
    writeln!(out, "pen down        {:.1} mm", totals.pen_down_mm)?;
    writeln!(out, "pen up          {:.1} mm", totals.pen_up_mm)?;
    writeln!(out, "points limited  {}", outcome.limited)?;
    writeln!(
        out,
        "time of the arm {:.0} min {:.1} s",
        (seconds / 60.0).floor(),
        seconds % 60.0
    )?;
    Ok(())
}
