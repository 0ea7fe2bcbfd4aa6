// The packages as npm publishes them: what is in them, how large they are, and that they work where they are installed.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFile, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { conformance, digests, folder as streams } from './streams.mjs';

const packages = fileURLToPath(new URL('../packages/', import.meta.url));
const npm = (words, cwd) => execFileSync('npm', words, { cwd, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
const packed = {};
let work;

before(async () => {
    work = await mkdtemp(join(tmpdir(), 'htvm-packages-'));
    for (const name of ['decoder', 'three', 'player'])
        [packed[name]] = JSON.parse(npm(['pack', '--json', '--pack-destination', work, join(packages, name)], work));
});

after(() => rm(work, { recursive: true }));

// What visitors wait for. A change that needs more is to say so here.
const budgets = { decoder: 450_000, three: 30_000, player: 2_000_000 };
for (const [name, most] of Object.entries(budgets))
    test(`@htvm/${name} packs into at most ${most} bytes`, () => assert.ok(packed[name].size <= most, `${packed[name].size} bytes`));

for (const name of Object.keys(budgets))
    test(`@htvm/${name} has what its exports name, a README and the licence`, async () => {
        const files = new Set(packed[name].files.map(({ path }) => path));
        const { exports, types } = JSON.parse(await readFile(join(packages, name, 'package.json'), 'utf8'));
        const named = Object.values(exports).flatMap((target) => (typeof target === 'string' ? [target] : Object.values(target)));
        for (const path of [types, ...named].filter((path) => !path.includes('*'))) assert.ok(files.has(path.slice(2)), path);
        for (const path of ['README.md', 'LICENSE', 'package.json']) assert.ok(files.has(path), path);
        assert.deepEqual([...files].filter((path) => !/^(dist\/|README\.md$|LICENSE$|package\.json$)/.test(path)), []);
    });

test('@htvm/decoder, installed in an empty folder, decodes by the lines of its README', async () => {
    const home = await mkdtemp(join(work, 'empty-'));
    await writeFile(join(home, 'package.json'), '{ "type": "module", "private": true }');
    npm(['install', '--no-audit', '--no-fund', '--offline', join(work, packed.decoder.filename)], home);
    const lines = (await readFile(join(home, 'node_modules/@htvm/decoder/README.md'), 'utf8')).split('```js\n')[1].split('```')[0];
    await copyFile(join(streams, 'tracked.htvm'), join(home, 'tracked.htvm'));
    const around = `import { readFileSync } from 'node:fs';
        const bytes = new Uint8Array(readFileSync('tracked.htvm')), sizes = [];
        const show = (positions, indices) => sizes.push([positions.length / 3, indices.length / 3].join(' '));
        ${lines}
        console.log(sizes.join('\\n'));`;
    await writeFile(join(home, 'first.js'), around);
    const said = execFileSync('node', ['first.js'], { cwd: home, encoding: 'utf8' });
    const stored = (await digests('tracked')).map((line) => line.split(' ').slice(2, 4).join(' '));
    assert.deepEqual(said.trim().split('\n'), stored);
});

test('the page of the README of @htvm/player plays with one file beside it', { timeout: 60000 }, async () => {
    const page = (await readFile(join(packages, 'player/README.md'), 'utf8')).split('```html\n')[1].split('```')[0];
    const home = await mkdtemp(join(work, 'page-'));
    await writeFile(join(home, 'index.html'), page);
    await writeFile(join(home, 'person.htvm'), await conformance('tracked'));
    await copyFile(join(packages, 'player/dist/htvm-player-single.js'), join(home, 'htvm-player-single.js'));
    const server = await new TestServer({ '': home }).start();
    const browser = await launch();
    try {
        const shown = await browser.newPage();
        await shown.goto(`${server.origin}/index.html`);
        await shown.waitForFunction(() => document.querySelector('htvm-player')?.statistics?.framesShown > 3);
    } finally {
        await browser.close();
        server.stop();
    }
});
