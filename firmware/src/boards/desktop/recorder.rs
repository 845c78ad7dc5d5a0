//! What the servos did: a trace, a picture and totals, made in a thread of their own so that no file
//! delays a set-point.

use super::canvas::{Canvas, Point, Trail};
use super::clock;
use crate::board::Servos;
use crate::services::arm::Arm;
use protocol_core::arm::Compensation;
use protocol_core::machine::{ArmData, SetPoint, nib_of};
use protocol_core::motion::{Micros, PulseWidth};
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Frames that may wait for the recorder: minutes in real time; in virtual time the arm waits when the
/// disk cannot follow.
const BACKLOG: usize = 1 << 14;
/// A picture is rewritten when the arm comes to rest, but not more often than this.
const REWRITE: Duration = Duration::from_millis(200);
/// A drawing is finished when the arm has rested this long with the pen up.
const FINISHED_AFTER: Micros = Micros::from_secs(1);
/// Points closer than this to the straight line are not worth keeping, in drawing units.
const STRAIGHT: f64 = 0.05;
/// Longest polyline; memory does not grow with a stroke either.
const MAX_POINTS: usize = 1000;
/// Bytes that no row of a trace has.
const LONGEST_ROW: u64 = 256;
/// Drawing units in a millimetre.
const UNITS_PER_MM: f64 = 20.0;

/// Where recordings go.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// One row for each frame of the moving arm.
    pub trace: Option<PathBuf>,
    /// SVG or PNG.
    pub picture: Option<PathBuf>,
    /// The firmware was started again, by itself: the trace goes on, and an older picture stays until the arm
    /// moves.
    pub go_on: bool,
}

/// What the arm did in all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Times the pen came down.
    pub strokes: u32,
    /// Way with the pen down, in millimetres.
    pub pen_down_mm: f64,
    /// Way with the pen up, in millimetres.
    pub pen_up_mm: f64,
    /// Time in motion.
    pub moving: Duration,
}

impl Totals {
    fn since(&self, earlier: &Self) -> Self {
        Self {
            strokes: self.strokes - earlier.strokes,
            pen_down_mm: self.pen_down_mm - earlier.pen_down_mm,
            pen_up_mm: self.pen_up_mm - earlier.pen_up_mm,
            moving: self.moving - earlier.moving,
        }
    }
}

enum Entry {
    Frame(Micros, SetPoint, Compensation),
    End,
}

/// Servos that hand every frame to the recorder.
pub struct RecordedServos {
    entries: SyncSender<Entry>,
    /// Whether time may jump is up to the arm's motion here.
    hurry_while_moving: bool,
    /// Whose paper and lift the picture knows.
    arm: Option<&'static Arm>,
}

impl RecordedServos {
    /// The servos of this arm: what the paper and the lift make of the pulses is drawn.
    #[must_use]
    pub fn of(self, arm: &'static Arm) -> Self {
        Self {
            arm: Some(arm),
            ..self
        }
    }
}

impl Servos for RecordedServos {
    fn write(&mut self, time: Micros, set_point: &SetPoint) {
        if self.hurry_while_moving {
            clock::hurry(set_point.moving);
        }
        // A recorder that has ended, because the program does, needs no more frames.
        let compensation = self
            .arm
            .map(|arm| arm.with(|machine| *machine.compensation()));
        let compensation = compensation.unwrap_or_default();
        let _ = self
            .entries
            .send(Entry::Frame(time, *set_point, compensation));
    }
}

/// The recorder's thread.
pub struct Recorder {
    thread: JoinHandle<io::Result<Totals>>,
    entries: SyncSender<Entry>,
}

impl Recorder {
    /// Starts it, and gives the servos to record.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn start(
        outputs: Outputs,
        data: ArmData,
        hurry_while_moving: bool,
    ) -> io::Result<(Self, RecordedServos)> {
        let recording = Recording::new(outputs, data)?;
        let (entries, receiver) = sync_channel(BACKLOG);
        let thread = thread::spawn(move || recording.run(&receiver));
        let servos = RecordedServos {
            entries: entries.clone(),
            hurry_while_moving,
            arm: None,
        };
        Ok((Self { thread, entries }, servos))
    }

    /// Ends the recording with the frames so far, and waits until everything is written.
    ///
    /// # Errors
    /// When a file could not be written.
    pub fn finish(self) -> io::Result<Totals> {
        // A thread that has failed already tells why below.
        let _ = self.entries.send(Entry::End);
        self.thread
            .join()
            .unwrap_or_else(|_| Err(io::Error::other("the recorder failed")))
    }
}

struct Recording {
    data: ArmData,
    trace: Option<BufWriter<File>>,
    picture: Option<(PathBuf, Canvas)>,
    pen: Pen,
    totals: Totals,
    /// Totals when the last drawing was finished.
    reported: Totals,
    /// A frame at rest that has not been written.
    skipped: Option<(Micros, SetPoint)>,
    /// What the plotter's outputs are said to be.
    switched: [bool; 3],
    last_moving: Micros,
    /// The picture is an earlier one, and nothing has been drawn since.
    keep_picture: bool,
    unsaved: bool,
    saved: Instant,
    /// That files cannot be written has been told.
    told: bool,
}

impl Recording {
    fn new(outputs: Outputs, data: ArmData) -> io::Result<Self> {
        let naming = |path: &Path, error: io::Error| {
            io::Error::new(error.kind(), format!("{}: {error}", path.display()))
        };
        let trace = outputs.trace.map(|path| {
            let opened = match outputs.go_on {
                true => open_again(&path),
                false => File::create(&path),
            };
            let mut file = BufWriter::new(opened.map_err(|error| naming(&path, error))?);
            if file.get_ref().metadata()?.len() == 0 {
                writeln!(file, "time_us,x,y,z,shoulder_us,elbow_us,pen_us")?;
            }
            Ok::<_, io::Error>(file)
        });
        let picture = outputs.picture.map(|path| {
            let mut canvas = Canvas::for_file(&path).map_err(|error| naming(&path, error))?;
            if !outputs.go_on {
                canvas.save(&path).map_err(|error| naming(&path, error))?;
            }
            Ok::<_, io::Error>((path, canvas))
        });
        Ok(Self {
            data,
            trace: trace.transpose()?,
            picture: picture.transpose()?,
            pen: Pen::default(),
            totals: Totals::default(),
            reported: Totals::default(),
            skipped: None,
            switched: [false; 3],
            last_moving: Micros::default(),
            keep_picture: outputs.go_on,
            unsaved: false,
            saved: Instant::now(),
            told: false,
        })
    }

    fn run(mut self, entries: &Receiver<Entry>) -> io::Result<Totals> {
        let mut previous = None;
        while let Ok(Entry::Frame(time, set_point, compensation)) = entries.recv() {
            if set_point.moving {
                let frame = time - previous.unwrap_or(time);
                self.totals.moving += Duration::from_micros(frame.get());
                self.keep_picture = false;
            }
            let written = if set_point.moving || previous.is_none() {
                self.moving(time, &set_point, &compensation)
            } else {
                self.resting(time, set_point)
            };
            self.note(written);
            self.tell_outputs(set_point.outputs);
            previous = Some(time);
        }
        self.save()?;
        Ok(self.totals)
    }

    fn tell_outputs(&mut self, outputs: [bool; 3]) {
        let names = ["air assist", "aux1", "aux2"];
        for ((name, now), before) in names.iter().zip(outputs).zip(&mut self.switched) {
            if *before != now {
                log::info!("{name} is {}", if now { "on" } else { "off" });
                *before = now;
            }
        }
    }

    /// The arm draws on without a file; it is tried again when it rests, and told once.
    fn note(&mut self, written: io::Result<()>) {
        match written {
            Ok(()) => {}
            Err(error) if self.told => drop(error),
            Err(error) => {
                log::error!("the picture or the trace cannot be written: {error}");
                self.told = true;
            }
        }
    }

    fn moving(
        &mut self,
        time: Micros,
        set_point: &SetPoint,
        compensation: &Compensation,
    ) -> io::Result<()> {
        // Where the motion began.
        if let Some((time, set_point)) = self.skipped.take() {
            self.row(time, &set_point)?;
        }
        self.row(time, set_point)?;
        self.last_moving = time;

        let place = nib_of(set_point.pulses, &self.data, compensation);
        let point = (place.x.to_f64(), place.y.to_f64());
        let trail = if place.pen_is_down() {
            Trail::Ink
        } else {
            Trail::Travel
        };
        let way = self.pen.distance(point) / UNITS_PER_MM;
        if self.pen.trail == Trail::Ink && trail == Trail::Ink {
            self.totals.pen_down_mm += way;
        } else {
            self.totals.pen_up_mm += way;
        }
        self.totals.strokes += u32::from(trail == Trail::Ink && self.pen.trail == Trail::Travel);
        let canvas = self.picture.as_mut().map(|(_, canvas)| canvas);
        self.pen.go(trail, point, set_point.held, canvas)?;
        self.unsaved = true;
        Ok(())
    }

    fn resting(&mut self, time: Micros, set_point: SetPoint) -> io::Result<()> {
        self.skipped = Some((time, set_point));
        if self.unsaved && self.saved.elapsed() >= REWRITE {
            self.save()?;
        }
        let drawn = self.totals.since(&self.reported);
        let finished = time - self.last_moving >= FINISHED_AFTER && self.pen.trail == Trail::Travel;
        if drawn.strokes > 0 && finished {
            self.reported = self.totals;
            log::info!(
                "drawing finished: {} stroke(s), {:.0} mm of ink, {:.0} mm of travel, {:.1} s in motion",
                drawn.strokes,
                drawn.pen_down_mm,
                drawn.pen_up_mm,
                drawn.moving.as_secs_f64()
            );
        }
        Ok(())
    }

    fn row(&mut self, time: Micros, set_point: &SetPoint) -> io::Result<()> {
        let Some(trace) = &mut self.trace else {
            return Ok(());
        };
        let position = set_point.position;
        let (x, y, z) = (
            position.x.to_f64(),
            position.y.to_f64(),
            position.z.to_f64(),
        );
        write!(trace, "{},{x:.3},{y:.3},{z:.3}", time.get())?;
        for pulse in set_point.pulses {
            let unit = PulseWidth::PER_MICROSECOND;
            write!(trace, ",{}.{:04}", pulse.get() / unit, pulse.get() % unit)?;
        }
        writeln!(trace)
    }

    fn save(&mut self) -> io::Result<()> {
        self.saved = Instant::now();
        if let Some(trace) = &mut self.trace {
            trace.flush()?;
        }
        if let Some((path, canvas)) = &mut self.picture
            && !self.keep_picture
        {
            self.pen.flush(canvas)?;
            canvas.save(path)?;
        }
        self.unsaved = false;
        self.told = false;
        Ok(())
    }
}

/// A trace to go on with, without a last row that is torn.
fn open_again(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).append(true).create(true);
    let mut file = options.open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LONGEST_ROW)))?;
    let mut end = Vec::new();
    file.read_to_end(&mut end)?;
    let torn = end.iter().rev().take_while(|byte| **byte != b'\n').count();
    file.set_len(length - torn as u64)?;
    Ok(file)
}

/// The nib on the picture: collects points into polylines.
struct Pen {
    trail: Trail,
    points: Vec<Point>,
    marked: Option<Point>,
}

impl Default for Pen {
    fn default() -> Self {
        Self {
            trail: Trail::Travel,
            points: Vec::new(),
            marked: None,
        }
    }
}

impl Pen {
    fn distance(&self, to: Point) -> f64 {
        self.points
            .last()
            .map_or(0.0, |from| (to.0 - from.0).hypot(to.1 - from.1))
    }

    fn go(
        &mut self,
        trail: Trail,
        to: Point,
        limited: bool,
        canvas: Option<&mut Canvas>,
    ) -> io::Result<()> {
        let Some(canvas) = canvas else {
            self.trail = trail;
            self.points = vec![to];
            return Ok(());
        };
        if trail != self.trail || self.points.len() >= MAX_POINTS {
            self.points.push(to);
            self.flush(canvas)?;
            self.trail = trail;
        }
        if let [.., a, b] = self.points.as_mut_slice()
            && is_between(*a, *b, to)
        {
            *b = to;
        } else {
            self.points.push(to);
        }
        if limited && self.marked != Some(to) {
            canvas.limited(to)?;
            self.marked = Some(to);
        }
        Ok(())
    }

    /// Puts the polyline onto the canvas, and goes on from its end.
    fn flush(&mut self, canvas: &mut Canvas) -> io::Result<()> {
        let Some(&end) = self.points.last() else {
            return Ok(());
        };
        if self.points.len() > 1 {
            canvas.trail(self.trail, &self.points)?;
        }
        self.points = vec![end];
        Ok(())
    }
}

/// Whether `b` lies on the straight way from `a` to `c`.
fn is_between(a: Point, b: Point, c: Point) -> bool {
    let (ab, ac) = ((b.0 - a.0, b.1 - a.1), (c.0 - a.0, c.1 - a.1));
    let length = ac.0.hypot(ac.1);
    let aside = (ab.0 * ac.1 - ab.1 * ac.0).abs();
    let along = ab.0 * ac.0 + ab.1 * ac.1;
    aside <= STRAIGHT * length && along >= 0.0 && along <= length * length
}
