// Pictures of the page with an arm that draws, one of which is in the documentation: node pictures.mjs FOLDER

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { DESK, file, open, PHONE, says } from './arm.mjs';

const folder = process.argv[2] ?? '.', drawing = readFileSync(new URL('../../examples/dandelion.svg', import.meta.url), 'utf8');
const endings = [], t = { after: ending => endings.unshift(ending) };

for (const [name, size] of Object.entries({ desk: DESK, phone: PHONE })) for (const dark of [false, true]) {
  const { arm, page } = await open(t, { size, dark, speed: 2 });
  const picture = what => page.screenshot({ path: join(folder, `${name}${dark ? '-dark' : ''}-${what}.png`) });
  await page.setInputFiles('#file', file('dandelion.svg', drawing));
  await says(page, '#fact-time', /\d/);
  await picture('preview');
  await page.getByRole('button', { name: 'Draw', exact: true }).click();
  await arm.until('/api/state', ({ job }) => job.lines.done > 0.62 * job.lines.total);
  await says(page, '#job-words', /%/);
  await picture('drawing');
}
for (const ending of endings) await ending();
