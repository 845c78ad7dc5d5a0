//! What the radio is to do.

use crate::scenario::command::{Expectation, Outcome};
use crate::scenario::stage::Stage;
use crate::scripted::radio::{offered, shown};
use embassy_time::Duration;
use protocol_core::wifi::Joined;

pub fn expect(
    stage: &mut Stage,
    expectation: &Expectation,
    patience: Duration,
) -> Result<(), String> {
    match expectation {
        Expectation::Opens(ssid, password) => {
            let record = stage.board.radio.clone();
            stage.pass_time(patience, |_| !record.opened.borrow().is_empty())?;
            match record.opened.borrow_mut().pop_front() {
                Some(own) if own.ssid == *ssid && own.password == *password => Ok(()),
                Some(other) => Err(format!("the machine opens {}", offered(&other))),
                None => Err("the machine opens no network".into()),
            }
        }
        Expectation::ClosesItsNetwork => {
            let closed = stage.pass_time(patience, |stage| stage.board.air.own().is_none())?;
            closed.then_some(()).ok_or("it stays open".into())
        }
        Expectation::Tries(ssid, outcome) => {
            stage.tries_allowed = None;
            let record = stage.board.radio.clone();
            stage.pass_time(patience, |_| !record.tries.borrow().is_empty())?;
            let tried = record.tries.borrow_mut().pop_front();
            match tried {
                Some((other, ended)) if other == *ssid && is(ended, *outcome) => Ok(()),
                Some((other, ended)) => {
                    Err(format!("the machine tries {}: {ended:?}", shown(&other)))
                }
                None => Err("the machine tries no network".into()),
            }
        }
        Expectation::MayTry(ssid) => {
            stage.tries_allowed = Some(ssid.clone());
            Ok(())
        }
        Expectation::TriesNothing(time) => {
            stage.tries_allowed = None;
            let record = stage.board.radio.clone();
            stage.pass_time(*time, |_| !record.tries.borrow().is_empty())?;
            match record.tries.borrow().front() {
                Some((ssid, ended)) => Err(format!("the machine tries {}: {ended:?}", shown(ssid))),
                None => Ok(()),
            }
        }
        _ => Err("nothing of the radio".into()),
    }
}

const fn is(joined: Joined, outcome: Outcome) -> bool {
    matches!(
        (joined, outcome),
        (Joined::Yes, Outcome::Joined)
            | (Joined::NotFound, Outcome::NotFound)
            | (Joined::WrongPassword, Outcome::Refused)
            | (Joined::Failed(_), Outcome::Failed)
    )
}
