//! A picture of what the servos did, as SVG or PNG: sheet, drawing area, ink, travel, limited points.
//!
//! Ink goes to the medium as it flows: SVG lines into a temporary file, PNG pixels into a bitmap, so
//! that memory does not grow with the drawing. Coordinates here are drawing units, x to the right and
//! y up, as seen from above with the body at the left.

use protocol_core::motion::{WideCoordinate, closest};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, Transform,
};

/// A point in drawing units.
pub type Point = (f64, f64);

/// The sheet: the drawing area with a margin, and the front of the body.
const LEFT: f64 = -260.0;
const RIGHT: f64 = 2050.0;
const TOP: f64 = 1680.0;
const BOTTOM: f64 = -1680.0;
/// The body seen from above (`reference/arm.md`, links).
const BODY: (Point, Point) = ((-251.0, -1356.0), (249.0, 564.0));
/// Width of the nib's line: 0.5 mm.
const INK_WIDTH: f64 = 10.0;
const TRAVEL_WIDTH: f64 = 2.0;
const LIMITED_RADIUS: f64 = 9.0;
/// Pixels a drawing unit of a PNG: 10 a millimetre.
const PIXELS: f64 = 0.5;

const PAPER: &str = "#fffdf7";
const OUTLINE: &str = "#b9c4cf";
const BODY_COLOUR: &str = "#e6e2d8";
const INK: &str = "#111111";
const TRAVEL: &str = "#a8d0e6";
const LIMITED: &str = "#e03131";

/// What a line on the picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trail {
    /// The pen was down.
    Ink,
    /// The pen was up.
    Travel,
}

/// The medium of a picture.
pub enum Canvas {
    /// Lines, for any size.
    Svg(Box<Svg>),
    /// Pixels.
    Png(Box<Png>),
}

impl Canvas {
    /// An empty sheet of the kind that the file's name asks for.
    ///
    /// # Errors
    /// When the name ends with neither `.svg` nor `.png`, or no temporary file can be made.
    pub fn for_file(path: &Path) -> io::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Ok(Self::Svg(Box::new(Svg::new()?))),
            Some("png") => Ok(Self::Png(Box::new(Png::new()?))),
            _ => Err(io::Error::other("a picture's name ends with .svg or .png")),
        }
    }

    /// A polyline.
    ///
    /// # Errors
    /// When the temporary file cannot be written.
    pub fn trail(&mut self, trail: Trail, points: &[Point]) -> io::Result<()> {
        match self {
            Self::Svg(svg) => svg.trail(trail, points),
            Self::Png(png) => {
                png.trail(trail, points);
                Ok(())
            }
        }
    }

    /// A point that is not where it was asked for.
    ///
    /// # Errors
    /// When the temporary file cannot be written.
    pub fn limited(&mut self, point: Point) -> io::Result<()> {
        match self {
            Self::Svg(svg) => svg.limited(point),
            Self::Png(png) => {
                png.limited(point);
                Ok(())
            }
        }
    }

    /// Writes the picture so far, at once or not at all.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&mut self, path: &Path) -> io::Result<()> {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
        match self {
            Self::Svg(svg) => svg.write(file.as_file_mut())?,
            Self::Png(png) => file.write_all(&png.0.encode_png().map_err(io::Error::other)?)?,
        }
        readable_by_all(file.as_file())?;
        file.persist(path).map(drop).map_err(|error| error.error)
    }
}

/// Temporary files are private; a picture is as readable as any file of its owner's.
#[cfg(unix)]
fn readable_by_all(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_all(_: &File) -> io::Result<()> {
    Ok(())
}

/// The outline of the drawing area, found by walking its edge as the core sees it.
fn outline() -> Vec<Point> {
    // From here every point of the area can be seen, but for those behind the step of the body.
    const EYE: Point = (1000.0, 0.0);
    // Corners would fall between two rays, so each gets its own.
    let corners = [
        (450.0, 1530.0),
        (650.0, -1580.0),
        (1320.0, 1460.0),
        (1320.0, -1460.0),
    ]
    .map(nearest);
    let mut rays: Vec<f64> = (-179..180)
        .map(|degrees| f64::from(degrees).to_radians())
        .collect();
    rays.extend(corners.map(|(x, y)| (y - EYE.1).atan2(x - EYE.0)));
    rays.sort_by(f64::total_cmp);
    let mut points: Vec<Point> = rays
        .into_iter()
        .map(|angle| {
            let at = |distance: f64| {
                (
                    EYE.0 + distance * angle.cos(),
                    EYE.1 + distance * angle.sin(),
                )
            };
            let (mut inside, mut outside) = (0.0, 3000.0);
            for _ in 0..30 {
                let middle = (inside + outside) / 2.0;
                if is_inside(at(middle)) {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            at(inside)
        })
        .collect();
    // Both corners of the step lie on one ray.
    points.insert(0, (700.0, 0.0));
    points.push((500.0, 0.0));
    points
}

fn nearest((x, y): Point) -> Point {
    let [x, y] = [x, y].map(|value| WideCoordinate::from_bits((value * 65536.0) as i64));
    let (x, y) = closest(x, y);
    (x.to_f64(), y.to_f64())
}

fn is_inside(point: Point) -> bool {
    let near = nearest(point);
    (near.0 - point.0).hypot(near.1 - point.1) < 0.001
}

/// A picture made of lines.
pub struct Svg {
    /// Elements so far.
    body: BufWriter<File>,
}

impl Svg {
    fn new() -> io::Result<Self> {
        Ok(Self {
            body: BufWriter::new(tempfile::tempfile()?),
        })
    }

    fn trail(&mut self, trail: Trail, points: &[Point]) -> io::Result<()> {
        let class = match trail {
            Trail::Ink => "ink",
            Trail::Travel => "travel",
        };
        write!(self.body, "<polyline class=\"{class}\" points=\"")?;
        for (x, y) in points {
            write!(self.body, "{x:.1},{y:.1} ")?;
        }
        writeln!(self.body, "\"/>")
    }

    fn limited(&mut self, (x, y): Point) -> io::Result<()> {
        writeln!(
            self.body,
            "<circle class=\"limited\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{LIMITED_RADIUS}\"/>"
        )
    }

    fn write(&mut self, file: &mut File) -> io::Result<()> {
        let (width, height) = (RIGHT - LEFT, TOP - BOTTOM);
        let mut out = BufWriter::new(file);
        writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{}mm\" viewBox=\"0 0 {width} {height}\">\n\
             <style>polyline{{fill:none;stroke-linecap:round;stroke-linejoin:round}}\
             .ink{{stroke:{INK};stroke-width:{INK_WIDTH}}}.travel{{stroke:{TRAVEL};stroke-width:{TRAVEL_WIDTH}}}\
             .limited{{fill:{LIMITED}}}.outline{{fill:none;stroke:{OUTLINE};stroke-width:3}}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{PAPER}\"/>\n\
             <g transform=\"translate({} {TOP}) scale(1 -1)\">",
            width / 20.0,
            height / 20.0,
            -LEFT,
        )?;
        let ((x1, y1), (x2, y2)) = BODY;
        writeln!(
            out,
            "<rect x=\"{x1}\" y=\"{y1}\" width=\"{}\" height=\"{}\" rx=\"60\" fill=\"{BODY_COLOUR}\"/>",
            x2 - x1,
            y2 - y1
        )?;
        write!(out, "<polygon class=\"outline\" points=\"")?;
        for (x, y) in outline() {
            write!(out, "{x:.1},{y:.1} ")?;
        }
        writeln!(out, "\"/>")?;
        self.body.flush()?;
        let body = self.body.get_mut();
        body.seek(SeekFrom::Start(0))?;
        io::copy(body, &mut out)?;
        writeln!(out, "</g></svg>")?;
        out.flush()
    }
}

/// A picture made of pixels.
pub struct Png(Pixmap);

impl Png {
    fn new() -> io::Result<Self> {
        let size = |length: f64| (length * PIXELS) as u32;
        let pixels = Pixmap::new(size(RIGHT - LEFT), size(TOP - BOTTOM));
        let mut png = Self(pixels.ok_or_else(|| io::Error::other("no memory for the picture"))?);
        png.0.fill(colour(PAPER));
        let ((x1, y1), (x2, y2)) = BODY;
        png.fill(BODY_COLOUR, &[(x1, y1), (x2, y1), (x2, y2), (x1, y2)]);
        let mut edge = outline();
        edge.extend(edge.first().copied());
        png.line(OUTLINE, 3.0, &edge);
        Ok(png)
    }

    fn trail(&mut self, trail: Trail, points: &[Point]) {
        match trail {
            Trail::Ink => self.line(INK, INK_WIDTH, points),
            Trail::Travel => self.line(TRAVEL, TRAVEL_WIDTH, points),
        }
    }

    fn limited(&mut self, (x, y): Point) {
        let mut dot = PathBuilder::new();
        dot.push_circle(x as f32, y as f32, LIMITED_RADIUS as f32);
        if let Some(dot) = dot.finish() {
            self.0
                .fill_path(&dot, &paint(LIMITED), FillRule::Winding, on_sheet(), None);
        }
    }

    fn line(&mut self, name: &str, width: f64, points: &[Point]) {
        let stroke = Stroke {
            width: width as f32,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        if let Some(path) = path(points) {
            self.0
                .stroke_path(&path, &paint(name), &stroke, on_sheet(), None);
        }
    }

    fn fill(&mut self, name: &str, points: &[Point]) {
        if let Some(path) = path(points) {
            self.0
                .fill_path(&path, &paint(name), FillRule::Winding, on_sheet(), None);
        }
    }
}

fn path(points: &[Point]) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    let (first, rest) = points.split_first()?;
    path.move_to(first.0 as f32, first.1 as f32);
    for (x, y) in rest {
        path.line_to(*x as f32, *y as f32);
    }
    path.finish()
}

fn on_sheet() -> Transform {
    let scale = PIXELS as f32;
    Transform::from_row(
        scale,
        0.0,
        0.0,
        -scale,
        -LEFT as f32 * scale,
        TOP as f32 * scale,
    )
}

fn paint(name: &str) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour(name));
    paint
}

/// `#rrggbb`.
fn colour(name: &str) -> Color {
    let value = u32::from_str_radix(name.trim_start_matches('#'), 16).unwrap_or(0);
    let [_, red, green, blue] = value.to_be_bytes();
    Color::from_rgba8(red, green, blue, 255)
}
