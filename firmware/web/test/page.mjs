// The page's plain functions, out of the page: its scripts marked `data-pure` need neither document nor network.

import { readFileSync } from 'node:fs';

export const html = readFileSync(new URL('../index.html', import.meta.url), 'utf8');
const code = [...html.matchAll(/<script data-pure>([^]*?)<\/script>/g)].map(([, script]) => script).join('\n');
const names = [...code.matchAll(/^(?:function|const) (\w+)/gm)].map(([, name]) => name);

/** All functions and constants of the plain scripts, by name. */
export const page = new Function(`${code}\nreturn {${names.join(', ')}};`)();
