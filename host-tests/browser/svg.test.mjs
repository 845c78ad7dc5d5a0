// What the page makes of an SVG, against the browser's own rendering of it: every shape is sampled with
// getPointAtLength and placed with its screen matrix, neither of which the page uses.

import test, { after, before } from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { launch } from './browser.mjs';
import { distance, length } from './lines.mjs';

const page = new URL('../../firmware/web/index.html', import.meta.url);
let browser, reader, renderer;

before(async () => {
  browser = await launch();
  // The page's functions without an arm to talk to.
  reader = await browser.newPage();
  await reader.route('**/*', route => new URL(route.request().url()).pathname === '/'
    ? route.fulfill({ contentType: 'text/html', body: readFileSync(page, 'utf8') }) : route.abort());
  await reader.goto('http://arm.test/');
  renderer = await browser.newPage();
});
after(() => browser?.close());

/** The page's strokes in pixels, and what it left out. */
function read(svg, tolerance = 0.01) {
  return reader.evaluate(([text, tolerance]) => {
    const { pieces, skipped } = readSvg(new DOMParser().parseFromString(text, 'image/svg+xml'));
    return { strokes: pieces.map(piece => flatten(piece, tolerance)), skipped };
  }, [svg, tolerance]);
}

/** The browser's: every shape that `shown` selects as a line of samples in pixels. */
async function render(svg, shown = 'path, rect, circle, ellipse, line, polyline, polygon') {
  await renderer.setContent(`<!doctype html><style>body{margin:0}svg{display:block}</style>${svg}`);
  return renderer.evaluate(shown => [...document.querySelectorAll(shown)].filter(shape => shape.getTotalLength() > 0).map(shape => {
    const whole = shape.getTotalLength(), matrix = shape.getScreenCTM();
    return [...Array(801).keys()].map(i => {
      const { x, y } = new DOMPoint(shape.getPointAtLength(whole * i / 800).x, shape.getPointAtLength(whole * i / 800).y).matrixTransform(matrix);
      return [x, y];
    });
  }), shown);
}

/** Both draw the same, to a twentieth of a pixel. */
async function same(svg, shown) {
  const [{ strokes, skipped }, rendered] = [await read(svg), await render(svg, shown)];
  assert.ok(rendered.length > 0, 'the browser draws nothing');
  for (const p of rendered.flat()) {
    const off = Math.min(...strokes.map(stroke => distance(p, stroke)));
    assert.ok(off < 0.05, `${p} is drawn by the browser, ${off} px from what the page draws`);
  }
  const [ours, theirs] = [strokes, rendered].map(all => all.reduce((sum, line) => sum + length(line), 0));
  assert.ok(Math.abs(ours - theirs) < 0.005 * theirs, `${ours} px of ink, the browser has ${theirs}`);
  return skipped;
}

const DOCUMENTS = {
  'lines and curves': '<path d="M10 10 L90 20 H120 V50 C130 80 160 80 160 50 S200 20 210 60 Q230 100 250 60 T290 60"/>',
  'relative ones': '<path d="m10,10l80,10h30v30c10,30,40,30,40,0s40,-30,50,10q20,40,40,0t40,0z"/>',
  'arcs': '<path d="M50 100A40 20 30 0 1 120 80A40 20 30 1 0 180 120a25,25 -30 0,1 50,-25a5 5 0 0150 50"/>',
  'an arc that is too small': '<path d="M20 50A5 10 20 1 1 90 70"/>',
  'plain shapes': '<rect x="10" y="10" width="50" height="30"/><circle cx="100" cy="40" r="25"/><ellipse cx="180" cy="50" rx="40" ry="15"/><line x1="10" y1="100" x2="90" y2="130" stroke="red"/><polyline points="100,100 120,130 140,100 160,130"/><polygon points="200,100 230,140 170,140"/>',
  'rounded rectangles': '<rect x="10" y="10" width="80" height="40" rx="12"/><rect x="110" y="10" width="80" height="40" ry="30" rx="10"/><rect x="10" y="80" width="60" height="40" rx="100" ry="5"/>',
  'nested transforms': '<g transform="translate(50 20) rotate(20)"><g transform="scale(1.5 .6)"><path d="M0 0C10 40 60 -40 70 10" transform="skewX(25)"/><circle r="20" cx="30" cy="40" transform="matrix(1 .3 -.2 1 5 5)"/></g><rect width="20" height="20" transform="rotate(-45, 10, 10) skewY(10)"/></g>',
  'percentages': '<circle cx="50%" cy="50%" r="10%"/><rect x="10%" y="10%" width="30%" height="20%"/><line x1="0" y1="100%" x2="100%" y2="0" stroke="#000"/>',
  'other units': '<rect x="5mm" y=".5cm" width="1in" height="36pt"/><circle cx="2cm" cy="3pc" r="10px"/>',
};

for (const [what, body] of Object.entries(DOCUMENTS)) {
  test(`the same as the browser: ${what}`, () => same(`<svg xmlns="http://www.w3.org/2000/svg" width="300" height="200">${body}</svg>`));
}

for (const ratio of ['', 'none', 'xMinYMin', 'xMaxYMax meet', 'xMidYMin slice', 'xMinYMax slice']) {
  test(`the same as the browser: a viewBox with preserveAspectRatio "${ratio}"`, () => same(
    `<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="30mm" viewBox="-20 10 100 60"${ratio && ` preserveAspectRatio="${ratio}"`}><circle cx="30" cy="40" r="25"/><path d="M0 20L60 60"/></svg>`));
}

test('the same as the browser: a drawing within a drawing', () => same(
  '<svg xmlns="http://www.w3.org/2000/svg" width="300" height="200"><svg x="20" y="30" width="100" height="50" viewBox="0 0 10 10"><rect width="10" height="10"/></svg><svg x="50%" overflow="visible"><circle r="9"/></svg></svg>'));

test('what is used is drawn where it is used', async () => {
  const wrap = body => `<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="300" height="200">${body}</svg>`;
  const used = await read(wrap('<defs><g id="a" transform="rotate(10)"><rect width="20" height="10"/></g><symbol id="s" viewBox="0 0 10 10"><circle cx="5" cy="5" r="5"/></symbol></defs><use href="#a" x="30" y="40" transform="scale(2)"/><use xlink:href="#s" x="100" y="50" width="40" height="60"/>'));
  const plain = await read(wrap('<g transform="scale(2) translate(30 40) rotate(10)"><rect width="20" height="10"/></g><circle cx="120" cy="80" r="20"/>'));
  assert.equal(used.strokes.length, 2);
  for (const [i, stroke] of used.strokes.entries()) for (const p of stroke) assert.ok(distance(p, plain.strokes[i]) < 0.02);
});

test('what is not shown is not drawn', async () => {
  const hidden = ['<path d="M0 0L9 9" style="display:none"/>', '<g display="none"><path d="M0 0L9 9"/></g>', '<path d="M0 0L9 9" visibility="hidden"/>',
    '<path d="M0 0h24v24H0z" fill="none"/>', '<g fill="none"><rect width="5" height="5"/></g>', '<line x2="9" y2="9"/>', '<defs><path d="M0 0L9 9"/></defs>',
    '<clipPath><path d="M0 0L9 9"/></clipPath>', '<path class="x" d="M0 0L9 9"/>', '<circle r="0"/>', '<rect width="0" height="5"/>', '<polyline points="1,1"/>'];
  for (const body of hidden) {
    const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="300" height="200"><style>.x, .y { fill: none } </style>${body}<path d="M50 50L90 90" stroke="#000"/></svg>`;
    const { strokes, skipped } = await read(svg);
    assert.deepEqual([strokes, skipped], [[[[50, 50], [90, 90]]], {}], body);
  }
});

test('what a pen cannot draw is named and counted', async () => {
  const { skipped } = await read('<svg xmlns="http://www.w3.org/2000/svg"><text>a</text><g><text>b</text></g><image href="data:,"/><use href="#gone"/><path clip-path="url(#c)" d="M0 0L9 9"/></svg>');
  assert.deepEqual(skipped, { text: 2, image: 1, 'broken reference': 1, clipping: 1 });
});

test('a drawing that uses itself, or grows without end, is refused and not drawn for ever', async () => {
  const self = await read('<svg xmlns="http://www.w3.org/2000/svg"><g id="a"><path d="M0 0L9 9"/><use href="#a"/></g></svg>');
  assert.ok(self.strokes.length < 40 && self.skipped['too deeply nested'] === 1);
  const levels = [...Array(12).keys()].map(i => `<g id="l${i + 1}">${`<use href="#l${i}"/>`.repeat(10)}</g>`).join('');
  await assert.rejects(read(`<svg xmlns="http://www.w3.org/2000/svg"><defs><path id="l0" d="M0 0L1 1"/>${levels}</defs><use href="#l12"/></svg>`), /more than 400000/);
});

test('a text that is no drawing is refused', async () => {
  await assert.rejects(read('<html xmlns="http://www.w3.org/1999/xhtml"/>'), /not an SVG/);
});
