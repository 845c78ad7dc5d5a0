//! From what is asked for to who answers it.

use super::exchange::{Answer, Exchange, Trouble};
use super::failure::Status;
use super::request::{Request, What};
use super::state::with_state;
use super::{by_hand, drawing, networks, page, settings, state, update};
use crate::services::House;
use embedded_io_async::{Read, Write};
use protocol_core::machine::Client;

/// Serves a request that is not for a WebSocket.
pub async fn answer<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    request: Request,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    match serve(exchange, request, client, house).await {
        Err(Trouble::Failure(failure)) => exchange.refuse(&failure).await,
        outcome => outcome,
    }
}

async fn serve<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    request: Request,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    match request.what {
        What::Page => page::answer(exchange, request.has_page).await,
        What::Machine => {
            let name = house.name();
            exchange
                .json(Status::OK, &state::machine(&name, house))
                .await
        }
        What::State => {
            let snapshot = state::Snapshot::of(house);
            with_state(&snapshot, async |state| {
                exchange.json(Status::OK, state).await
            })
            .await
        }
        What::Begin | What::Proceed => drawing::upload(exchange, request, house).await,
        What::Pause => drawing::pause(exchange, house).await,
        What::Resume => drawing::steer(exchange, house.job.resume(), house).await,
        What::Stop => drawing::steer(exchange, house.job.stop(), house).await,
        What::Drawing => drawing::give(exchange, house).await,
        What::Jog => by_hand::jog(exchange, client, house).await,
        What::Move => by_hand::go(exchange, client, house).await,
        What::Home => by_hand::home(exchange, client, house).await,
        What::Calibrate => by_hand::calibrate(exchange, true, client, house).await,
        What::ClearCalibration => by_hand::calibrate(exchange, false, client, house).await,
        What::Settings => settings::give(exchange, house).await,
        What::ChangeSettings => settings::change(exchange, client, house).await,
        What::Networks => networks::give(exchange, house).await,
        What::AddNetwork => networks::add(exchange, client, house).await,
        What::ForgetNetwork => networks::forget(exchange, client, house).await,
        What::Update => update::take(exchange, house).await,
        What::Preflight => {
            let answer = Answer {
                headers: "Access-Control-Allow-Methods: GET, POST, PATCH, DELETE\r\n\
                    Access-Control-Allow-Headers: Content-Type\r\n\
                    Access-Control-Allow-Private-Network: true\r\n\
                    Access-Control-Max-Age: 600\r\n",
                ..Answer::default()
            };
            exchange.head(Status::NO_CONTENT, answer).await
        }
        // These are WebSockets, and were taken before.
        What::Gcode | What::Live => Err(Trouble::Gone),
    }
}
