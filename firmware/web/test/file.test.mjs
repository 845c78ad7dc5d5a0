// The file itself: small, whole, and without a wish for anything from elsewhere.

import test from 'node:test';
import assert from 'node:assert/strict';
import { gzipSync } from 'node:zlib';
import { html } from './page.mjs';

test('it takes at most 40 kB of flash', () => {
  const size = gzipSync(html, { level: 9 }).length;
  console.log(`${size} bytes compressed`);
  assert.ok(size <= 40 * 1024, `${size} bytes`);
});

test('nothing is fetched from elsewhere', () => {
  const wishes = [...html.matchAll(/(?:src|href|action|url|import)\s*[=(]\s*["'`]?((?:https?:)?\/\/[^"'`)\s]*)/gi)].map(([, url]) => url);
  assert.deepEqual(wishes, []);
  assert.doesNotMatch(html, /@import|<iframe|<object|<embed/);
});

test('what the scripts look for is there, once', () => {
  const ids = [...html.matchAll(/\sid="([^"]+)"/g)].map(([, id]) => id);
  assert.deepEqual(ids.filter((id, i) => ids.indexOf(id) !== i), []);
  const wanted = [...html.matchAll(/\$\('([\w-]+)'\)/g)].map(([, id]) => id);
  assert.ok(wanted.length > 50);
  assert.deepEqual([...new Set(wanted)].filter(id => !ids.includes(id) && !id.endsWith('-')), []);
});
