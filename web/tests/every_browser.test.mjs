// A stream whose pictures the browser does not decode: the player takes the same stream with others, or says what is missing. Chromium
// decodes all, so it is told to refuse some. HTVM names the program that makes the streams.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const program = process.env.HTVM;
const why = !program ? 'HTVM names no program' : spawnSync('ffmpeg', ['-version']).error ? 'there is no ffmpeg' : false;
const options = { skip: why, timeout: 120000 };

// ---- the choice -------------------------------------------------------------------------------------------------------

const { outputFiles } = await build({
    entryPoints: [path('../packages/player/src/siblings.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
});
const { siblingOf, decodable } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);

// A browser that decodes what begins so, and a server that has these; what was asked for.
async function where({ decodes, has = [] }, body) {
    const asked = [];
    const { fetch } = globalThis;
    globalThis.VideoDecoder = { isConfigSupported: async ({ codec }) => ({ supported: decodes.some((one) => codec.startsWith(one)) }) };
    globalThis.fetch = async (url, { method }) => {
        asked.push(`${method} ${url}`);
        return { ok: has.includes(String(url)) };
    };
    try {
        return [await body(), asked];
    } finally {
        globalThis.fetch = fetch;
        delete globalThis.VideoDecoder;
    }
}

test('a sibling is asked for by its name, if the browser decodes its pictures, the one with the fewest bits first', async () => {
    const of = (url, coder) => () => siblingOf(url, coder);
    const here = 'https://a.example/p/person';
    assert.deepEqual(await where({ decodes: ['vp09', 'avc1'], has: [`${here}.h264.htvm?key=1`] }, of(`${here}.htvm?key=1`, 'AV1')),
        [`${here}.h264.htvm?key=1`, [`HEAD ${here}.vp9.htvm?key=1`, `HEAD ${here}.h264.htvm?key=1`]]);
    assert.deepEqual(await where({ decodes: ['av01', 'avc1'], has: [`${here}.av1.mp4`] }, of(`${here}.mp4`, 'VP9')), [`${here}.av1.mp4`, [`HEAD ${here}.av1.mp4`]]);
    assert.deepEqual(await where({ decodes: ['avc1'] }, of(`${here}.htvm`, 'AV1')), [null, [`HEAD ${here}.h264.htvm`]]);
    assert.deepEqual(await where({ decodes: [] }, of(`${here}.htvm`, 'AV1')), [null, []]);
    for (const other of ['blob:https://a.example/0', `${here}.m3u8`, 'https://a.example/watch/anna'])
        assert.deepEqual(await where({ decodes: ['avc1'] }, of(other, 'AV1')), [null, []], other);
});

test('of the qualities of a list those are taken whose pictures the browser decodes', async () => {
    const variants = ['htvm,av01.0.08M.08', 'htvm,avc3.640028,opus', 'htvm,av01.0.09M.08', 'htvm,avc3.64002a,opus', 'htvm'].map((codecs, i) => ({ codecs, url: `${i}` }));
    const taken = async (decodes, of = variants) => (await where({ decodes }, async () => (await decodable(of)).map(({ url }) => url).join('')))[0];
    assert.equal(await taken(['av01', 'avc1']), '024');
    assert.equal(await taken(['avc1']), '134');
    assert.equal(await taken(['vp09']), '024'); // their meshes are shown
    assert.equal(await taken([], variants.slice(1, 2)), '1');
    assert.equal((await decodable(variants)).length, 3); // nobody can tell
});

// ---- in Chromium ------------------------------------------------------------------------------------------------------

let browser, server, work;

before(async () => {
    if (why) return;
    work = await mkdtemp(join(tmpdir(), 'htvm-every-browser-'));
    const run = (...words) => execFileSync(program, [...words, '--quiet'], { cwd: work, stdio: 'pipe' });
    run('synth', 'capture', '--frames', '30', '--vertices', '2000', '--texture', '256');
    run('encode', 'capture', '--texture-size', '256', '--access-interval', '10', '--texture-codec', 'av1', '-o', 'person.htvm');
    run('transcode', 'person.htvm');
    run('transcode', 'person.htvm', '--texture-codec', 'vp9');
    for (const name of ['both', 'h264', 'mp4']) await mkdir(join(work, name));
    for (const name of ['person.htvm', 'person.h264.htvm', 'person.vp9.htvm']) await writeFile(join(work, 'both', name), await readFile(join(work, name)));
    for (const name of ['person.htvm', 'person.h264.htvm']) {
        await writeFile(join(work, 'h264', name), await readFile(join(work, name)));
        run('pack', name, '-o', `mp4/${name.replace('htvm', 'mp4')}`);
        run('pack', name, '-o', `mp4/${name.replace('htvm', 'm3u8')}`, '--segment', '0.3');
    }
    await mkdir(join(work, 'alone'));
    await writeFile(join(work, 'alone', 'person.htvm'), await readFile(join(work, 'person.htvm')));
    const variant = (name, codec) => `#EXT-X-STREAM-INF:BANDWIDTH=500000,CODECS="htvm,${codec}"\n${name}.m3u8\n`;
    await writeFile(join(work, 'mp4', 'all.m3u8'), `#EXTM3U\n#EXT-X-VERSION:7\n${variant('person', 'av01.0.04M.08')}${variant('person.h264', 'avc3.64000d')}`);
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: work }).start();
    browser = await launch();
});

after(async () => {
    await browser?.close();
    server?.stop();
    if (work) await rm(work, { recursive: true });
});

// A browser that refuses codecs that begin so, in pages and workers.
async function pageWithout(refused) {
    const page = await browser.newPage({ viewport: { width: 240, height: 240 } });
    const refuse = `if (globalThis.VideoDecoder) {
        const really = VideoDecoder.isConfigSupported;
        VideoDecoder.isConfigSupported = async (config) => (${JSON.stringify(refused)}.some((one) => config.codec.startsWith(one)) ? { supported: false } : really.call(VideoDecoder, config));
    }\n`;
    await page.addInitScript(refuse);
    await page.route('**/htvm-worker.js', async (route) => {
        const response = await route.fetch();
        await route.fulfill({ response, body: refuse + (await response.text()) });
    });
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction('window.ready');
    return page;
}

// What is shown of a stream at three times, and by which coder.
async function look(refused, src) {
    const page = await pageWithout(refused);
    const faults = [];
    page.on('pageerror', (error) => faults.push(error.message));
    try {
        const out = await page.evaluate(async (src) => {
            const pixels = async () => {
                const bitmap = await createImageBitmap(await test.player.screenshot());
                const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
                context.drawImage(bitmap, 0, 0);
                return [...context.getImageData(0, 0, bitmap.width, bitmap.height).data];
            };
            await test.open({ src, orbit: '0 0' });
            const shown = [await pixels()];
            for (const frame of [17, 4]) {
                await test.seek((frame + 0.4) / 30);
                shown.push(await pixels());
            }
            const lines = test.frames.filter(({ preview }) => !preview).map(({ line }) => line);
            return { shown, lines: [lines.at(0), ...lines.slice(-2)], coder: test.player.statistics.pictures?.coder ?? null, notices: test.notices };
        }, `/as-is/${src}`);
        assert.deepEqual(faults, []);
        return out;
    } finally {
        await page.close();
    }
}

const meanError = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;

for (const [what, refused, src, coder] of [
    ['where AV1 is refused, the sibling of VP9 is shown', ['av01'], 'both/person.htvm', 'VP9'],
    ['where VP9 is refused as well, that of H.264', ['av01', 'vp09'], 'both/person.htvm', 'H.264'],
    ['where there is only that of H.264, it', ['av01'], 'h264/person.htvm', 'H.264'],
    ['an .mp4 beside an .mp4', ['av01'], 'mp4/person.mp4', 'H.264'],
    ['of a list of playlists the qualities that can be decoded', ['av01'], 'mp4/all.m3u8', 'H.264'],
])
    test(`${what}: each frame as with the stream's own pictures, and nothing is said`, options, async () => {
        const own = await look([], src);
        assert.deepEqual([own.coder, own.notices], ['AV1', []]);
        const other = await look(refused, src);
        assert.deepEqual([other.coder, other.notices], [coder, []]);
        assert.deepEqual(other.lines, own.lines);
        for (const [i, pixels] of own.shown.entries()) {
            const error = meanError(pixels, other.shown[i]);
            assert.ok(error < 1.5, `picture ${i}: ${error}`);
        }
    });

test('where no sibling is there, the meshes are shown, and words say what is missing', options, async () => {
    const { coder, lines, notices } = await look(['av01'], 'alone/person.htvm');
    assert.equal(coder, null);
    assert.equal(lines.length, 3);
    assert.match(notices.join(' '), /^The pictures of this stream, AV1, cannot be shown here: this browser has no decoder for av01\S+\.$/);
    assert.ok(server.requests.some(({ path: asked }) => asked.endsWith('alone/person.h264.htvm')));
});
