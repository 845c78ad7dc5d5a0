// The desktop arm with its page, and a browser in front of it.

import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { launch } from './browser.mjs';

export const PHONE = { width: 390, height: 844 }, DESK = { width: 1280, height: 800 };

/** The program, as `cargo xtask test` names it. */
export const program = process.env.QUILL_DESKTOP ?? new URL('../../target/debug/desktop', import.meta.url).pathname;

/** A port that nobody listens at. */
function freePort() {
  return new Promise((done, failed) => {
    const server = createServer().on('error', failed);
    server.listen(0, '127.0.0.1', () => { const { port } = server.address(); server.close(() => done(port)); });
  });
}

export class Arm {
  /** Starts an arm that is new, with the networks of `air` around it, or in the computer's own; `slots`: with place for other firmware. */
  static async start({ speed = 'max', air, slots = false } = {}) {
    const arm = new Arm();
    arm.slots = slots;
    arm.folder = mkdtempSync(join(tmpdir(), 'quill-'));
    arm.port = await freePort();
    arm.lineUs = await freePort();
    arm.picture = join(arm.folder, 'picture.svg');
    arm.speed = speed;
    if (air !== undefined) arm.setAir(air);
    await arm.switchOn();
    return arm;
  }

  async switchOn() {
    const options = ['--line-us', `127.0.0.1:${this.lineUs}`, '--web', `127.0.0.1:${this.port}`, '--state', join(this.folder, 'state'),
      '--picture', this.picture, '--speed', String(this.speed),
      // The pen lifts when a test lifts it.
      '--lift-after', '3600'];
    if (this.air) options.push('--air', this.air);
    if (this.slots) options.push('--firmware', join(this.folder, 'firmware'));
    this.process = spawn(program, options, { stdio: ['ignore', 'pipe', 'inherit'] });
    const ended = new Promise((_, failed) => {
      this.process.once('error', failed);
      this.process.once('exit', code => failed(new Error(`${program} ended with ${code}`)));
    });
    ended.catch(() => {});
    this.log = [];
    const lines = createInterface({ input: this.process.stdout });
    const ready = new Promise(done => lines.on('line', line => { this.log.push(line); if (line.includes('stop with Ctrl-C')) done(); }));
    await Promise.race([ready, ended]);
  }

  /** Pulls the plug. */
  async switchOff() {
    const gone = new Promise(done => this.process.once('exit', done));
    this.process.kill('SIGKILL');
    await gone;
  }

  async end() {
    if (this.process.exitCode === null && this.process.signalCode === null) await this.switchOff();
    rmSync(this.folder, { recursive: true });
  }

  /** Networks: [name, password, strength]. */
  setAir(networks) {
    this.air = join(this.folder, 'air');
    writeFileSync(this.air, networks.map(words => words.join('\t') + '\n').join(''));
  }

  get url() { return `http://127.0.0.1:${this.port}/`; }

  async ask(path) { return (await fetch(new URL(path, this.url))).json(); }

  /** Asks until the answer is as wanted. */
  async until(path, wanted) {
    for (;;) {
      const answer = await this.ask(path);
      if (wanted(answer)) return answer;
      await new Promise(done => setTimeout(done, 50));
    }
  }

  /** Ink on the picture: lines of points in drawing units. */
  ink() {
    return [...readFileSync(this.picture, 'utf8').matchAll(/<polyline class="ink" points="([^"]*)"/g)]
      .map(([, points]) => points.trim().split(' ').map(point => point.split(',').map(Number)));
  }
}

/** An arm and a page of it, which are both gone when the test is over. */
export async function open(t, { size = DESK, dark = false, keepStill = true, ...options } = {}) {
  const arm = await Arm.start(options);
  t.after(() => arm.end());
  const browser = await launch();
  t.after(() => browser.close());
  const context = await browser.newContext({ viewport: size, colorScheme: dark ? 'dark' : 'light', reducedMotion: keepStill ? 'reduce' : 'no-preference', deviceScaleFactor: 2, hasTouch: size === PHONE });
  const page = await context.newPage(), faults = [];
  page.on('pageerror', error => faults.push(error.stack));
  // An answer of 4xx is told there too, and some of them are wanted.
  page.on('console', message => { if (message.type() === 'error' && !/Failed to load resource|WebSocket connection/.test(message.text())) faults.push(message.text()); });
  page.on('request', request => { if (!/^(data:|blob:)/.test(request.url()) && new URL(request.url()).host !== `127.0.0.1:${arm.port}`) faults.push(`the page asked for ${request.url()}`); });
  t.after(() => { if (faults.length) throw new Error(faults.join('\n')); });
  await page.goto(arm.url);
  await says(page, '#doing', /^(Ready|Moving)/);
  return { arm, page };
}

/** Waits until an element that can be seen says something. */
export async function says(page, selector, pattern) {
  try {
    await page.waitForFunction(([selector, source, flags]) => {
      const element = document.querySelector(selector);
      return element?.checkVisibility() && new RegExp(source, flags).test(element.textContent);
    }, [selector, pattern.source, pattern.flags]);
  } catch (error) {
    const state = await page.evaluate(selector => [document.querySelector(selector)?.textContent, document.querySelector('#error')?.textContent], selector);
    throw new Error(`${selector} does not say ${pattern}, but ${JSON.stringify(state)}`, { cause: error });
  }
  return page.locator(selector).textContent();
}

/** A file as a person chooses it. */
export const file = (name, text) => ({ name, mimeType: 'text/plain', buffer: Buffer.from(text) });
