// New firmware from a file: what is refused, and what starts.

import test from 'node:test';
import { createHash, createPrivateKey, sign } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { open, program, says } from './arm.mjs';

const seed = readFileSync(new URL('../../firmware/keys/development.key', import.meta.url), 'utf8').trim();
// An ed25519 key in PKCS #8 is this and 32 bytes (RFC 8410).
const key = createPrivateKey({ key: Buffer.from('302e020100300506032b657004220420' + seed, 'hex'), format: 'der', type: 'pkcs8' });
const board = `desktop-${{ x64: 'x86-64', arm64: 'aarch64' }[process.arch]}-${{ linux: 'linux', darwin: 'macos' }[process.platform]}`;
/** Firmware that does what the arm's program does: a script, which is as good a program as any. */
const image = Buffer.from(`#!/bin/sh\nexec '${program}' "$@"\n`);

/** A file for the page. */
function update({ version = '9.0.0', content = image } = {}) {
  const signed = `Quill update 1\nboard: ${board}\nversion: ${version}\nsize: ${image.length}\nsha256: ${createHash('sha256').update(image).digest('hex')}\nimage: image\n`;
  const manifest = `${signed}signature: ${sign(null, Buffer.from(signed), key).toString('hex')}\n`;
  return { name: `quill-${version}.update`, mimeType: 'application/octet-stream', buffer: Buffer.concat([Buffer.from(manifest), content]) };
}

async function settings(t) {
  const opened = await open(t, { slots: true, speed: 1 });
  await opened.page.getByRole('tab', { name: 'Settings' }).click();
  await says(opened.page, '#about', /Version 3\.2\.0 Quill .*development key/);
  return opened;
}

async function send(page, file) {
  await page.getByLabel(/^New firmware/).setInputFiles(file);
  await page.getByRole('button', { name: 'Update', exact: true }).click();
}

test('what is refused is told, and the arm goes on', async t => {
  const { arm, page } = await settings(t);
  const changed = Buffer.from(image);
  changed[changed.length - 1] ^= 1;
  for (const [file, reason] of [
    [update({ content: changed }), /the image is not the signed one/],
    [update({ content: image.subarray(1) }), /the image has \d+ bytes, the signed one \d+/],
    [update({ version: '0.0.1' }), /0\.0\.1 is older than this firmware/],
    [{ ...update(), buffer: Buffer.from('not firmware') }, /line 1 of the manifest is wrong/],
    [{ ...update(), buffer: Buffer.from(update().buffer.toString().replace('9.0.0', '9.0.1')) }, /the signature is wrong/],
  ]) {
    await send(page, file);
    await says(page, '#error', reason);
    await says(page, '#update-words', new RegExp('^Refused: ' + reason.source));
  }
  await arm.until('/api/state', state => state.update.phase === 'idle');
  await says(page, '#doing', /^Ready/);
});

test('new firmware starts, and the page comes back by itself as the new one', async t => {
  const { arm, page } = await settings(t);
  await page.evaluate(() => { window.old = true; });
  await send(page, update());
  await says(page, '#said', /9\.0\.0 is in place, and starts now/);
  // The program is the same here, so what it calls itself has to be changed on its way.
  await page.route('**/api', async route => {
    const response = await route.fetch();
    await route.fulfill({ response, json: { ...await response.json(), firmware: '9.0.0' } });
  });
  await page.waitForFunction(() => !window.old);
  await arm.until('/api/state', state => state.update.words === 'on trial, start 1 of 3');
  await page.getByRole('tab', { name: 'Settings' }).click();
  await says(page, '#update-words', /^On trial, start 1 of 3/);
  // While it is on trial, there is nothing else to be had.
  await send(page, update({ version: '9.0.1' }));
  await says(page, '#error', /on trial, try again in a minute/);
});
