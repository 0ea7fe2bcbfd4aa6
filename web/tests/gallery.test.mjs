// examples/gallery in Chromium, from a server that knows nothing but files: HTVM names the program.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const program = process.env.HTVM;

test('all four streams of the gallery play', { skip: program ? false : 'HTVM names no program', timeout: 180000 }, async () => {
    const home = await mkdtemp(join(tmpdir(), 'htvm-gallery-'));
    const make = fileURLToPath(new URL('../../examples/gallery/make.sh', import.meta.url));
    execFileSync(make, [home, '6', '2000'], { stdio: 'pipe' });
    const server = await new TestServer({ '': home }).start();
    const browser = await launch();
    try {
        const page = await browser.newPage();
        const faults = [];
        page.on('pageerror', (error) => faults.push(error.message));
        await page.goto(`${server.origin}/index.html`);
        await page.waitForFunction(() => [...document.querySelectorAll('htvm-player')].filter((player) => player.statistics?.framesShown > 3).length === 4);
        assert.deepEqual(faults, []);
    } finally {
        await browser.close();
        server.stop();
        await rm(home, { recursive: true });
    }
});
