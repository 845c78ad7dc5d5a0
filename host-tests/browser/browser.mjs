// A headless Chromium that stays by itself: it asks for nothing in the network.

import { chromium } from 'playwright-core';
import { existsSync } from 'node:fs';

const places = [process.env.QUILL_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

/** Starts the browser of this computer. */
export function launch() {
  return chromium.launch({
    executablePath: places.find(place => place && existsSync(place)),
    args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
  });
}
