// Reach, placement, order, G-code and time.

import test from 'node:test';
import assert from 'node:assert/strict';
import { page } from './page.mjs';

const { inReach, lineInReach, joints, OUTLINE, parsePath, flatten, moveTime, largestRectangle, VIEWS, apply, invert, clip, order, measure,
  movesOf, gcodeOf, readGcode, inkOf, HOME } = page;

const HEIGHTS = { up: 1000, down: 0 }, SPEED = { down: 5, up: 15 };

/** Whether the arm can stand there, from its links: every servo angle is tried, not computed back. */
function reachBySearch([x, y]) {
  if (Math.hypot(x, y) > 1950 || x < (y >= 0 ? 500 : 700)) return false;
  let best = Infinity, at;
  const off = (s, e) => {
    const upper = (s - 45) * Math.PI / 180, fore = (45 - e) * Math.PI / 180;
    return Math.hypot(1000 * (Math.cos(upper) + Math.cos(fore)) - x, 1000 * (Math.sin(upper) + Math.sin(fore)) - y);
  };
  for (let s = -60; s < 240; s += 5) for (let e = -60; e < 240; e += 5) {
    // The elbow is on the left: upper link ahead of forearm.
    if (s - 45 < 45 - e) continue;
    if (off(s, e) < best) { best = off(s, e); at = [s, e]; }
  }
  for (let step = 4; step > 1e-7; step *= 0.7)
    for (const [ds, de] of [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]])
      if (off(at[0] + ds * step, at[1] + de * step) < best) { at = [at[0] + ds * step, at[1] + de * step]; best = off(...at); }
  return at[0] >= 10 && at[1] >= 10;
}

test('home has the angles of a real machine', () => {
  joints(...HOME).servos.forEach((angle, i) => assert.ok(Math.abs(angle - [135, 45, 135][i]) < 1e-9));
});

test('reach agrees with a search over the servos', () => {
  let inside = 0;
  for (let x = 300; x < 2100; x += 97) for (let y = -1700; y < 1750; y += 103) {
    assert.equal(inReach([x, y]), reachBySearch([x, y]), `(${x}, ${y})`);
    inside += inReach([x, y]);
  }
  assert.ok(inside > 100);
});

test('the outline that is shown is the edge of what is within reach', () => {
  const line = flatten(parsePath(OUTLINE)[0], 0.1);
  assert.ok(line.length > 50);
  for (const [x, y] of line) {
    const round = [...Array(24).keys()].map(i => inReach([x + 1.5 * Math.cos(i * Math.PI / 12), y + 1.5 * Math.sin(i * Math.PI / 12)]));
    assert.ok(round.includes(true) && round.includes(false), `(${x}, ${y})`);
  }
});

test('a line between two points within reach may leave it at the body', () => {
  assert.ok(!lineInReach([510, 300], [720, -300]));
  assert.ok(!lineInReach([720, -300], [510, 300]));
  assert.ok(lineInReach([710, 300], [720, -300]));
  assert.ok(!lineInReach([1000, 0], [2000, 0]));
});

test('moves take the time that the protocol says', () => {
  assert.equal(moveTime([0, 0, 0], [100, 100, 0], { down: 3, up: 15 }), 340);
  assert.equal(moveTime(HOME, [1000, 250, 1000], SPEED), 500);
  assert.equal(moveTime([0, 0, 0], [3.6, 0, 0], { down: 1.2, up: 15 }), 30);
  assert.equal(moveTime([0, 0, 0], [0, 0, 1000], SPEED), 670, 'the pen counts as up on the way up');
  assert.equal(moveTime(HOME, HOME, SPEED), 0);
  const fast = Object.assign([1000, 1000, 0], { fast: true });
  assert.equal(moveTime(HOME, fast, SPEED), 80, '45 degrees at 600 degrees a second');
});

test('the largest rectangle touches the edge, and no larger one is found by chance', () => {
  let seed = 7;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  for (const [width, height] of [[100, 100], [300, 100], [100, 300], [1, 1000]]) for (const view of Object.values(VIEWS)) {
    const margin = 20, { scale, centre } = largestRectangle(width, height, margin, view), back = invert(view);
    const fits = (cx, cy, s) => {
      // All along its sides, not only at its corners.
      for (let i = 0; i <= 20; i++) for (const k of [-1, 1]) {
        const w = width * s / 2 + margin, h = height * s / 2 + margin, t = i / 10 - 1;
        if (![[t * w, k * h], [k * w, t * h]].every(([dx, dy]) => inReach(apply(back, [cx + dx, cy + dy])))) return false;
      }
      return true;
    };
    assert.ok(fits(...centre, scale * 0.9999), `${width} x ${height}`);
    for (let i = 0; i < 4000; i++) {
      const place = apply(view, [500 + random() * 1450, random() * 3200 - 1600]);
      assert.ok(!fits(...place, scale * 1.005), `${width} x ${height}: ${place} has room for more than ${scale}`);
    }
  }
});

test('strokes are cut at the edge, and points beyond it are counted', () => {
  const { strokes, outside } = clip([[[1000, 0], [2500, 0], [1000, 500]], [[1200, 0], [1300, 0]]]);
  assert.equal(outside, 1);
  assert.equal(strokes.length, 3);
  assert.ok(Math.abs(strokes[0].at(-1)[0] - 1950) < 0.01);
  assert.ok(Math.abs(Math.hypot(...strokes[1][0]) - 1950) < 0.01);
  for (const p of strokes.flat()) assert.ok(inReach(p), `${p}`);
  const across = clip([[[-3000, 900], [3000, 900]]]);
  assert.equal(across.outside, 2);
  assert.ok(Math.abs(across.strokes[0][0][0] - 500) < 0.01 && across.strokes[0][1][0] > 1700, 'a line may cross the area and end outside at both ends');
  const notch = clip([[[510, 300], [720, -300]]]);
  assert.equal(notch.outside, 0);
  assert.equal(notch.cut, 1);
  assert.deepEqual(notch.strokes.map(stroke => stroke.map(p => p.map(Math.round))), [[[510, 300], [615, 0]], [[700, -243], [720, -300]]]);
});

/** Length of all ways with the pen up, in the metric that costs time. */
const travel = strokes => strokes.reduce(([sum, at], stroke) =>
  [sum + Math.max(Math.abs(stroke[0][0] - at[0]), Math.abs(stroke[0][1] - at[1])), stroke.at(-1)], [0, HOME])[0];

test('ordering keeps all ink and shortens the way', () => {
  let seed = 3;
  const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  const strokes = [...Array(200)].map(() => [...Array(3)].map(() => [700 + random() * 800, random() * 1600 - 800]));
  const sorted = order(strokes);
  const lines = all => all.flatMap(stroke => stroke.slice(1).map((p, i) => [stroke[i], p].map(q => q.map(v => v.toFixed(3)).join()).sort().join(' '))).sort();
  assert.deepEqual(lines(sorted), lines(strokes));
  assert.ok(travel(sorted) < travel(strokes) / 3, `${travel(sorted)} of ${travel(strokes)}`);
});

test('few strokes are ordered nearly as well as by trying everything', () => {
  const strokes = [[[900, 0], [900, 100]], [[1500, 50], [1400, 50]], [[1000, 800], [1000, 700]], [[950, 300], [960, 500]]];
  const best = rest => rest.length === 0 ? [[]] : rest.flatMap((one, i) => [one, one.slice().reverse()]
    .flatMap(way => best(rest.filter((_, k) => k !== i)).map(tail => [way, ...tail])));
  const least = Math.min(...best(strokes).map(travel));
  assert.ok(travel(order(strokes)) <= least * 1.1, `${travel(order(strokes))}, ${least} is possible`);
});

test('strokes that meet are drawn without lifting the pen, closed ones from their nearest corner', () => {
  assert.deepEqual(order([[[1000, 500], [1000, 600]], [[1200, 600], [1000, 600]]]).length, 1);
  const [square] = order([[[800, 0], [900, 0], [900, 100], [800, 100], [800, 0]]]);
  assert.deepEqual(square[0], [900, 100]);
  assert.deepEqual(square.at(-1), [900, 100]);
  assert.equal(square.length, 5);
});

test('single lines that make a figure become one stroke, whatever their order and direction', () => {
  const corners = [...Array(6).keys()].map(i => [1200 + 300 * Math.cos(i * Math.PI / 3), 300 * Math.sin(i * Math.PI / 3)]);
  const sides = corners.map((p, i) => [p, corners[(i + 1) % 6]]);
  const mixed = [sides[3], sides[0].slice().reverse(), sides[5], sides[1], sides[4].slice().reverse(), sides[2]];
  const drawn = order(mixed);
  assert.equal(drawn.length, 1);
  assert.equal(drawn[0].length, 7);
});

test('G-code of strokes draws them', () => {
  const strokes = [[[1000, 0], [1100.04, 0], [1100.04, 0.01]], [[900, 900]]];
  const gcode = gcodeOf(movesOf(strokes, HEIGHTS), HEIGHTS);
  assert.deepEqual(gcode.split('\n'), ['G1 Z1000', 'G1 X1000 Y0', 'G1 Z0', 'G1 X1100 Y0', 'G1 Z1000', 'G1 X900 Y900', 'G1 Z0', 'G1 Z1000', 'G28', '']);
  assert.deepEqual(inkOf(readGcode(gcode).moves), [[[1000, 0], [1100, 0]], [[900, 900]]]);
});

test('the first line lifts the pen before anything moves', () => {
  assert.match(gcodeOf(movesOf([[[1000, 0]]], { up: 700, down: 100 }), { up: 700, down: 100 }), /^G1 Z700\nG1 X1000 Y0\nG1 Z100\nG1 Z700\nG28\n$/);
});

test('lengths and times of a drawing', () => {
  const moves = movesOf([[[1000, 0], [1500, 0]]], HEIGHTS);
  const { ink, travel, time, strokes } = measure(moves, SPEED);
  assert.equal(strokes, 1);
  assert.equal(ink, 500);
  assert.ok(Math.abs(travel - 1000 - Math.hypot(500, 1000)) < 1e-9);
  // 1000 units over, 1000 down, 500 along, 1000 up, 1000 home.
  assert.equal(time, 670 + 670 + 1000 + 670 + 670);
});

test('G-code is read as the arm reads it, and keeps to what belongs in a drawing', () => {
  const { lines, moves, problems } = readGcode('G54 X100 Y0 S2.5\ng01x200 y100 (there) z-5;down\n\nG28\nG4 P5\nM550 Probs\nG94 S2\r\nG00 X1.5e2');
  assert.deepEqual(moves.map(([...move]) => move), [[600, 250, 0], HOME, [475, 1000, 1000]]);
  assert.deepEqual(lines, ['G54 X100 Y0 S2.5', 'G01X200 Y100   Z-5', 'G28', 'G94 S2', 'G00 X1.5E2']);
  assert.deepEqual(moves.map(move => move.line), [2, 3, 5]);
  assert.deepEqual(moves.map(move => [move.fast, move.speed.down]), [[false, undefined], [undefined, undefined], [true, 2]]);
  assert.deepEqual(problems, [{ line: 5, text: 'G4 P5' }, { line: 6, text: 'M550 Probs' }]);
});

test('the speed that G-code sets counts from there on', () => {
  const { moves } = readGcode('G1 Z0\nG1 X1100\nG94 S2 P100\nG1 X1200\nG1 Z1000');
  assert.equal(measure(moves, SPEED).time, 670 + 200 + 500 + 100);
});
