// A new arm, brought into a network from a phone.

import test from 'node:test';
import assert from 'node:assert/strict';
import { open, PHONE, says } from './arm.mjs';

const HOME = ['home', 'correct horse', -45], CAFE = ['Café am Eck', '', -70], ATTIC = ['attic', 'battery staple', -80];

async function newArm(t) {
  const opened = await open(t, { size: PHONE, speed: 1, air: [HOME, CAFE, ATTIC] });
  await opened.arm.until('/api/state', state => state.wifi.phase === 'setup');
  await says(opened.page, '#wifi-title', /into your network/);
  await says(opened.page, '#networks', /home.*strong.*Café am Eck.*open.*attic.*weak/);
  return opened;
}

async function join({ page }, name, password) {
  await page.getByRole('radio', { name }).check();
  await page.getByLabel(/^Password/).fill(password);
  await page.getByRole('button', { name: 'Join' }).click();
  await says(page, '#wifi-trying', /The arm tries .*Blue, flashing.*Blue:.*it worked.*Red, flashing/);
}

test('the right password brings it there, and the page tells the new address', async t => {
  const opened = await newArm(t);
  await join(opened, /^home/, 'correct horse');
  await says(opened.page, '#wifi-trying', /It worked: the arm is in home\. The light is blue\. From now on it is at http:\/\/line-us\.local\//);
  assert.equal(await opened.page.getByRole('link', { name: 'http://line-us.local/' }).getAttribute('href'), 'http://line-us.local/');
  await says(opened.page, '#around', /^Blue light · connected to home$/);
  await says(opened.page, '#networks', /home.*remembered, in use/);
  assert.equal(await opened.page.getByLabel(/^Password/).inputValue(), '', 'the password does not stay in the page');
  const { wifi, light } = await opened.arm.ask('/api/state');
  assert.deepEqual([wifi.mode, wifi.phase, wifi.network, light], ['station', 'connected', 'home', 'blue']);
});

test('a wrong password is told, and the next try works', async t => {
  const opened = await newArm(t);
  await join(opened, /^home/, 'wrong horse');
  await says(opened.page, '#error', /^home: wrong password\. The arm is back in its own network/);
  assert.ok(await opened.page.getByLabel(/^Password/).evaluate(input => input === document.activeElement), 'the password can be typed again at once');
  assert.equal((await opened.arm.ask('/api/networks')).networks.find(({ name }) => name === 'home').remembered, false);
  await join(opened, /^home/, 'correct horse');
  await says(opened.page, '#wifi-trying', /It worked/);
});

test('a network that has vanished meanwhile is told', async t => {
  const opened = await newArm(t);
  opened.arm.setAir([HOME]);
  await opened.arm.until('/api/networks', ({ networks }) => !networks.some(({ name }) => name === 'attic'));
  await join(opened, /^attic/, 'battery staple');
  await says(opened.page, '#error', /^attic: not found\./);
});

test('a hidden network is typed, an open one needs no password', async t => {
  const opened = await newArm(t);
  const { page } = opened;
  await page.getByRole('radio', { name: 'Another one' }).check();
  await page.getByLabel('Network’s name').fill('not there');
  await page.getByRole('button', { name: 'Join' }).click();
  await says(page, '#error', /^not there: not found/);
  await page.getByRole('radio', { name: /Café/ }).check();
  await page.getByRole('button', { name: 'Join' }).click();
  await says(page, '#wifi-trying', /the arm is in Café am Eck/);
});

test('a password that cannot be one is refused with its reason', async t => {
  const { page } = await newArm(t);
  await page.getByRole('radio', { name: /^home/ }).check();
  await page.getByLabel(/^Password/).fill('short');
  await page.getByRole('button', { name: 'Join' }).click();
  await says(page, '#error', /8 to 63 bytes/);
});
