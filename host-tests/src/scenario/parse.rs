//! A line of a scenario becomes a typed command here.

use super::command::{
    Action, ClientAction, ClientExpectation, Command, Expectation, Kept, Memory, Network, Outcome,
    Remembered,
};
use super::server;
use super::words::Words;
use crate::scripted::flash::Wear;
use crate::scripted::light::{Hue, Pattern};
use embassy_time::Duration;
use protocol_core::settings::{AccessPointName, MachineName, StartMode};
use protocol_core::update::ManifestAddress;
use protocol_core::wifi::{self, Password, Ssid};

/// Reads a line that is no comment.
pub fn parse(line: &str) -> Result<Command, String> {
    let (mut words, within) = Words::new(line).split_within();
    words.eat("the");
    if let Some(expectation) = expectation(&mut words)? {
        return Ok(Command::Expect(expectation, within));
    }
    let action = action(&mut words)?.ok_or("no such line")?;
    match within {
        None => Ok(Command::Do(action)),
        Some(_) => Err("this is not waited for: no 'within'".into()),
    }
}

type Found<T> = Result<Option<T>, String>;

/// The value, if nothing is left.
fn whole<T>(words: &Words<'_>, value: T) -> Found<T> {
    words.end()?;
    Ok(Some(value))
}

fn action(words: &mut Words<'_>) -> Found<Action> {
    if let Some(client) = client(words) {
        let action = client_action(words)?.ok_or("a client does no such thing")?;
        return Ok(Some(Action::Client(client, action)));
    }
    let action = if words.eat("power on") {
        let held = words.eat("with the button held");
        Action::PowerOn { held }
    } else if words.eat("cut the power") {
        Action::CutThePower
    } else if words.eat("power fails after") {
        let bytes = words.number()?;
        if !words.eat("bytes") {
            return Err("the power fails after a number of bytes".into());
        }
        Action::PowerFailsAfter(bytes)
    } else if words.eat("memory holds") {
        Action::Remember(kept(words)?)
    } else if words.eat("memory is") {
        Action::Memory(memory(words)?)
    } else if words.eat("press the button") {
        Action::Press
    } else if words.eat("hold the button for") {
        Action::Hold(words.time()?)
    } else if words.eat("hold the button") {
        Action::Button(true)
    } else if words.eat("let go of the button") {
        Action::Button(false)
    } else if words.eat("network") {
        Action::Network(ssid(words)?, network(words)?)
    } else if words.eat("link is lost") {
        Action::LoseTheLink
    } else if words.eat("radio fails") {
        Action::RadioWorks(false)
    } else if words.eat("radio works") {
        Action::RadioWorks(true)
    } else if words.eat("listening takes") {
        Action::ScanTakes(words.time()?)
    } else if words.eat("joining takes") {
        Action::JoinTakes(words.time()?)
    } else if words.eat("computer leaves") {
        Action::ComputerLeaves
    } else if words.eat("server") {
        Action::Server(server::parse(words)?)
    } else if words.eat("server's") {
        Action::Server(server::parse_file(words)?)
    } else if words.eat("board has no place for another firmware") {
        Action::OneSlot
    } else if words.eat("firmware hangs") {
        Action::Hang
    } else if words.eat("wait") {
        Action::Wait(words.time()?)
    } else {
        return Ok(None);
    };
    whole(words, action)
}

fn memory(words: &mut Words<'_>) -> Result<Memory, String> {
    for (name, memory) in [
        ("empty", Memory::Empty),
        ("garbage", Memory::Garbage),
        ("worn out silently", Memory::Wear(Wear::Silent)),
        ("worn out", Memory::Wear(Wear::WornOut)),
        ("well", Memory::Wear(Wear::Well)),
    ] {
        if words.eat(name) {
            return Ok(memory);
        }
    }
    Err("the memory is empty, garbage, worn out or well".into())
}

fn kept(words: &mut Words<'_>) -> Result<Kept, String> {
    Ok(if words.eat("network") {
        let ssid = ssid(words)?;
        let password = words.eat("password").then(|| password(words)).transpose()?;
        Kept::Network(wifi::Network { ssid, password })
    } else if words.eat("name") {
        let name = words.next_word().and_then(MachineName::new);
        Kept::Name(name.ok_or("a name is 1 to 32 letters, digits and inner hyphens")?)
    } else if words.eat("start mode") {
        let mode = StartMode::from_number(words.number()?);
        Kept::Start(mode.ok_or("a start mode is 1 to 4")?)
    } else if words.eat("access point name") {
        let name = AccessPointName::from_number(words.number()?);
        Kept::AccessPoint(name.ok_or("1 is Line-us-Setup, 2 the machine's name")?)
    } else if words.eat("no waves") {
        Kept::Waves(false)
    } else if words.eat("update address") {
        let address = words.text()?;
        let address = ManifestAddress::new(&String::from_utf8_lossy(&address));
        Kept::UpdateAddress(address.ok_or("an address is http://HOST[:PORT]/PATH")?)
    } else {
        return Err(
            "the memory holds a network, a name, a start mode, an access point name, an update address or no waves"
                .into(),
        );
    })
}

fn network(words: &mut Words<'_>) -> Result<Network, String> {
    let mut network = Network::default();
    while words.end().is_err() {
        if words.eat("up") {
            network.up = Some(true);
        } else if words.eat("down") {
            network.up = Some(false);
        } else if words.eat("open") {
            network.password = Some(None);
        } else if words.eat("password") {
            network.password = Some(Some(password(words)?));
        } else {
            network.signal_dbm = Some(words.number()?);
            if !words.eat("dBm") {
                return Err("a strength has a unit: dBm".into());
            }
        }
    }
    Ok(network)
}

fn ssid(words: &mut Words<'_>) -> Result<Ssid, String> {
    Ssid::new(&words.text()?).ok_or("a network's name has 1 to 32 bytes".into())
}

fn password(words: &mut Words<'_>) -> Result<Password, String> {
    Password::new(&words.text()?).ok_or("a password has 8 to 63 bytes".into())
}

/// A capital letter by itself is a client.
fn client(words: &mut Words<'_>) -> Option<char> {
    let mut ahead = *words;
    let mut name = ahead.next_word()?.chars();
    let client = name.next().filter(char::is_ascii_uppercase)?;
    if name.next().is_some() {
        return None;
    }
    *words = ahead;
    Some(client)
}

fn client_action(words: &mut Words<'_>) -> Found<ClientAction> {
    let action = if words.eat("sends bytes") {
        ClientAction::Send(words.text()?)
    } else if words.eat("sends") {
        let mut ahead = *words;
        let count = ahead.number::<usize>().ok().filter(|_| ahead.eat("times:"));
        let line = count.map_or(words.rest(), |_| ahead.rest());
        let lines = format!("{line}\n").repeat(count.unwrap_or(1));
        return Ok(Some(ClientAction::Send(lines.into_bytes())));
    } else if words.eat("stops sending") {
        ClientAction::StopSending
    } else if words.eat("closes") {
        ClientAction::Close
    } else if words.eat("resets") {
        ClientAction::Reset
    } else if words.eat("dies") {
        ClientAction::Die
    } else if words.eat("stops reading") {
        ClientAction::Read(false)
    } else if words.eat("reads again") {
        ClientAction::Read(true)
    } else if words.eat("ignores what it hears") {
        ClientAction::Ignore
    } else {
        return Ok(None);
    };
    whole(words, action)
}

fn expectation(words: &mut Words<'_>) -> Found<Expectation> {
    let mut ahead = *words;
    if let Some(client) = client(&mut ahead) {
        let found = client_expectation(&mut ahead)?;
        return Ok(found.map(|expectation| Expectation::Client(client, expectation)));
    }
    let expectation = if words.eat("computer joins") {
        Expectation::ComputerJoins(ssid(words)?)
    } else if words.eat("light was never") {
        Expectation::LightWasNever(hue(words)?)
    } else if words.eat("light stays") {
        Expectation::LightStays(pattern(words)?, stay(words)?)
    } else if words.eat("light") {
        Expectation::Light(pattern(words)?)
    } else if words.eat("power is off") {
        Expectation::PowerIsOff
    } else if words.eat("machine") {
        machine(words)?
    } else if words.eat("arm waves") {
        Expectation::ArmWaves
    } else if words.eat("arm rests at") {
        Expectation::ArmRests(Some([words.number()?, words.number()?, words.number()?]))
    } else if words.eat("arm rests") {
        Expectation::ArmRests(None)
    } else if words.eat("arm stays") {
        Expectation::ArmStays(stay(words)?)
    } else if words.eat("pen is") {
        Expectation::Pen { down: down(words)? }
    } else if words.eat("pen stays") {
        Expectation::PenStays {
            down: down(words)?,
            time: stay(words)?,
        }
    } else if words.eat("nib passes") {
        let (x, y) = (words.number()?, words.number()?);
        let z = words.end().is_err().then(|| words.number()).transpose()?;
        Expectation::NibPasses(x, y, z)
    } else {
        return Ok(None);
    };
    whole(words, expectation)
}

fn machine(words: &mut Words<'_>) -> Result<Expectation, String> {
    Ok(if words.eat("opens") {
        let ssid = ssid(words)?;
        let password = words.eat("password").then(|| password(words)).transpose()?;
        Expectation::Opens(ssid, password)
    } else if words.eat("closes its network") {
        Expectation::ClosesItsNetwork
    } else if words.eat("joins") {
        Expectation::Tries(ssid(words)?, Outcome::Joined)
    } else if words.eat("does not find") {
        Expectation::Tries(ssid(words)?, Outcome::NotFound)
    } else if words.eat("is found as") {
        let host = words.text()?;
        Expectation::IsFound(Some(String::from_utf8_lossy(&host).into_owned()))
    } else if words.eat("is not found") {
        Expectation::IsFound(None)
    } else if words.eat("is refused by") {
        Expectation::Tries(ssid(words)?, Outcome::Refused)
    } else if words.eat("fails to join") {
        Expectation::Tries(ssid(words)?, Outcome::Failed)
    } else if words.eat("may start again") {
        Expectation::MayStartAgain
    } else if words.eat("may try") {
        Expectation::MayTry(ssid(words)?)
    } else if words.eat("tries nothing") {
        Expectation::TriesNothing(stay(words)?)
    } else if words.eat("starts again") {
        Expectation::StartsAgain
    } else if words.eat("runs") {
        let names = words.take_rest().split(" or ");
        Expectation::Runs(names.map(str::to_owned).collect())
    } else if words.eat("remembers") {
        Expectation::Remembers(remembered(words)?)
    } else {
        return Err("the machine does no such thing".into());
    })
}

fn remembered(words: &mut Words<'_>) -> Result<Remembered, String> {
    Ok(if words.eat("nothing") {
        Remembered::Nothing
    } else if words.eat("no network") {
        Remembered::Networks(0)
    } else if words.eat("network") {
        let ssid = ssid(words)?;
        let password = words.eat("password").then(|| password(words)).transpose()?;
        Remembered::Network(ssid, password)
    } else if words.eat("name") {
        let mut names = Vec::new();
        loop {
            let name = words.text()?;
            names.push(String::from_utf8_lossy(&name).into_owned());
            if !words.eat("or") {
                break Remembered::Names(names);
            }
        }
    } else {
        let count = words.number()?;
        if !words.eat("networks") {
            return Err("the machine remembers a number of networks".into());
        }
        Remembered::Networks(count)
    })
}

fn client_expectation(words: &mut Words<'_>) -> Found<ClientExpectation> {
    let expectation = if words.eat("connects") {
        ClientExpectation::Connects
    } else if words.eat("cannot connect") {
        ClientExpectation::CannotConnect
    } else if words.eat("is disconnected") {
        ClientExpectation::IsDisconnected
    } else if words.eat("hears nothing") {
        ClientExpectation::HearsNothing(stay(words)?)
    } else if words.eat("hears one of:") {
        let messages = words.rest().split(" | ").map(message);
        return Ok(Some(ClientExpectation::Hears(messages.collect())));
    } else if words.eat("hears several:") {
        return Ok(Some(ClientExpectation::HearsSeveral(message(words.rest()))));
    } else if words.eat("hears") {
        return Ok(Some(ClientExpectation::Hears(vec![message(words.rest())])));
    } else {
        return Ok(None);
    };
    whole(words, expectation)
}

/// `ok` stands for `ok ` with its blank, which an editor would not keep.
fn message(text: &str) -> String {
    match text.trim() {
        "ok" => "ok ".into(),
        other => other.into(),
    }
}

fn stay(words: &mut Words<'_>) -> Result<Duration, String> {
    if !words.eat("for") {
        return Err("for how long?".into());
    }
    words.time()
}

fn down(words: &mut Words<'_>) -> Result<bool, String> {
    if words.eat("down") {
        Ok(true)
    } else if words.eat("up") {
        Ok(false)
    } else {
        Err("the pen is up or down".into())
    }
}

fn hue(words: &mut Words<'_>) -> Result<Hue, String> {
    let name = words.next_word().ok_or("a colour is missing")?;
    Hue::named(name).ok_or(format!("{name:?} is no colour of the light"))
}

fn pattern(words: &mut Words<'_>) -> Result<Pattern, String> {
    let first = hue(words)?;
    let second = if words.eat("flashing") {
        Hue::DARK
    } else if words.eat("and") {
        let second = hue(words)?;
        words.eat("in turn");
        second
    } else {
        return Ok(Pattern::Steady(first));
    };
    Ok(Pattern::in_turn(first, second, words.eat("fast")))
}
