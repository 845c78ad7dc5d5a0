// Paths and transforms, against computations of their own: de Casteljau's, the equation of the ellipse, plain trigonometry.

import test from 'node:test';
import assert from 'node:assert/strict';
import { page } from './page.mjs';

const { parsePath, flatten, arcParts, parseTransform, apply, multiply, invert, svgLength, transformPiece } = page;

/** A point of a cubic by repeated halving of its polygon (de Casteljau), not by its polynomial. */
function casteljau(points, t) {
  while (points.length > 1) points = points.slice(1).map((p, i) => [0, 1].map(k => points[i][k] * (1 - t) + p[k] * t));
  return points[0];
}

const gap = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** Distance of a point from a polyline. */
function distance(p, line) {
  let least = line.length === 1 ? gap(p, line[0]) : Infinity;
  for (let i = 1; i < line.length; i++) {
    const [a, b] = [line[i - 1], line[i]];
    const length = gap(a, b) ** 2;
    const t = length ? Math.min(1, Math.max(0, ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / length)) : 0;
    least = Math.min(least, gap(p, [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]));
  }
  return least;
}

/** Numbers that look random and are the same every time. */
function numbers(seed) {
  return () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
}

test('a path of straight lines has its corners, relative or not', () => {
  const corners = [[10, 10], [30, 10], [30, 40], [10, 40], [10, 10]];
  for (const d of ['M10 10L30 10L30 40L10 40Z', 'm10,10 20,0 0,30 -20,0z', 'M10 10H30V40H10z', 'm10 10h20v30h-20z', 'M10,10 30,10 30,40 10,40 Z'])
    assert.deepEqual(parsePath(d).map(piece => flatten(piece, 1)), [corners], d);
});

test('numbers need no blanks between them', () => {
  assert.deepEqual(parsePath('M-1.5.5-2e1.25')[0]?.parts, [[-20, 0.25]]);
  assert.deepEqual(parsePath('M0 0l.5.5+1-1')[0].parts, [[0.5, 0.5], [1.5, -0.5]]);
  const [spread] = parsePath('M0 0a25 20 -30 0 1 50 -25'), [dense] = parsePath('M0,0a25,20-30 0150-25');
  assert.deepEqual(dense, spread);
});

test('a figure that goes on after its end begins where it began', () => {
  assert.deepEqual(parsePath('M1 2L5 2L5 6Zl1 1').map(piece => [piece.start, piece.closed]), [[[1, 2], true], [[1, 2], false]]);
});

test('a faulty path is drawn up to its fault', () => {
  assert.deepEqual(parsePath('M0 0L10 0L20'), [{ start: [0, 0], parts: [[10, 0]], closed: false }]);
  assert.deepEqual(parsePath('M0 0L10 0 ! L20 20')[0].parts, [[10, 0]]);
  for (const d of ['', 'L10 10', 'M', 'M5', 'none', 'M1 1']) assert.deepEqual(parsePath(d), [], d);
});

test('every point of a curve is within the tolerance of its line, and every corner of the line on the curve', () => {
  const random = numbers(1);
  for (let i = 0; i < 300; i++) {
    const polygon = [0, 1, 2, 3].map(() => [random() * 2000, random() * 2000]);
    const tolerance = 0.05 + random() * 5;
    const d = `M${polygon[0]}C${polygon.slice(1).join(' ')}`;
    const line = flatten(parsePath(d)[0], tolerance);
    const curve = [...Array(401).keys()].map(k => casteljau(polygon, k / 400));
    for (const p of curve) assert.ok(distance(p, line) <= tolerance + 1e-6, `${d}: ${distance(p, line)} > ${tolerance}`);
    for (const p of line) assert.ok(distance(p, curve) < 0.6, `${d}: ${p} is beside the curve`);
  }
});

test('smooth and quadratic curves are the cubic ones they stand for', () => {
  const same = (d, cubic) => {
    const [a, b] = [d, cubic].map(text => parsePath(text)[0].parts.flat());
    assert.equal(a.length, b.length, d);
    a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) < 1e-9, `${d}: ${a}, not ${b}`));
  };
  same('M0 0C1 2 3 4 5 5S9 6 10 5', 'M0 0C1 2 3 4 5 5C7 6 9 6 10 5');
  same('M0 0c1 2 3 4 5 5s4 1 5 0', 'M0 0C1 2 3 4 5 5C7 6 9 6 10 5');
  same('M0 0S3 4 5 5', 'M0 0C0 0 3 4 5 5');
  same('M0 0Q3 6 6 0', 'M0 0C2 4 4 4 6 0');
  same('M0 0Q3 6 6 0T12 0', 'M0 0C2 4 4 4 6 0C8 -4 10 -4 12 0');
  same('M0 0T6 0', 'M0 0C0 0 2 0 6 0');
});

test('arcs lie on their ellipse, end where they should and go the way they should', () => {
  const random = numbers(2);
  for (let i = 0; i < 500; i++) {
    // An ellipse and two angles first; the arc's flags follow from them.
    const [cx, cy, rx, ry] = [random() * 100, random() * 100, 1 + random() * 90, 1 + random() * 90];
    const turn = random() * 360, from = random() * 2 * Math.PI, way = (random() * 1.98 - 0.99) * 2 * Math.PI;
    if (Math.abs(Math.abs(way) - Math.PI) < 0.05 || Math.abs(way) < 0.05) continue;
    const c = Math.cos(turn * Math.PI / 180), s = Math.sin(turn * Math.PI / 180);
    const place = angle => [cx + c * rx * Math.cos(angle) - s * ry * Math.sin(angle), cy + s * rx * Math.cos(angle) + c * ry * Math.sin(angle)];
    const start = place(from), end = place(from + way);
    const parts = arcParts(...start, rx, ry, turn, +(Math.abs(way) > Math.PI), +(way > 0), ...end);
    const line = flatten({ start, parts, closed: false }, 0.001);
    for (const [x, y] of line) {
      const u = (c * (x - cx) + s * (y - cy)) / rx, v = (c * (y - cy) - s * (x - cx)) / ry;
      assert.ok(Math.abs(Math.hypot(u, v) - 1) < 2e-5, `off the ellipse by ${Math.hypot(u, v) - 1}`);
    }
    for (let k = 0; k <= 20; k++) assert.ok(distance(place(from + way * k / 20), line) < 0.01, 'the way round is another');
    assert.deepEqual(line.at(-1), end);
  }
});

test('an arc that cannot reach its end grows, one without a radius is a line, one without a way is nothing', () => {
  const line = flatten(parsePath('M0 0A1 1 0 0 1 10 0')[0], 0.001);
  for (const p of line) assert.ok(Math.abs(gap(p, [5, 0]) - 5) < 1e-4, `${p}`);
  assert.ok(line.some(p => p[1] < -4.9), 'swept clockwise on the screen means above');
  assert.deepEqual(parsePath('M0 0A0 5 0 0 1 10 0')[0].parts, [[10, 0]]);
  assert.deepEqual(parsePath('M3 3A5 5 0 1 1 3 3'), []);
});

test('transforms do what their names say, the last one first', () => {
  const near = (text, point, want) => assert.ok(gap(apply(parseTransform(text), point), want) < 1e-9, `${text}: ${apply(parseTransform(text), point)}`);
  near('translate(10)', [1, 2], [11, 2]);
  near('translate(10 -5)', [1, 2], [11, -3]);
  near('scale(2)', [1, 2], [2, 4]);
  near('scale(2,-1)', [1, 2], [2, -2]);
  near('rotate(90)', [1, 0], [0, 1]);
  near('rotate(90, 10, 10)', [11, 10], [10, 11]);
  near('skewX(45)', [0, 3], [3, 3]);
  near('skewY(45)', [3, 0], [3, 3]);
  near('matrix(1 2 3 4 5 6)', [1, 1], [9, 12]);
  near('translate(10,0) rotate(90) , scale(2)', [1, 0], [10, 2]);
  near('', [1, 2], [1, 2]);
  near('nonsense(4) scale()', [1, 2], [1, 2]);
  const m = parseTransform('rotate(33) skewX(10) translate(4 5) scale(3 0.5)');
  assert.ok(gap(apply(multiply(m, invert(m)), [7, 8]), [7, 8]) < 1e-9);
});

test('transformed curves are the curves of transformed points', () => {
  const piece = parsePath('M0 0C10 40 60 -40 70 10A20 30 20 1 0 90 90')[0];
  const m = parseTransform('rotate(30) scale(2 0.7) skewX(20)');
  const after = flatten(transformPiece(piece, m), 0.01), before = flatten(piece, 0.001).map(p => apply(m, p));
  for (const p of before) assert.ok(distance(p, after) < 0.02);
});

test('lengths have the units of CSS', () => {
  for (const [text, pixels] of [['10', 10], ['10px', 10], ['1in', 96], ['25.4mm', 96], ['2.54cm', 96], ['72pt', 96], ['6pc', 96], ['50%', 100], [' 1e1 ', 10]])
    assert.ok(Math.abs(svgLength(text, 200) - pixels) < 1e-9, text);
  for (const text of [null, '', 'auto', '1 2', '3parsec']) assert.equal(svgLength(text, 200), undefined, text);
});
