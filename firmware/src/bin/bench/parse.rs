//! A command out of text, with the two parsers that a user would take from crates.io.

use core::{
    convert::Infallible,
    future::Future,
    pin::pin,
    task::{Context, Poll, Waker},
};

use async_gcode::{GCode, Literal, Parser, RealValue};
use gcode::core::{
    BlockVisitor, CommandVisitor, ControlFlow, Diagnostics, HasDiagnostics, Noop, Number,
    ProgramVisitor, Span, Value,
};

/// G number and x, y, z.
pub type Move = (u32, [f32; 3]);

/// With `gcode`'s visitor interface, which does not allocate.
pub fn with_gcode(text: &&str) -> Option<Move> {
    let mut found = Collector {
        result: None,
        noop: Noop,
    };
    gcode::core::parse(text, &mut found);
    found.result
}

struct Collector {
    result: Option<Move>,
    noop: Noop,
}

struct Part<'a>(&'a mut Collector);

impl HasDiagnostics for Collector {
    fn diagnostics(&mut self) -> &mut dyn Diagnostics {
        &mut self.noop
    }
}

impl HasDiagnostics for Part<'_> {
    fn diagnostics(&mut self) -> &mut dyn Diagnostics {
        &mut self.0.noop
    }
}

impl ProgramVisitor for Collector {
    fn start_block(&mut self) -> ControlFlow<impl BlockVisitor + '_> {
        ControlFlow::Continue(Part(self))
    }
}

impl BlockVisitor for Part<'_> {
    fn start_general_code(&mut self, number: Number) -> ControlFlow<impl CommandVisitor + '_> {
        self.0.result = Some((number.major(), [0.0; 3]));
        ControlFlow::Continue(Part(self.0))
    }
}

impl CommandVisitor for Part<'_> {
    fn argument(&mut self, letter: char, value: Value<'_>, _span: Span) {
        if let (Some((_, axes)), Value::Literal(value)) = (&mut self.0.result, value)
            && let Some(axis) = axis(letter)
        {
            axes[axis] = value;
        }
    }
}

fn axis(letter: char) -> Option<usize> {
    match letter.to_ascii_lowercase() {
        'x' => Some(0),
        'y' => Some(1),
        'z' => Some(2),
        _ => None,
    }
}

/// Error of a parser whose input cannot fail.
struct Refused;

impl From<async_gcode::Error> for Refused {
    fn from(_: async_gcode::Error) -> Self {
        Self
    }
}

impl From<Infallible> for Refused {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

/// With `async-gcode`, polled on input that is all there.
pub fn with_async_gcode(text: &&str) -> Option<Move> {
    let bytes = text.bytes().map(Ok::<u8, Refused>);
    let mut parser = Parser::new(futures::stream::iter(bytes));
    let (mut number, mut axes) = (None, [0.0; 3]);
    let mut cx = Context::from_waker(Waker::noop());
    loop {
        match pin!(parser.next()).poll(&mut cx) {
            Poll::Ready(Some(Ok(GCode::Word(
                letter,
                RealValue::Literal(Literal::RealNumber(value)),
            )))) => match axis(letter) {
                Some(axis) => axes[axis] = value as f32,
                None => number = Some(value as u32),
            },
            Poll::Ready(Some(Ok(GCode::Execute))) => return Some((number?, axes)),
            Poll::Ready(Some(Ok(_))) => {}
            _ => return None,
        }
    }
}
