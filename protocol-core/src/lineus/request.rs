//! What a line asks for. The methods that answer it, or know more of it, are those of
//! [`Reply`](super::Reply) and [`Session`](super::Session).

use crate::arm::{NibShift, ZMap};
use crate::drawings::{ButtonDraws, Replay, Slot};
use crate::machine::{Errand, Manner, Target};
use crate::motion::StepSize;
use crate::settings::{AccessPointName, MachineName, StartMode};
use crate::update::ManifestAddress;
use crate::wifi::{Password, Ssid};

/// What a line asks for, in arm coordinates; each is answered by exactly one reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Nothing more to do: the reply has been written.
    Answered,
    /// The same, and nothing more of this connection is to be executed: a browser sends what some page
    /// from elsewhere made up, and commands would come next.
    HangUp,
    /// To be answered by `Reply::report`.
    Errand(Errand),
    /// To be answered by `Reply::ok`.
    SetSpeed {
        /// Step with the pen down.
        pen_down: Option<StepSize>,
        /// Step with the pen up.
        pen_up: Option<StepSize>,
    },
    /// To be answered by `Reply::position`.
    Position,
    /// To be answered by `Reply::angles`.
    Angles,
    /// To be answered by `Reply::capabilities`.
    Capabilities,
    /// To be answered by `Reply::diagnostics`.
    Diagnostics,
    /// Make the place where the arm rests the calibration point.
    Calibrate,
    /// Remove the calibration.
    ClearCalibration,
    /// To be answered by `Reply::name`.
    Name,
    /// To be answered by `Reply::name`.
    Rename(MachineName),
    /// To be answered by `Reply::start`.
    Start,
    /// To be remembered, and answered by `Reply::ok`.
    SetStart {
        /// What the machine is after power-on.
        mode: Option<StartMode>,
        /// How its own network is called.
        name: Option<AccessPointName>,
    },
    /// To be answered by `Reply::own_network`.
    OwnNetwork,
    /// The password of the machine's own network, `None` for an open one; to be remembered, and answered by
    /// `Reply::ok`.
    ProtectOwnNetwork(Option<Password>),
    /// To be answered by `Reply::waves`.
    Waves,
    /// To be remembered, and answered by `Reply::ok`.
    SetWaves(bool),
    /// To be answered by `Reply::networks`.
    Networks,
    /// A station remembers the network and answers `Reply::ok`; in setup the answer comes first, and
    /// the network is remembered when it has been joined.
    Remember {
        /// The network's name.
        ssid: Ssid,
        /// Its password; without one, the one that is remembered, or none.
        password: Option<Password>,
    },
    /// To be forgotten, and answered by `Reply::ok`.
    Forget(Ssid),
    /// Every network is to be forgotten; answered by `Reply::ok`.
    ForgetAll,
    /// To be answered by `Reply::updated` when the new firmware is about to start, or by
    /// `Reply::error`.
    Update,
    /// To be remembered, and answered by `Reply::ok`.
    SetUpdateAddress(Option<ManifestAddress>),
    /// To be answered by `Reply::drawings`.
    Drawings,
    /// To be answered by `Reply::space`.
    Space,
    /// To be answered by `Reply::button`.
    Button,
    /// To be remembered, and answered by `Reply::ok`.
    SetButton(ButtonDraws),
    /// To be drawn from memory, and answered by `Reply::ok` when it begins.
    Draw(Slot),
    /// What is drawn from memory is to end, if anything is.
    StopDrawing,
    /// To be answered by `Reply::ok`, and `Session::record` told when that is possible.
    BeginRecording(Slot),
    /// `Session::recorded_line` is to be kept, and answered by `Reply::ok`.
    RecordLine,
    /// What was recorded is to become a drawing; `Session::record` is told. Comes when nothing is recorded
    /// as well.
    EndRecording,
    /// To be deleted, and answered by `Reply::ok`.
    Delete(Slot),
    /// To be answered by `Reply::replay`.
    Replaying,
    /// To be answered by `Reply::ok`.
    SetReplay(Option<Replay>),
    /// To be answered by `Reply::compensation`.
    Compensation,
    /// To be remembered, and answered by `Reply::ok`.
    SetCompensation {
        /// How high the paper lies.
        map: Option<ZMap>,
        /// How the nib moves as it comes down.
        shift: Option<NibShift>,
    },
    /// Everything is to be forgotten; answered by `Reply::ok`.
    FactoryReset,
    /// To be answered by `Reply::directions`.
    Directions,
    /// To be remembered, and answered by `Reply::ok`: whether shoulder, elbow and pen turn the other
    /// way.
    SetDirections([Option<bool>; 3]),
}

impl Request {
    /// Home (`spec 1.0.4a, G28`).
    pub(super) const HOME: Self = Self::Errand(Errand::Move(Manner::Straight, Target::HOME));
}
