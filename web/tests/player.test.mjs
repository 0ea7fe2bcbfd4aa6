// <htvm-player> in Chromium: one browser, a page of its own for each test, and a clock that stands still between the
// pictures, so that nothing waits for time to pass.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { conformance, digests, firstSequence, folder, packet, packetsOf, padded, withLittleMemory } from './streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const dist = path('../packages/player/dist');
const roots = { '': path('pages'), player: dist, streams: folder };
const policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self' http:; img-src 'self'";

let browser, server, other;
let expected; // the frames of long-*.htvm

before(async () => {
    server = await new TestServer(roots).start();
    server.pageHeaders = { 'Content-Security-Policy': policy };
    other = await new TestServer(roots).start();
    browser = await launch();
    const stream = firstSequence(await conformance('tracked_by_chance'));
    for (const index of ['front', 'end', 'none']) server.made.set(`long-${index}.htvm`, padded(stream, 120000, index));
    expected = (await digests('tracked_by_chance')).slice(0, packetsOf(stream).length - 1);
    for (const [name, stream] of server.made) other.made.set(name, stream);
});

after(async () => {
    await browser?.close();
    server?.stop();
    other?.stop();
});

// A test with a page. What the page says in its console is kept for messages.
function inPage(name, body, options = {}) {
    test(name, { timeout: 60000 }, async () => {
        const page = await browser.newPage({ viewport: { width: 400, height: 300 }, ...options });
        const faults = [];
        page.on('pageerror', (error) => faults.push(error.message));
        server.requests.length = 0;
        other.requests.length = 0;
        try {
            await page.goto(`${server.origin}/page.html`);
            await page.waitForFunction('window.ready');
            await body(page);
            assert.deepEqual(faults, []);
        } finally {
            await page.close();
        }
    });
}

const open = (page, src, attributes = {}) => page.evaluate((all) => test.open(all), { src, ...attributes });
const seek = (page, seconds) => page.evaluate((at) => test.seek(at), seconds);
const lines = (page) => page.evaluate(() => test.frames.map(({ line }) => line));
const failure = (page) => page.evaluate(() => test.player.error);
const lastLine = async (page) => (await lines(page)).at(-1);

for (const name of ['tracked', 'person', 'paper', 'moving', 'fine_lattice', 'no_skeleton_all_attributes', 'corner_cases_intra',
    'rate_controlled', 'awkward_moving', 'tracked_2', 'sequences_2', 'tracked_3', 'sequences_3', 'presence_7'])
    inPage(`${name}: what is on the graphics card, frame by frame, is what the native decoder decodes`, async (page) => {
        assert.deepEqual(await page.evaluate((src) => test.playAll({ src }), `/as-is/${name}.htvm`), await digests(name));
        assert.deepEqual(await page.evaluate(() => test.events), ['loadedmetadata', 'seeked', 'play', 'pause', 'ended']);
    });

inPage('a long file plays by ranges, the first of which is enough to begin', async (page) => {
    await open(page, '/as-is/long-end.htvm');
    assert.equal(await lastLine(page), expected[0]);
    assert.equal(server.requests.find(({ path }) => path.endsWith('.htvm')).range, 'bytes=0-262143');
    const all = await page.evaluate(async () => {
        test.player.play();
        await test.run();
        return test.frames.map(({ line }) => line);
    });
    assert.deepEqual(all, expected);
    const streams = server.requests.filter(({ path }) => path.endsWith('.htvm'));
    assert.ok(streams.every(({ range }) => range), 'every request is for a range');
    assert.equal(await page.evaluate(() => Math.round(test.player.duration * 30)), all.length);
});

for (const [index, where] of [['front', 'in front'], ['end', 'at the end']])
    inPage(`seeks by the index ${where}: the exact frame, without what lies between`, async (page) => {
        await open(page, `/as-is/long-${index}.htvm`);
        await page.waitForFunction(() => test.player.duration > 2);
        const before = server.requests.length;
        for (const number of [50, 11, 64, 3, 49]) {
            const shown = await seek(page, (number + (number % 2 ? 0.9 : 0)) / 30); // the frame that is shown then in playing
            assert.equal(shown.at(-1).line, expected[number]);
            assert.ok(shown.length <= 2 && shown.slice(0, -1).every(({ preview }) => preview));
        }
        const starts = server.requests.slice(before).map(({ range }) => Number(/=(\d+)/.exec(range)[1]));
        const there = starts.findIndex((start) => start > 5500000 && start < 6200000);
        assert.ok(there === 0 || there === 1, `what was sought is asked for at once: ${starts}`);
    });

inPage('seeks without an index, ranges or a known size read on to the frame', async (page) => {
    await open(page, '/no-ranges/long-none.htvm');
    for (const number of [40, 5, 62]) assert.equal((await seek(page, (number + 0.4) / 30)).at(-1).line, expected[number]);
});

inPage('a seek decodes only what its frame needs', async (page) => {
    // The I-frame so often that nothing behind it is decoded ahead, then the stream; all its EP-frames but the last would be
    // errors.
    const [header, ...packets] = packetsOf(await conformance('paper')).filter(({ kind }) => kind !== 5);
    const before = 20;
    const later = ({ kind, bytes, frame, reference, timestampUs, flags }, by, payload = bytes.slice(32, -4)) =>
        packet(kind, payload, { frame: frame + by, reference: reference + by, timestampUs: timestampUs + Math.round((by * 1e6) / 30), flags });
    const intra = packets.find(({ kind }) => kind === 2);
    const last = packets.findLast(({ kind }) => kind === 3);
    const stream = [header.bytes, ...Array.from({ length: before }, (_, i) => later(intra, i))];
    for (const one of packets) stream.push(one.kind === 3 && one !== last ? later(one, before, new Uint8Array(40)) : later(one, before));
    server.made.set('errors.htvm', new Uint8Array(Buffer.concat(stream)));
    await open(page, '/as-is/errors.htvm');
    const number = before + last.frame;
    const shown = await seek(page, (number + 0.4) / 30);
    const wanted = (await digests('paper')).find((line) => line.startsWith(`${last.frame} `));
    assert.equal(shown.at(-1).line, wanted.replace(/^\d+/, number));
    assert.deepEqual(await page.evaluate(() => test.notices), []);
});

inPage('an index that names wrong places is dropped', async (page) => {
    const stream = padded(firstSequence(await conformance('tracked_by_chance')), 4000, 'front');
    const header = packetsOf(stream)[0].size;
    server.made.set('wrong.htvm', new Uint8Array(Buffer.concat([stream.subarray(0, header), packet(99, new Uint8Array(50)), stream.subarray(header)])));
    await open(page, '/as-is/wrong.htvm');
    assert.equal((await seek(page, 52.4 / 30)).at(-1).line, expected[52]);
});

inPage('a newer seek overtakes an older one', async (page) => {
    await open(page, '/as-is/long-end.htvm');
    await page.evaluate(() => {
        for (const number of [60, 20, 40, 55, 33]) test.player.currentTime = (number + 0.4) / 30;
        return test.player.idle();
    });
    assert.equal(await lastLine(page), expected[33]);
});

inPage('by single frames, forth and back', async (page) => {
    const expected = await digests('tracked');
    await open(page, '/as-is/tracked.htvm');
    for (const direction of [1, 1, -1, 1, 1, -1, -1]) await page.evaluate((by) => test.player.step(by), direction);
    assert.deepEqual(await lines(page), [0, 1, 2, 1, 2, 3, 2, 1].map((number) => expected[number]));
});

inPage('plays in a loop without a gap, and in bounded memory, 300 times', async (page) => {
    await open(page, '/as-is/tracked.htvm', { loop: '', autoplay: '' });
    const frames = await digests('tracked');
    // Gives the lines of the frames shown.
    const loops = (count) =>
        page.evaluate(async (pictures) => {
            const lines = [];
            for (let i = 0; i < pictures; ++i) {
                test.clock.advance(1000 / 30);
                await test.player.idle();
                lines.push(...test.frames.splice(0).map(({ line }) => line));
            }
            return lines;
        }, count * frames.length);
    const measure = () =>
        page.evaluate(() => {
            gc();
            gc();
            const { wasmBytes, geometries, textures, heldBytes } = test.player.statistics;
            return { wasmBytes, geometries, textures, heldBytes, heap: performance.memory.usedJSHeapSize };
        });
    const shown = await loops(20);
    const at = frames.indexOf(shown[0]);
    assert.ok(shown.length >= 118);
    assert.deepEqual(shown, shown.map((_, i) => frames[(at + i) % frames.length]));
    const early = await measure();
    await page.evaluate(async (pictures) => {
        for (let i = 0; i < pictures; ++i) {
            test.clock.advance(1000 / 30);
            await test.player.idle();
            test.frames.length = 0;
        }
    }, 280 * frames.length);
    const late = await measure();
    assert.ok(late.heap < early.heap + 1e6, `the heap grows from ${early.heap} to ${late.heap}`);
    assert.deepEqual({ ...late, heap: 0 }, { ...early, heap: 0 });
});

inPage('triangles are uploaded once for each topology', async (page) => {
    await page.evaluate(() => test.playAll({ src: '/as-is/tracked.htvm' }));
    const intra = (await digests('tracked')).filter((line) => line.includes(' I ')).length;
    assert.equal(await page.evaluate(() => test.player.statistics.indexUploads), intra);
});

inPage('speed: half takes twice as long, twice shows every second frame in half the time', async (page) => {
    await open(page, '/as-is/tracked_by_chance.htvm');
    const run = (rate, milliseconds) =>
        page.evaluate(async ([by, time]) => {
            await test.seek(0);
            test.player.playbackRate = by;
            const before = test.frames.length;
            test.player.play();
            await test.run(time, 1000 / 30);
            test.player.pause();
            return { time: test.player.currentTime, shown: test.frames.slice(before).map(({ frame }) => frame) };
        }, [rate, milliseconds]);
    const half = await run(0.5, 2000);
    assert.ok(Math.abs(half.time - 1) < 0.01, `${half.time}`);
    assert.deepEqual(half.shown.slice(0, 29), Array.from({ length: 29 }, (_, i) => i + 1));
    const twice = await run(2, 1000);
    assert.ok(Math.abs(twice.time - 2) < 0.01, `${twice.time}`);
    assert.ok(twice.shown.length <= 31 && twice.shown.length >= 28);
    await page.evaluate(() => (test.player.playbackRate = 9));
    assert.equal(await page.evaluate(() => test.player.playbackRate), 2);
});

inPage('a hidden tab stops decoding, and comes back in step', async (page) => {
    await open(page, '/as-is/long-end.htvm', { autoplay: '' });
    await page.evaluate(() => test.run(500));
    const hidden = await page.evaluate(async () => {
        test.setVisibility('hidden');
        const before = test.frames.length;
        test.clock.advance(1000);
        await test.player.idle();
        return test.frames.length - before;
    });
    assert.equal(hidden, 0);
    await page.evaluate(async () => {
        test.setVisibility('visible');
        await test.player.idle();
    });
    assert.equal(await lastLine(page), expected[45]); // 0.5 + 1 seconds at 30 frames a second
});

// ---- what goes wrong --------------------------------------------------------------------------------------------

for (const [what, src, code, words] of [
    ['a missing file', '/as-is/nowhere.htvm', 'missing', /no file at .*nowhere.*404/],
    ['an empty file', '/as-is/empty.htvm', 'empty', /empty/],
    ['a web page in its place', '/page.html', 'not-htvm', /not an htvm stream.*web page/],
    ['noise', '/as-is/noise.htvm', 'not-htvm', /not an htvm stream/],
    ['a later version', '/as-is/later.htvm', 'version', /version.*\b99\b/],
    ['frames without a header', '/as-is/headless.htvm', 'decoder', /Nothing of this stream can be shown/],
])
    inPage(`${what} is told in words, on the page and to the program`, async (page) => {
        server.made.set('empty.htvm', new Uint8Array(0));
        server.made.set('noise.htvm', Uint8Array.from({ length: 600000 }, (_, i) => (i * i * 2654435761) >>> 23));
        const packets = packetsOf(await conformance('tracked'));
        const later = packets[0].bytes.slice(32, -4);
        later[4] = 99;
        server.made.set('later.htvm', new Uint8Array(Buffer.concat([packet(1, later), packets[1].bytes])));
        server.made.set('headless.htvm', new Uint8Array(Buffer.concat(packets.slice(1).map(({ bytes }) => bytes))));
        await open(page, src);
        const error = await failure(page);
        assert.equal(error.code, code);
        assert.match(error.message, words);
        assert.equal(await page.getByRole('alert').textContent(), `This cannot be played${error.message}`);
        assert.ok((await page.evaluate(() => test.events)).includes('error'));
        await open(page, '/as-is/tracked.htvm');
        assert.equal(await failure(page), null);
    });

inPage('a file that is cut off plays as far as it is whole, and says so', async (page) => {
    const shown = await page.evaluate(() => test.playAll({ src: '/cut/tracked_by_chance.htvm' }));
    const all = await digests('tracked_by_chance');
    assert.ok(shown.length > 50 && shown.length < all.length);
    assert.deepEqual(shown, all.slice(0, shown.length));
    assert.match((await page.evaluate(() => test.notices)).join(), /cut off/);
});

inPage('damage costs what it touches', async (page) => {
    const stream = new Uint8Array(await conformance('tracked_by_chance'));
    const victim = packetsOf(stream).find(({ kind, frame }) => kind === 7 && frame > 20);
    stream[victim.offset + 60] ^= 255;
    server.made.set('damaged.htvm', stream);
    const shown = await page.evaluate(() => test.playAll({ src: '/as-is/damaged.htvm' }));
    const all = await digests('tracked_by_chance');
    assert.ok(shown.length >= all.length - 5 && shown.length < all.length);
    assert.ok(shown.every((line) => all.includes(line)));
});

inPage('a frame that claims to be vast is refused, and the rest plays', async (page) => {
    const packets = packetsOf(await conformance('tracked'));
    const vast = Uint8Array.from({ length: 300000 }, (_, i) => i & 255);
    vast.set([1, 1, 0xff, 0xff, 0xff, 0x07, 0xff, 0xff, 0xff, 0x07, 1, 1, 0, 0, 0, 0]); // 2^24 vertices and triangles
    const stream = [packets[0].bytes, packet(2, vast, { frame: 0 }), ...packets.slice(1).map(({ bytes }) => bytes)];
    server.made.set('vast.htvm', new Uint8Array(Buffer.concat(stream)));
    const shown = await page.evaluate(() => test.playAll({ src: '/as-is/vast.htvm' }));
    assert.deepEqual(shown, await digests('tracked'));
    assert.ok((await page.evaluate(() => test.player.statistics.wasmBytes)) < 64e6);
});

inPage('a decoder that stops is started again, a few times, and then it is told in words', async (page) => {
    server.made.set('little.wasm', withLittleMemory(await readFile(`${dist}/htvm_decoder.wasm`), 4));
    await page.evaluate(() => (test.HtvmPlayerElement.decoderUrl = '/as-is/little.wasm'));
    await open(page, '/as-is/tracked_by_chance.htvm');
    const error = await failure(page);
    assert.equal(error?.code, 'decoder');
    assert.match(error.message, /memory/);
    assert.ok((await page.evaluate(() => test.notices)).some((text) => /started again/.test(text)));
});

// ---- servers ----------------------------------------------------------------------------------------------------

for (const manner of ['no-ranges', 'gzip'])
    inPage(`plays from a server with manners "${manner}"`, async (page) => {
        const shown = await page.evaluate((src) => test.playAll({ src }), `/${manner}/long-end.htvm`);
        assert.deepEqual(shown, expected);
        assert.equal(server.requests.filter(({ path }) => path.endsWith('.htvm')).length, 1);
    });

inPage('a body that never ends plays as it comes, as of a live stream', async (page) => {
    await open(page, '/endless/long-none.htvm', { autoplay: '' });
    const play = (until) => page.evaluate(async (what) => {
        while (what === 'waiting' ? !test.events.includes('waiting') : test.frames.length < what) {
            test.clock.advance(15);
            await new Promise((resolve) => setTimeout(resolve));
        }
        return test.frames.map(({ line }) => line);
    }, until);
    const half = await play('waiting');
    assert.ok(half.length > 20 && half.length < 45, `${half.length} frames`);
    assert.deepEqual(half, expected.slice(0, half.length));
    assert.ok(Number.isNaN(await page.evaluate(() => test.player.duration)));
    server.release();
    const whole = await play(expected.length);
    assert.deepEqual(whole, expected);
});

inPage('a policy that forbids WebAssembly is an error that says what to allow', async (page) => {
    await page.route('**/htvm-worker.js', async (route) => {
        const response = await route.fetch();
        await route.fulfill({ response, headers: { ...response.headers(), 'Content-Security-Policy': "script-src 'self'" } });
    });
    await open(page, '/as-is/tracked.htvm');
    const error = await failure(page);
    assert.equal(error.code, 'decoder');
    assert.match(error.message, /wasm-unsafe-eval/);
});

inPage('plays from another site that allows it, which shows pages no special headers', async (page) => {
    other.streamHeaders = { 'Access-Control-Allow-Origin': '*' };
    for (const index of ['front', 'end']) {
        const src = `${other.origin}/as-is/long-${index}.htvm`;
        await open(page, src);
        await page.waitForFunction(() => test.player.duration > 2);
        assert.equal((await seek(page, 57.4 / 30)).at(-1).line, expected[57]);
        await page.evaluate(async () => {
            test.player.play();
            await test.run();
        });
        assert.equal(await lastLine(page), expected.at(-1));
    }
    assert.ok(other.requests.every(({ method }) => method !== 'OPTIONS'), 'no request that asks for permission first');
});

inPage('another site that does not allow it is an error in words', async (page) => {
    other.streamHeaders = {};
    await open(page, `${other.origin}/as-is/tracked.htvm`);
    const error = await failure(page);
    assert.equal(error.code, 'network');
    assert.match(error.message, /CORS/);
});

inPage('a file that is replaced while it plays is played anew from there', async (page) => {
    server.replace('long-end.htvm');
    await open(page, '/changing/long-end.htvm');
    server.made.set('other.htvm', padded(firstSequence(await conformance('tracked_by_chance')), 130000, 'end'));
    server.replace('other.htvm');
    const shown = await seek(page, 60.4 / 30);
    assert.equal(await failure(page), null);
    assert.equal(shown.at(-1)?.line, expected[60]);
    assert.match((await page.evaluate(() => test.notices)).join(), /replaced/);
});

inPage('the scripts may come from another site', async (page) => {
    const scripts = await new TestServer(roots).start();
    try {
        await page.route(`${scripts.origin}/**`, async (route) => {
            const response = await route.fetch();
            await route.fulfill({ response, headers: { ...response.headers(), 'Access-Control-Allow-Origin': '*' } });
        });
        await page.evaluate((origin) => {
            test.HtvmPlayerElement.workerUrl = `${origin}/player/htvm-worker.js`;
            test.HtvmPlayerElement.decoderUrl = `${origin}/player/htvm_decoder.wasm`;
        }, scripts.origin);
        server.pageHeaders = {};
        assert.deepEqual(await page.evaluate(() => test.playAll({ src: '/as-is/tracked.htvm' })), await digests('tracked'));
    } finally {
        scripts.stop();
    }
}, { bypassCSP: true });

inPage('examples/scene.js shows a stream in a scene of its own', async (page) => {
    const { outputFiles } = await build({
        entryPoints: [path('../examples/scene.js')], bundle: true, format: 'esm', write: false, logLevel: 'error',
        nodePaths: [path('../node_modules')],
    });
    server.made.set('scene.js', outputFiles[0].contents);
    server.streamHeaders = { 'Content-Type': 'text/javascript' };
    const uploads = await page.evaluate(async () => {
        const { showStream } = await import('/as-is/scene.js');
        const canvas = document.createElement('canvas');
        document.body.append(canvas);
        const mesh = await showStream(canvas, '/as-is/tracked.htvm', '/player/htvm_decoder.wasm');
        while (mesh.uploads.positions < 12) await new Promise(requestAnimationFrame);
        return mesh.uploads;
    });
    server.streamHeaders = {};
    assert.ok(uploads.indices < uploads.positions);
});

// ---- pictures and people ----------------------------------------------------------------------------------------

const picture = (page) => page.evaluate(async () => {
    const bytes = new Uint8Array(await (await test.player.screenshot()).arrayBuffer());
    return bytes.reduce((text, byte) => text + String.fromCharCode(byte), '');
});

inPage('a graphics context that is lost comes back', async (page) => {
    await open(page, '/as-is/tracked.htvm');
    const before = await picture(page);
    await page.evaluate(async () => {
        const canvas = test.player.shadowRoot.querySelector('canvas');
        const extension = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
        const restored = new Promise((resolve) => canvas.addEventListener('webglcontextrestored', resolve));
        const lost = new Promise((resolve) => canvas.addEventListener('webglcontextlost', resolve));
        extension.loseContext();
        await lost;
        await new Promise((resolve) => setTimeout(resolve)); // it may be restored once the event is over
        extension.restoreContext();
        await restored;
        await test.player.idle();
    });
    assert.ok(before === (await picture(page)));
});

inPage('the mouse, keys and two fingers turn, move and near the view; 0 goes back', async (page) => {
    await open(page, '/as-is/tracked.htvm');
    const box = await page.locator('htvm-player').boundingBox();
    const middle = [box.x + box.width / 2, box.y + box.height / 2];
    const home = await picture(page);
    const changes = async (action) => {
        const before = await picture(page);
        await action();
        await page.evaluate(() => test.player.idle());
        assert.ok(before !== (await picture(page)), `${action}`);
    };
    await changes(async () => {
        await page.mouse.move(...middle);
        await page.mouse.down();
        await page.mouse.move(middle[0] + 60, middle[1] + 10);
        await page.mouse.up();
    });
    await changes(() => page.mouse.wheel(0, -300));
    for (const key of ['ArrowLeft', 'Shift+ArrowUp', '-']) await changes(() => page.keyboard.press(key));
    await changes(() =>
        page.evaluate(() => {
            const canvas = test.player.shadowRoot.querySelector('canvas');
            const send = (type, pointerId, clientX, clientY) =>
                canvas.dispatchEvent(new PointerEvent(type, { pointerId, clientX, clientY, pointerType: 'touch', bubbles: true }));
            send('pointerdown', 11, 100, 100);
            send('pointerdown', 12, 200, 100);
            send('pointermove', 12, 300, 100);
            send('pointerup', 11, 100, 100);
            send('pointerup', 12, 300, 100);
        }),
    );
    await page.keyboard.press('0');
    await page.evaluate(() => test.player.idle());
    assert.ok(home === (await picture(page)));
});

inPage('controls have names, say their state, and do what they say', async (page) => {
    await open(page, '/as-is/tracked_by_chance.htvm', { controls: '', label: 'A person who waves' });
    assert.equal(await page.getByRole('img', { name: 'A person who waves' }).count(), 1);
    const click = async (name) => {
        await page.getByRole('button', { name }).click();
        await page.evaluate(() => test.player.idle());
    };
    await page.setViewportSize({ width: 900, height: 500 });
    await page.evaluate(() => Object.assign(test.player.style, { width: '880px', height: '480px' }));
    await click('Play (Space)');
    assert.equal(await page.evaluate(() => test.player.paused), false);
    await click('Pause (Space)');
    assert.equal(await page.evaluate(() => test.player.paused), true);
    await click(/again and again/);
    assert.equal(await page.evaluate(() => test.player.loop), true);
    assert.equal(await page.getByRole('button', { name: /again and again/ }).getAttribute('aria-pressed'), 'true');
    await click('One frame on (.)');
    assert.equal(await page.evaluate(() => test.frames.at(-1).frame), 1);
    await page.getByRole('combobox', { name: 'Speed' }).selectOption('0.5');
    assert.equal(await page.evaluate(() => test.player.playbackRate), 0.5);
    await page.getByRole('slider', { name: 'Position' }).fill('500');
    await page.evaluate(() => test.player.idle());
    assert.ok(Math.abs((await page.evaluate(() => test.player.currentTime)) - 97.5 / 30) < 0.1);
    await click('Statistics (S)');
    await page.evaluate(() => test.player.step(1));
    assert.match(await page.locator('htvm-player pre').textContent(), /vertices[^]*Mbit\/s[^]*geometry/);
    assert.equal(await page.getByRole('button', { name: 'Enter VR' }).count(), 0);
    await click('Full screen (F)');
    assert.equal(await page.evaluate(() => document.fullscreenElement === test.player), true);
});

inPage('where elements have no full screen, the player takes the whole window', async (page) => {
    await page.evaluate(() => (Element.prototype.requestFullscreen = undefined));
    await open(page, '/as-is/tracked.htvm', { controls: '' });
    await page.locator('htvm-player').press('f');
    assert.deepEqual(await page.evaluate(() => [test.player.clientWidth, test.player.clientHeight]), [400, 300]);
    await page.locator('htvm-player').press('Escape');
    assert.deepEqual(await page.evaluate(() => [test.player.clientWidth, test.player.clientHeight]), [320, 240]);
});

inPage('a button for VR is there where the browser has WebXR', async (page) => {
    await page.evaluate(() =>
        Object.defineProperty(navigator, 'xr', { value: { isSessionSupported: async (mode) => mode === 'immersive-vr' }, configurable: true }));
    await open(page, '/as-is/tracked.htvm', { controls: '' });
    assert.equal(await page.getByRole('button', { name: 'Enter VR' }).count(), 1);
});

inPage('the poster is there until the first frame is', async (page) => {
    const poster = 'data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7';
    const shown = () => page.evaluate(() => !test.player.shadowRoot.querySelector('img').hidden);
    const opened = open(page, '/slow/tracked.htvm', { poster });
    await page.waitForFunction(() => test.player);
    assert.equal(await shown(), true);
    while (!server.requests.some(({ path }) => path.startsWith('slow/'))) await page.evaluate(() => test.player.statistics);
    server.release();
    await opened;
    assert.equal(await shown(), false);
});

