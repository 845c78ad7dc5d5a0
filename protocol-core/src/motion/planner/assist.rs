//! Switched outputs, each at its place in the plan.

/// A plotter's switched outputs (`spec lasaurgrbl, M80 to M85`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assist {
    /// M80 on, M81 off.
    Air,
    /// M82 on, M83 off.
    Aux1,
    /// M84 on, M85 off.
    Aux2,
}

impl Assist {
    /// All of them, in the order of [`Outputs`].
    pub const ALL: [Self; 3] = [Self::Air, Self::Aux1, Self::Aux2];
}

/// Whether air, aux1 and aux2 are on.
pub type Outputs = [bool; 3];

/// Outputs to be switched at some moment; what is `None` stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Switches([Option<bool>; 3]);

impl Switches {
    pub(super) const fn set(&mut self, assist: Assist, on: bool) {
        let [air, aux1, aux2] = &mut self.0;
        *match assist {
            Assist::Air => air,
            Assist::Aux1 => aux1,
            Assist::Aux2 => aux2,
        } = Some(on);
    }

    /// The outputs after it; there is nothing left to switch then.
    pub(super) fn switch(&mut self, outputs: &mut Outputs) {
        let switches = core::mem::take(&mut self.0);
        for (output, switch) in outputs.iter_mut().zip(switches) {
            *output = switch.unwrap_or(*output);
        }
    }
}
