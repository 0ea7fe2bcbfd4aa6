// The player's picture beside that of `htvm compare --pictures`, of the same mesh from the same camera: HTVM names the
// program. The one is drawn by the graphics card (software, here), the other by the program's own rasteriser.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const program = process.env.HTVM;
const leastPsnr = 35; // dB, over the pixels inside the outline
// The angles of view are 30 and 32 degrees: pictures of these sizes have as many pixels a millimetre.
const size = 428, playerSize = 458;

// How far the program's camera is from the middle of a box, millimetres: as cameras_round() in src/metrics/camera.cpp has it.
function cameraDistance([low, high]) {
    const half = high.map((value, axis) => (value - low[axis]) / 2);
    const radius = Math.hypot(half[0], half[2]);
    const free = 0.9 * (size / 2);
    const scale = size / 2 / Math.tan(Math.PI / 12);
    return radius + scale * Math.max(radius, half[1]) / free;
}

test('the unlit picture is that of htvm compare --pictures', { skip: program ? false : 'HTVM names no program', timeout: 60000 }, async () => {
    const work = await mkdtemp(join(tmpdir(), 'htvm-pictures-'));
    const browser = await launch();
    const server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: work }).start();
    try {
        const run = (...words) => execFileSync(program, words, { cwd: work, stdio: ['ignore', 'pipe', 'pipe'], encoding: 'utf8' });
        run('synth', 'capture', '--frames', '1', '--vertices', '20000');
        run('encode', 'capture', '--up', 'y', '-o', 'person.htvm');
        run('decode', 'person.htvm', '-o', 'decoded', '--unit', 'mm');
        const azimuth = 25;
        run('compare', 'decoded', 'person.htvm', '--only', 'm3', '--views', '1', '--azimuth', String(azimuth), '--width', String(size), '--height',
            String(size), '--shading', 'unlit', '--up', 'y', '--pictures', 'pictures');
        const bounds = JSON.parse(run('info', 'person.htvm', '--json')).front_index.bounds_mm;
        server.made.set('expected.png', await readFile(join(work, 'pictures', 'frame_00000_view_0.png')));
        const page = await browser.newPage({ viewport: { width: 500, height: 500 } });
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction('window.ready');
        const { psnr, share } = await page.evaluate(async ({ azimuth, distance, size, playerSize }) => {
            await test.open({ src: '/as-is/person.htvm' });
            Object.assign(test.player.style, { width: `${playerSize}px`, height: `${playerSize}px` });
            await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve))); // until its size is observed
            test.player.view = { ...test.player.view, yaw: azimuth, pitch: 0, distance: distance / 1000 };
            await test.player.idle();
            const pixels = async (blob, left) => {
                const bitmap = await createImageBitmap(blob);
                const canvas = new OffscreenCanvas(size, size);
                const context = canvas.getContext('2d');
                context.drawImage(bitmap, -left, -left);
                return context.getImageData(0, 0, size, size).data;
            };
            const drawn = await pixels(await test.player.screenshot(), (playerSize - size) / 2);
            // The first of the three pictures side by side.
            const wanted = await pixels(await (await fetch('/as-is/expected.png')).blob(), 0);
            const inside = (x, y) => drawn[4 * (y * size + x) + 3] === 255 && [0, 1, 2].some((c) => wanted[4 * (y * size + x) + c] < 255);
            let count = 0, covered = 0, squared = 0;
            const reach = 2; // pixels from the outline
            for (let y = reach; y < size - reach; ++y)
                for (let x = reach; x < size - reach; ++x) {
                    if (!inside(x, y)) continue;
                    ++covered;
                    let interior = true;
                    for (let dy = -reach; dy <= reach; ++dy) for (let dx = -reach; dx <= reach; ++dx) interior &&= inside(x + dx, y + dy);
                    if (!interior) continue;
                    ++count;
                    for (let c = 0; c < 3; ++c) squared += (drawn[4 * (y * size + x) + c] - wanted[4 * (y * size + x) + c]) ** 2;
                }
            return { psnr: 10 * Math.log10(255 ** 2 / (squared / (3 * count))), share: count / covered };
        }, { azimuth, distance: cameraDistance(bounds), size, playerSize });
        console.log(`interior pixels: PSNR ${psnr.toFixed(1)} dB, ${(100 * share).toFixed(0)} % of those drawn by both`);
        assert.ok(share > 0.7, `only ${share} of the pixels are inside`);
        assert.ok(psnr > leastPsnr, `${psnr} dB`);
    } finally {
        await browser.close();
        server.stop();
        await rm(work, { recursive: true });
    }
});
