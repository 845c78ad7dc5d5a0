// From a file to ink.

import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { file, open, says } from './arm.mjs';
import { distance, length } from './lines.mjs';

const UNITS_PER_MM = 20;
/** Every kind of shape, nested transforms, and millimetres: 60 x 42 of them. */
const SHAPES = readFileSync(new URL('shapes.svg', import.meta.url), 'utf8');

/** Where the browser itself draws the shapes of an SVG, in millimetres. */
async function rendered(page, svg) {
  const other = await page.context().newPage();
  await other.setContent(`<!doctype html><style>body{margin:0}svg{display:block}</style>${svg}`);
  const lines = await other.evaluate(() => [...document.querySelectorAll('path, rect, circle, ellipse, line, polyline, polygon')].map(shape => {
    const whole = shape.getTotalLength(), matrix = shape.getScreenCTM();
    return [...Array(1001).keys()].map(i => {
      const { x, y } = shape.getPointAtLength(whole * i / 1000).matrixTransform(matrix);
      return [x * 25.4 / 96, y * 25.4 / 96];
    });
  }));
  await other.close();
  return lines;
}

const box = points => [0, 1].map(k => points.reduce(([least, most], p) => [Math.min(least, p[k]), Math.max(most, p[k])], [Infinity, -Infinity]));

test('the arm draws what the browser shows', async t => {
  const { arm, page } = await open(t);
  await page.setInputFiles('#file', file('shapes.svg', SHAPES));
  await page.getByRole('button', { name: 'True size' }).click();
  await says(page, '#size-says', /^60 × 42 mm$/);
  const time = await page.textContent('#fact-time'), inkSaid = parseFloat(await page.textContent('#fact-ink'));
  const answered = page.waitForResponse(response => new URL(response.url()).pathname === '/api/job');
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  const begun = await (await answered).json();
  await says(page, '#job-title', /^Finished shapes\.svg$/);
  await arm.until('/api/state', state => !state.moving);

  // Seen from the front, x of the screen is y of the arm and the other way round; 20 units are 1 mm.
  const ink = arm.ink().map(line => line.map(([x, y]) => [y / UNITS_PER_MM, x / UNITS_PER_MM]));
  const wanted = await rendered(page, SHAPES);
  const [drawnBox, wantedBox] = [ink, wanted].map(lines => box(lines.flat()));
  for (const k of [0, 1]) {
    const [drawn, want] = [drawnBox, wantedBox].map(all => all[k][1] - all[k][0]);
    assert.ok(Math.abs(drawn - want) < 0.1, `${drawn} mm, not ${want}`);
  }
  const shift = [0, 1].map(k => (wantedBox[k][0] + wantedBox[k][1] - drawnBox[k][0] - drawnBox[k][1]) / 2);
  const moved = ink.map(line => line.map(p => [p[0] + shift[0], p[1] + shift[1]]));
  const worst = (points, lines) => Math.max(...points.map(p => Math.min(...lines.map(line => distance(p, line)))));
  const beside = worst(moved.flat(), wanted), missing = worst(wanted.flat(), moved);
  console.log(`ink is at most ${beside.toFixed(3)} mm beside the drawing, and no line is further than ${missing.toFixed(3)} mm from ink`);
  assert.ok(beside < 0.1 && missing < 0.1, `${beside} mm beside, ${missing} mm missing`);
  const [drawn, want] = [moved, wanted].map(lines => lines.reduce((sum, line) => sum + length(line), 0));
  assert.ok(Math.abs(drawn - want) < 0.01 * want, `${drawn} mm of ink for ${want} mm of lines`);
  assert.ok(Math.abs(inkSaid - want) < 0.01 * want + 1, `the preview said ${inkSaid} mm`);

  // The machine reckoned as the preview did.
  const [, minutes = 0, seconds] = /(?:(\d+) min )?(\d+) s/.exec(time);
  assert.ok(Math.abs(minutes * 60 + +seconds - begun.seconds.left) <= 1, `the preview says ${time}, the machine ${begun.seconds.left} s`);
  const { job } = await arm.ask('/api/state');
  assert.equal(job.out_of_reach.count, 0);
});

test('a preview tells time, lengths and what will not be drawn before anything moves', async t => {
  const { arm, page } = await open(t);
  await page.setInputFiles('#file', file('note.svg', '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 50"><text>hello</text><rect width="100" height="50"/></svg>'));
  await says(page, '#notes', /Not drawn: 1 text/);
  assert.match(await page.textContent('#fact-strokes'), /^1$/);
  assert.match(await page.textContent('#fact-time'), /^\d+ s$/);
  const path = () => page.getAttribute('#plan', 'd'), before = await path();
  assert.match(await page.getAttribute('#travel', 'd'), /^M/);
  await page.getByLabel('Right, mm').fill('300');
  await says(page, '#notes', /\d+ points of \d+ are out of reach\. What is out of reach is left out\./);
  assert.notEqual(await path(), before);
  await page.getByRole('button', { name: 'Largest' }).click();
  await page.waitForFunction(before => document.querySelector('#plan').getAttribute('d') === before, before);
  const { moving, job, position } = await arm.ask('/api/state');
  assert.deepEqual([moving, job, position], [false, null, { x: 1000, y: 1000, z: 1000 }]);
});

test('a drawing is moved by dragging it on the sheet', async t => {
  const { page } = await open(t);
  await page.setInputFiles('#file', file('box.svg', '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 50"><rect width="100" height="50"/></svg>'));
  await page.getByLabel(/^Size/).fill('50');
  await says(page, '#size-says', /mm/);
  const { x, y, width, height } = await page.locator('#sheet').boundingBox();
  await page.mouse.move(x + width / 2, y + height * 0.7);
  await page.mouse.down();
  await page.mouse.move(x + width / 2 + 60, y + height * 0.7 + 20, { steps: 5 });
  await page.mouse.up();
  await page.waitForFunction(() => +document.querySelector('#right').value > 5 && +document.querySelector('#down').value > 1);
});

test('pause at pen-up, go on, and stop', async t => {
  const { arm, page } = await open(t, { speed: 10 });
  const strokes = [...Array(40).keys()].map(i => `<path d="M${5 * i} 0v100" stroke="#000"/>`).join('');
  await page.setInputFiles('#file', file('hatch.svg', `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">${strokes}</svg>`));
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await says(page, '#job-words', /^[1-9]\d* %, .* left/);
  await page.getByRole('button', { name: 'Pause' }).click();
  await says(page, '#job-title', /^Paused: hatch\.svg$/);
  const paused = await arm.ask('/api/state');
  assert.deepEqual([paused.job.state, paused.pen, paused.moving], ['paused', 'up', false]);
  await page.waitForFunction(() => document.querySelectorAll('#ink path').length > 0);

  await page.getByRole('button', { name: 'Go on' }).click();
  await says(page, '#job-title', /^Drawing hatch\.svg$/);
  await arm.until('/api/state', state => state.job.lines.done > paused.job.lines.done);

  await page.getByRole('button', { name: 'Stop', exact: true }).click();
  await says(page, '#job-title', /^Stopped hatch\.svg$/);
  const stopped = await arm.until('/api/state', state => !state.moving);
  assert.deepEqual([stopped.job.state, stopped.pen], ['stopped', 'up']);
  assert.ok(stopped.job.lines.done < stopped.job.lines.total);
  await page.getByRole('button', { name: 'Draw', exact: true }).waitFor();
});

test('a drawing goes on without its page, and another page shows it', async t => {
  const { arm, page } = await open(t, { speed: 10 });
  const strokes = [...Array(20).keys()].map(i => `<path d="M${5 * i} 0v100" stroke="#000"/>`).join('');
  await page.setInputFiles('#file', file('hatch.svg', `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">${strokes}</svg>`));
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await says(page, '#job-words', /%/);
  const context = page.context();
  await page.close();
  await arm.until('/api/state', state => state.job.lines.done > 10);
  const other = await context.newPage();
  await other.goto(arm.url);
  await says(other, '#job-title', /^(Drawing|Finished) hatch\.svg$/);
  await other.waitForFunction(() => document.querySelectorAll('#ink path').length > 2 && document.querySelector('#plan').getAttribute('d').startsWith('M'));
  await says(other, '#job-title', /^Finished/);
});

test('a drawing larger than what the arm holds is sent piece by piece', async t => {
  const { arm, page } = await open(t);
  const { limits } = await arm.ask('/api');
  const points = [...Array(Math.ceil(limits.drawing / 10)).keys()].map(i => `${100 + 90 * Math.cos(i * 0.3)} ${100 + 90 * Math.sin(i * 0.3)}`);
  await page.setInputFiles('#file', file('large.svg', `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 200"><path d="M${points.join('L')}" stroke="#000"/></svg>`));
  await says(page, '#notes', /Larger than what the arm holds .* leave this page open/);
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await says(page, '#job-title', /^Finished large\.svg$/);
  const { job } = await arm.ask('/api/state');
  assert.deepEqual([job.error ?? null, job.lines.done], [null, job.lines.total]);
  assert.ok(job.bytes.received > limits.drawing);
});

test('G-code is drawn as it is written, and what does not belong there is named', async t => {
  const { arm, page } = await open(t);
  await page.setInputFiles('#file', file('line.gcode', '; a line\nG01 X1000 Y-400\nG01 Z0\nM550 Pmine\nG01 X1700\nG01 Z1000\nG28\n'));
  await says(page, '#notes', /1 line left out, the first is line 4: M550 Pmine/);
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await says(page, '#job-title', /^Finished line\.gcode$/);
  await arm.until('/api/state', state => !state.moving);
  const ink = arm.ink(), [[[x0, y0]]] = ink, last = ink.at(-1).at(-1);
  for (const [is, was] of [[x0, 1000], [y0, -400], [last[0], 1700], [last[1], -400]]) assert.ok(Math.abs(is - was) < 1, `${[x0, y0]} to ${last}`);
});

test('a long line grows with the pen', async t => {
  const { page } = await open(t, { speed: 0.5 });
  await page.setInputFiles('#file', file('line.gcode', 'G1 Z300\nG1 X1000 Y-800\n'));
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  const reached = () => page.waitForFunction(() => /^M1000 1000L1000 [\d-]/.test(document.querySelector('#wet').getAttribute('d')) && +document.querySelector('#wet').getAttribute('d').split(' ')[2]);
  const first = await (await reached()).jsonValue();
  await page.waitForFunction(first => +document.querySelector('#wet').getAttribute('d').split(' ')[2] < first, first);
});

test('what is no drawing is refused in words', async t => {
  const { page } = await open(t);
  for (const [name, text, words] of [['a.svg', '<svg', /damaged/], ['b.svg', '<svg xmlns="http://www.w3.org/2000/svg"><text>x</text></svg>', /nothing in it that a pen can draw: 1 text/], ['c.txt', 'hello', /nothing in it/]]) {
    await page.setInputFiles('#file', file(name, text));
    await says(page, '#error', words);
  }
});
