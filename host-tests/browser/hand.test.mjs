// By hand: jog, home, pen, calibration, name and the rest of the settings, and a link that breaks.

import test from 'node:test';
import assert from 'node:assert/strict';
import { open, says } from './arm.mjs';

const at = (x, y, z) => state => !state.moving && state.position.x === x && state.position.y === y && state.position.z === z;

test('buttons and arrow keys move the arm as the screen shows it', async t => {
  const { arm, page } = await open(t);
  await page.getByRole('tab', { name: 'Move' }).click();
  await page.getByRole('button', { name: 'Down on the screen' }).first().click();
  await arm.until('/api/state', at(1100, 1000, 1000));
  await says(page, '#where', /x 55\.0, y 50\.0/);
  await page.getByRole('button', { name: 'Left', exact: true }).first().click();
  await arm.until('/api/state', at(1100, 900, 1000));
  await page.getByRole('button', { name: '20', exact: true }).first().click();
  await page.getByRole('group', { name: /arrow keys/ }).first().focus();
  await page.keyboard.press('ArrowLeft');
  await arm.until('/api/state', at(1100, 500, 1000));
  await page.keyboard.press('PageDown');
  await arm.until('/api/state', at(1100, 500, 0));
  await says(page, '#doing', /pen down/);
  await page.keyboard.press('PageUp');
  await arm.until('/api/state', at(1100, 500, 1000));
  await page.keyboard.press('Home');
  await arm.until('/api/state', at(1000, 1000, 1000));
});

test('a step beyond reach is told', async t => {
  const { page } = await open(t);
  await page.getByRole('tab', { name: 'Move' }).click();
  await page.getByRole('button', { name: '20', exact: true }).first().click();
  await page.getByRole('button', { name: 'Right', exact: true }).first().click();
  await page.getByRole('button', { name: 'Right', exact: true }).first().click();
  await says(page, '#said', /^Out of reach/);
});

test('the nib on the sheet is where the pen is', async t => {
  const { arm, page } = await open(t);
  await page.getByRole('tab', { name: 'Move' }).click();
  await page.getByRole('button', { name: 'Down on the screen' }).first().click();
  await arm.until('/api/state', at(1100, 1000, 1000));
  await page.waitForFunction(() => document.querySelector('#nib').getAttribute('cx') === '1100' && document.querySelector('#nib').getAttribute('cy') === '1000');
});

test('renaming holds at once and after a restart, and the page comes back by itself', async t => {
  const { arm, page } = await open(t);
  await page.getByRole('tab', { name: 'Settings' }).click();
  const name = page.getByLabel(/^Name/);
  await page.waitForFunction(() => document.querySelector('#set-name').value === 'line-us');
  await name.fill('robs arm');
  await page.getByRole('button', { name: 'Save' }).click();
  await says(page, '#error', /name/);
  await name.fill('robs-arm');
  await page.getByRole('button', { name: 'Save' }).click();
  await says(page, '#said', /called robs-arm now/);
  await says(page, 'h1', /^robs-arm$/);
  await arm.switchOff();
  await says(page, '#doing', /^No connection/);
  await arm.switchOn();
  await says(page, '#doing', /^Ready/);
  await says(page, 'h1', /^robs-arm$/);
});

test('speeds, waves and start mode are set', async t => {
  const { arm, page } = await open(t);
  await page.getByRole('tab', { name: 'Settings' }).click();
  await page.waitForFunction(() => document.querySelector('#set-name').value === 'line-us');
  await page.getByLabel(/^Drawing:/).fill('8');
  await says(page, '#set-pen_down-says', /^up to 40 mm a second$/);
  await page.getByLabel(/^Waves/).uncheck();
  await page.getByLabel(/^When switched on/).selectOption('station_long_press');
  await page.getByRole('button', { name: 'Save' }).click();
  await says(page, '#said', /^Saved\.$/);
  const settings = await arm.ask('/api/settings');
  assert.deepEqual([settings.speed, settings.waves, settings.start_mode], [{ pen_down: 8, pen_up: 15 }, false, 'station_long_press']);
});

test('calibration goes step by step', async t => {
  const { arm, page } = await open(t);
  await page.getByRole('tab', { name: 'Move' }).click();
  await page.getByText('Calibrate', { exact: true }).click();
  await page.getByRole('button', { name: 'Go home' }).click();
  await says(page, '#calibration-title', /^Bring the nib over/);
  assert.ok(await page.locator('#calibration-title').evaluate(title => title === document.activeElement), 'a screen reader hears the next step');
  await page.locator('#calibration-pad').getByRole('button', { name: 'Down on the screen' }).click();
  await arm.until('/api/state', at(1005, 1000, 1000));
  await page.getByRole('button', { name: 'The nib is there' }).click();
  await says(page, '#calibration-title', /^Calibrated$/);
  await arm.until('/api/state', state => state.calibrated && at(1000, 1000, 1000)(state));
  await page.getByRole('button', { name: 'Forget calibration' }).click();
  await says(page, '#said', /forgotten/);
  await arm.until('/api/state', state => !state.calibrated);
});

test('everything is reached with the keyboard, and has a name', async t => {
  const { page } = await open(t);
  await page.keyboard.press('Tab');
  assert.equal(await page.evaluate(() => document.activeElement.textContent), 'To the controls');
  const tabs = page.getByRole('tab');
  await tabs.first().focus();
  for (const [key, name] of [['ArrowRight', 'Move'], ['ArrowRight', 'WiFi'], ['End', 'Settings'], ['ArrowRight', 'Draw'], ['ArrowLeft', 'Settings'], ['Home', 'Draw']]) {
    await page.keyboard.press(key);
    assert.equal(await page.evaluate(() => document.activeElement.textContent), name);
    assert.equal(await page.getByRole('tabpanel', { name }).isVisible(), true);
  }
  // Every control has a name that a screen reader can say.
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, input, select, progress')].filter(element =>
    !(element.textContent.trim() || element.ariaLabel || element.getAttribute('aria-labelledby') || element.labels?.length)).map(element => element.outerHTML));
  assert.deepEqual(nameless, []);
});
