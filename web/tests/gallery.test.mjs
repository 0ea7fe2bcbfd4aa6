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

test('all four streams of the gallery play, and the page says what each takes', { skip: program ? false : 'HTVM names no program', timeout: 180000 }, async () => {
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
        const captions = await page.locator('section p span').allTextContents();
        assert.equal(captions.length, 4);
        for (const caption of captions) assert.match(caption, /^[1-9]\d* KB, \d\.\d\d Mbit\/s\.$/);
        // The page's own background shows around the pictures that stand in for streams.
        const corner = await page.evaluate(async () => {
            const canvas = new OffscreenCanvas(1, 1).getContext('2d');
            canvas.drawImage(await createImageBitmap(await (await fetch('colours.png')).blob()), 0, 0);
            return [...canvas.getImageData(0, 0, 1, 1).data];
        });
        assert.equal(corner[3], 0);
        assert.deepEqual(faults, []);
    } finally {
        await browser.close();
        server.stop();
        await rm(home, { recursive: true });
    }
});
