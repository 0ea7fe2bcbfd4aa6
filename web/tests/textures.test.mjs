// Texture pictures: what is read of a packet, how they are decoded, and in Chromium, that each frame is shown with its own picture.
// HTVM names the program that makes the meshes.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { codecDescription, codecString, isAccess, isFrame, isKeyPicture, packetKind, readPicture } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';
import { LiveHub, Publishing } from './live_hub.mjs';
import { TestServer } from './server.mjs';
import { packet, packetsOf } from './streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 120000 };
const frames = 30;
const coders = { AV1: 1, VP9: 2, PNG: 16, JPEG: 17, WebP: 18 };

const leb = (value) => (value < 128 ? [value] : [(value & 127) | 128, ...leb(value >> 7)]);

function picturePayload({ coder, bytes, matrix = 17, width = 128, height = 128, gains = [4096, 4096, 4096] }) {
    const colour = coders[coder] < 16 ? matrix : 0;
    return Uint8Array.from([coders[coder] ?? coder, colour, ...leb(width), ...leb(height), ...gains.flatMap((gain) => [gain & 255, gain >> 8]), ...bytes]);
}

const picturePacket = (picture, place) => ({ kind: packetKind.texture, ...place, bytes: packet(packetKind.texture, picturePayload(picture), place) });

// ---- packets ----------------------------------------------------------------------------------------------------------

test('a picture is read, and what is malformed is not', () => {
    const whole = { coder: 'AV1', bytes: [1, 2, 3], matrix: 6 + 16, width: 1024, height: 4096, gains: [4096, 2048, 65535] };
    const read = readPicture(picturePacket(whole, {}));
    assert.deepEqual({ ...read, coded: [...read.coded] }, {
        coder: 'AV1', matrix: 'smpte170m', fullRange: true, width: 1024, height: 4096, gains: [1, 0.5, 65535 / 4096], coded: [1, 2, 3],
    });
    assert.equal(readPicture(picturePacket({ ...whole, coder: 'PNG' }, {})).matrix, null);
    const payload = picturePayload(whole);
    for (let size = 0; size < payload.length - 2; ++size)
        assert.equal(readPicture({ kind: 12, bytes: packet(12, payload.slice(0, size)) }), null, `${size} bytes`);
    for (const wrong of [{ coder: 4 }, { matrix: 2 }, { width: 0 }, { height: 4097 }, { width: 128 * 128 }])
        assert.equal(readPicture(picturePacket({ ...whole, ...wrong }, {})), null, JSON.stringify(wrong));
});

// Numbers of so many bits, as bytes.
function bits(...numbers) {
    const text = numbers.map(([value, count]) => value.toString(2).padStart(count, '0')).join('');
    return text.padEnd(Math.ceil(text.length / 8) * 8, '0').match(/.{8}/g).map((byte) => parseInt(byte, 2));
}

test('the names that browsers have for codecs are told from key pictures', () => {
    const name = (coder, coded, width = 1024, height = 1024) => codecString({ coder, coded: Uint8Array.from(coded), width, height });
    const obu = (type, payload) => [type * 8 + 2, ...leb(payload.length), ...payload];
    const plain = bits([0, 3], [0, 1], [0, 1], [0, 1], [0, 1], [0, 5], [0, 12], [8, 5], [0, 1]);
    assert.equal(name('AV1', [...obu(2, []), ...obu(1, plain), ...obu(6, [1, 2])]), 'av01.0.08M.08');
    const timed = bits([0, 3], [0, 1], [0, 1], [1, 1], [1, 32], [30, 32], [1, 1], [1, 3], [1, 2], [1, 1], [0, 47], [0, 1], [0, 5], [0, 12], [13, 5], [1, 1]);
    assert.equal(name('AV1', obu(1, timed)), 'av01.0.13H.08');
    assert.equal(name('AV1', obu(1, bits([0, 3], [1, 1], [1, 1], [4, 5]))), 'av01.0.04M.08');
    assert.equal(name('AV1', obu(1, bits([1, 3], [1, 1], [1, 1], [4, 5]))), null); // another profile
    assert.equal(name('AV1', obu(6, [1, 2])), null);
    assert.equal(name('AV1', [10, 200]), null);
    assert.equal(name('AV1', [10, 255, 255, 255, 255, 255, 255]), null);
    assert.equal(name('AV1', []), null);
    assert.equal(name('VP9', [0x82]), 'vp09.00.40.08');
    assert.equal(name('VP9', [0x82], 4096, 4096), 'vp09.00.60.08');
    assert.equal(name('VP9', [0x82], 128, 128), 'vp09.00.10.08');
    assert.equal(name('VP9', [0x92]), null);
    assert.equal(name('VP9', [0x00]), null);
});

test('the name and the description of H.264 are told from the parameter sets of key pictures', () => {
    const unit = (...bytes) => [0, 0, 0, bytes.length, ...bytes];
    const told = (...units) => {
        const coded = Uint8Array.from(units.flat());
        const description = codecDescription({ coder: 'H.264', coded });
        return [codecString({ coder: 'H.264', coded, width: 64, height: 64 }), description && [...description]];
    };
    const [sequence, picture, slice] = [unit(0x67, 77, 0x40, 0x1f, 9), unit(0x68, 5), unit(0x65, 1, 2, 3)];
    const record = [1, 77, 0x40, 0x1f, 0xff, 0xe1, 0, 5, 0x67, 77, 0x40, 0x1f, 9, 1, 0, 2, 0x68, 5];
    assert.deepEqual(told(sequence, picture, slice), ['avc1.4d401f', record]);
    const [name, high] = told(unit(0x67, 100, 0, 0x28), picture, slice);
    assert.deepEqual([name, high.slice(-4)], ['avc1.640028', [0xfd, 0xf8, 0xf8, 0]]);
    for (const wrong of [[slice], [sequence, slice], [unit(0x67, 110, 0, 0x28), picture], [unit(0x67, 77), picture], [sequence, picture, [0, 0]],
        [sequence, picture, [0, 0, 0, 9, 1]], [sequence, picture, [255, 255, 255, 255, 1]], [[0, 0, 0, 0], sequence, picture], []])
        assert.deepEqual(told(...wrong), [null, null], JSON.stringify(wrong));
    assert.equal(codecDescription({ coder: 'VP9', coded: Uint8Array.of(0x82) }), null);
});

// ---- decoding, with decoders that do what the test says ------------------------------------------------------------------

const { outputFiles } = await build({
    stdin: { contents: "export * from './pictures.ts';", resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm',
    platform: 'node', write: false, logLevel: 'error',
});
const { Pictures } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
const turn = () => new Promise((resolve) => setTimeout(resolve));

class FakeDecoder {
    static all = [];
    static supported = true;
    state = 'unconfigured';
    given = []; // numbers of pictures, keys as text
    configs = [];
    delayed = []; // not given out yet
    keepsBack = 0;
    needsKey = true;
    constructor(init) {
        this.init = init;
        FakeDecoder.all.push(this);
    }
    static async isConfigSupported(config) {
        return { supported: FakeDecoder.supported, config };
    }
    get decodeQueueSize() {
        return 0;
    }
    configure(config) {
        this.state = 'configured';
        this.needsKey = true;
        this.configs.push(config);
    }
    decode({ type, timestamp }) {
        assert.equal(this.state, 'configured');
        if (this.needsKey) assert.equal(type, 'key');
        this.needsKey = false;
        this.given.push(type === 'key' ? `key ${timestamp}` : timestamp);
        this.delayed.push(timestamp);
        if (FakeDecoder.fast) this.run();
    }
    run(all = false) {
        while (this.delayed.length > (all ? 0 : this.keepsBack)) this.init.output(image(this.delayed.shift()));
    }
    async flush() {
        this.run(true);
        this.needsKey = true;
    }
    reset() {
        this.state = 'unconfigured';
        this.delayed = [];
    }
    close() {
        this.state = 'closed';
    }
}

let open; // images that nobody closed
const image = (timestamp) => {
    const made = { timestamp, close: () => assert.ok(open.delete(made), 'closed twice') };
    open.add(made);
    return made;
};

function begin({ needed = () => true, fast = true, lacks = async () => false } = {}) {
    globalThis.VideoDecoder = FakeDecoder;
    globalThis.EncodedVideoChunk = class {
        constructor(init) {
            Object.assign(this, init);
        }
    };
    Object.assign(FakeDecoder, { all: [], supported: true, fast });
    open = new Set();
    const notices = [];
    const settled = [];
    const pictures = new Pictures({ settled: (id) => settled.push(id), isNeeded: needed, lacks, notice: (text) => notices.push(text) });
    const take = (frame, key = false, more = {}) =>
        pictures.add({
            type: 'picture', coder: 'VP9', matrix: 'bt709', fullRange: false, width: 128, height: 128, gains: [1, 1, 1], frame,
            reference: key ? frame : frame - 1, key, presentUs: frame * 33333, coded: Uint8Array.of(0x82), bytes: 50, ...more,
        });
    return { pictures, take, notices, settled };
}

test('decoding begins with a key picture, goes on in order, and waits for one where a picture is missing', async () => {
    const { pictures, take, notices } = begin();
    assert.equal(pictures.state(take(4)), 'gone');
    const [key, second] = [take(5, true), take(6)];
    await turn();
    assert.equal(pictures.state(key), 'ready');
    assert.equal(pictures.show(key).image.timestamp, key);
    assert.equal(pictures.show(key), null);
    assert.equal(pictures.state(key), 'ready');
    assert.equal(pictures.state(take(8)), 'gone'); // 7 is missing
    assert.equal(pictures.state(take(9)), 'gone');
    const again = take(10, true);
    await turn();
    assert.deepEqual(FakeDecoder.all[0].given, [`key ${key}`, second, `key ${again}`]);
    assert.equal(pictures.state(again), 'ready');
    assert.deepEqual(notices, []);
    const { colorSpace, codec } = FakeDecoder.all[0].configs[0];
    assert.deepEqual({ codec, ...colorSpace }, {
        codec: 'vp09.00.10.08', matrix: 'bt709', primaries: 'bt709', transfer: 'iec61966-2-1', fullRange: false,
    });
});

test('a few are decoded ahead, and what no frame shows is closed at once', async () => {
    const needed = new Set();
    const { pictures, take } = begin({ needed: (id) => needed.has(id) });
    const ids = Array.from({ length: 30 }, (_, i) => i + 1);
    for (const id of ids) needed.add(id);
    for (const frame of ids) assert.equal(take(frame, frame === 1), frame);
    await turn();
    assert.equal(open.size, 5);
    for (const id of ids.slice(0, 20)) {
        needed.delete(id);
        pictures.show(id).image.close();
        assert.ok(open.size <= 5);
    }
    needed.clear(); // as by a seek to a later frame
    needed.add(29);
    await turn();
    assert.deepEqual([...open].map(({ timestamp }) => timestamp), [21, 22, 23, 24, 25]);
    take(31); // whatever happens next closes them
    assert.deepEqual([...open].map(({ timestamp }) => timestamp), [29, 31]); // and the newest, which later frames may show
    pictures.jumped();
    assert.equal(open.size, 0);
    assert.equal(pictures.state(29), 'coming'); // it is another time
});

test('after a jump nothing of before is given out', async () => {
    const { pictures, take } = begin({ fast: false });
    take(1, true);
    await turn();
    const [decoder] = FakeDecoder.all;
    pictures.jumped();
    decoder.init.output(image(1)); // already on its way
    assert.equal(open.size, 0);
    const key = take(40, true);
    await turn();
    decoder.run();
    assert.equal(pictures.state(key), 'ready');
});

test('a decoder that keeps pictures back is given more, and at the end made to give out all', async () => {
    const { pictures, take } = begin({ fast: true });
    const key = take(1, true);
    await turn();
    const [decoder] = FakeDecoder.all;
    pictures.show(key).image.close();
    decoder.keepsBack = 3;
    const last = [take(2), take(3), take(4)].at(-1);
    assert.equal(pictures.state(last), 'coming');
    await new Promise((resolve) => setTimeout(resolve, 400));
    assert.equal(pictures.state(last), 'ready');
    for (const id of [2, 3, last]) pictures.show(id).image.close();
    decoder.keepsBack = 0;
    const next = take(5); // which needs the key picture and all behind it again
    assert.deepEqual(decoder.given.slice(-5), [`key ${key}`, 2, 3, last, next]);
    assert.equal(pictures.state(next), 'ready');
    pictures.show(next).image.close();
    assert.equal(open.size, 0);
});

test('where decoding is late, it goes on with the last key picture that is due', async () => {
    const { pictures, take } = begin({ fast: false });
    for (let frame = 1; frame <= 30; ++frame) take(frame, frame % 10 === 1);
    await turn();
    const [decoder] = FakeDecoder.all;
    assert.equal(decoder.given.length, 5);
    pictures.catchUp(25 * 33333);
    assert.equal(pictures.state(6), 'gone');
    assert.equal(pictures.state(20), 'gone');
    assert.equal(pictures.state(21), 'coming');
    decoder.run();
    for (const id of [1, 2, 3, 4, 5]) pictures.show(id).image.close();
    assert.deepEqual(decoder.given.slice(5), ['key 21', 22, 23, 24, 25]);
});

test('errors cost the pictures up to the next key picture; after three there are no pictures, and words say so', async () => {
    const { pictures, take, notices } = begin({ fast: false });
    for (let round = 0; round < 4; ++round) {
        const [key, delta] = [take(10 * round, true), take(10 * round + 1)];
        await turn();
        if (round < 3) FakeDecoder.all[round].init.error(new Error('it is broken'));
        assert.equal(pictures.state(key), 'gone');
        assert.equal(pictures.state(delta), 'gone');
    }
    assert.equal(FakeDecoder.all.length, 3);
    assert.match(notices.join(' '), /it is broken.*left out/);
    assert.equal(open.size, 0);
});

test('without a decoder for them pictures are left out, and words say why', async () => {
    const one = begin();
    FakeDecoder.supported = false;
    const key = one.take(1, true);
    await turn();
    assert.equal(one.pictures.state(key), 'gone');
    assert.deepEqual(one.notices, ['The pictures of this stream, VP9, cannot be shown here: this browser has no decoder for vp09.00.10.08.']);
    const other = begin();
    delete globalThis.VideoDecoder;
    assert.equal(other.pictures.state(other.take(1, true)), 'gone');
    assert.match(other.notices[0], /WebCodecs/);
});

test('where pictures come from elsewhere nothing is said, and another stream asks anew', async () => {
    const asked = [];
    const { pictures, take, notices } = begin({ lacks: async (coder) => asked.push(coder) === 1 });
    FakeDecoder.supported = false;
    const first = take(1, true);
    await turn();
    assert.deepEqual([pictures.state(first), notices, asked], ['coming', [], ['VP9']]);
    pictures.close();
    const second = take(1, true);
    await turn();
    assert.deepEqual([pictures.state(second), notices.length, asked], ['gone', 1, ['VP9', 'VP9']]);
});

// ---- in Chromium --------------------------------------------------------------------------------------------------------

let browser, server, work;
let meshes, ownMeshes; // streams: tracked, and with every frame's own connectivity

// Each frame has colours that no other near it has.
const colour = (frame, quarter) => [0, 1, 2].map((channel) => 40 + ((frame * (37 + 14 * channel) + quarter * 61 + channel * 97) % 176));
const coloursOf = (frame) => [0, 1, 2, 3].map((quarter) => colour(frame, quarter));
const quarters = [[0.42, 0.4], [0.58, 0.4], [0.42, 0.6], [0.58, 0.6]]; // of the square, in the player's picture

function assertShown(shown, expected, tolerance, what) {
    const most = Math.max(...shown.flatMap((rgb, i) => rgb.map((value, c) => Math.abs(value - expected[i][c]))));
    assert.ok(most <= tolerance, `${what}: ${JSON.stringify(shown)} is not ${JSON.stringify(expected)}`);
}

// A square of a metre that faces the viewer, and bends.
async function makeSquare(folder) {
    await mkdir(folder);
    const cells = 12;
    for (let frame = 0; frame < frames; ++frame) {
        const lines = [];
        for (let y = 0; y <= cells; ++y)
            for (let x = 0; x <= cells; ++x) {
                const bend = 30 * Math.sin((x / cells) * 3 + frame / 5);
                lines.push(`v ${(1000 * x) / cells} ${(1000 * y) / cells} ${bend.toFixed(3)}`, `vt ${x / cells} ${y / cells}`);
            }
        for (let y = 0; y < cells; ++y)
            for (let x = 0; x < cells; ++x) {
                const [a, b] = [y * (cells + 1) + x + 1, (y + 1) * (cells + 1) + x + 1];
                lines.push(`f ${a}/${a} ${a + 1}/${a + 1} ${b + 1}/${b + 1}`, `f ${a}/${a} ${b + 1}/${b + 1} ${b}/${b}`);
            }
        await writeFile(join(folder, `${String(frame).padStart(3, '0')}.obj`), `${lines.join('\n')}\n`);
    }
}

// Meshes with these pictures: a picture behind each frame but for those to be left out.
function withPictures(coder, pictures, { leaveOut = [], of = meshes, ...more } = {}) {
    const out = [];
    let before = 0;
    for (const one of packetsOf(of)) {
        if (one.kind === packetKind.index || one.kind === packetKind.frontIndex) continue;
        out.push(one.bytes);
        if (!isFrame(one.kind) || leaveOut.includes(one.frame)) continue;
        const { key, bytes } = pictures[one.frame];
        const { frame, timestampUs } = one;
        out.push(picturePacket({ coder, bytes, ...more }, { frame, reference: key ? frame : before, timestampUs, flags: key ? 131 : 129 }).bytes);
        before = frame;
    }
    return new Uint8Array(Buffer.concat(out));
}

let starts; // frames at which decoding can start
let pictures; // of each coder

const startsOf = (stream) => packetsOf(stream).filter((one) => isFrame(one.kind) && isAccess(one)).map(({ frame }) => frame);

before(async () => {
    if (!program) return;
    work = await mkdtemp(join(tmpdir(), 'htvm-textures-'));
    await makeSquare(join(work, 'capture'));
    const stream = join(work, 'square.htvm');
    const encode = async (...more) => {
        const words = ['encode', join(work, 'capture'), '--fps', '30', '--texture-as', 'coordinates', '-q', '60', ...more, '-o', stream];
        execFileSync(program, words, { stdio: 'pipe' });
        return readFile(stream);
    };
    meshes = await encode('--access-interval', '10');
    ownMeshes = await encode('--profile', 'topology', '--keyint', '300');
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist') }).start();
    server.pageHeaders = { 'Content-Security-Policy': "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self' ws:" };
    browser = await launch();
    const page = await newPage();
    const colours = Array.from({ length: frames }, (_, frame) => coloursOf(frame));
    pictures = {};
    starts = startsOf(meshes);
    const make = (coder, more) =>
        page.evaluate(([name, all, how]) => window.pictures.makePictures(name, all, how), [coder, colours, { keys: starts, ...more }]);
    for (const coder of ['VP9', 'AV1', 'PNG', 'JPEG', 'WebP']) pictures[coder] = await make(coder, {});
    pictures.own = await make('AV1', { keys: startsOf(ownMeshes) });
    pictures.limited = await make('VP9', { fullRange: false });
    await page.close();
    for (const coder of Object.keys(coders)) server.made.set(`${coder}.htvm`, withPictures(coder, pictures[coder]));
    server.made.set('limited.htvm', withPictures('VP9', pictures.limited, { matrix: 1 }));
});

after(async () => {
    await browser?.close();
    server?.stop();
    if (work) await rm(work, { recursive: true });
});

async function newPage(script) {
    const page = await browser.newPage({ viewport: { width: 400, height: 400 } });
    if (script) await page.addInitScript(script);
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction('window.ready');
    if (!script) await page.evaluate(() => import('/pictures.js'));
    return page;
}

function inPage(name, body, script) {
    test(name, options, async () => {
        const page = await newPage(script);
        const faults = [];
        page.on('pageerror', (error) => faults.push(error.message));
        try {
            await body(page);
            assert.deepEqual(faults, []);
        } finally {
            await page.close();
        }
    });
}

const openPlayer = (page, name) => page.evaluate((src) => test.open({ src, orbit: '0 0' }), `/as-is/${name}.htvm`);
const shown = (page) => page.evaluate((places) => window.pictures.coloursAt(test.player, places), quarters);
const last = (page) => page.evaluate(() => test.frames.at(-1).frame);
const counts = (page) => page.evaluate(() => ({ open: window.pictures.openPictures.size, all: window.pictures.openPictures.all }));

test('the stream has what is to be tested: places to start at, with key pictures, and frames between', options, () => {
    assert.ok(starts.length >= 3 && starts.length <= frames / 2, `${starts}`);
    for (const coder of ['VP9', 'AV1', 'limited']) assert.deepEqual(pictures[coder].flatMap(({ key }, i) => (key ? [i] : [])), starts);
});

for (const [coder, tolerance] of [['VP9', 6], ['AV1', 6], ['PNG', 2], ['JPEG', 6], ['WebP', 6]])
    inPage(`${coder}: every frame is shown with its own picture, upright, and every picture is closed`, async (page) => {
        await openPlayer(page, coder);
        assertShown(await shown(page), coloursOf(0), tolerance, 'at once');
        for (let frame = 1; frame < frames; ++frame) {
            await page.evaluate(() => test.player.step(1));
            assert.equal(await last(page), frame);
            assertShown(await shown(page), coloursOf(frame), tolerance, `frame ${frame}`);
        }
        for (const frame of [25, 4, 20, 19, 11]) {
            await page.evaluate((at) => test.seek(at), (frame + 0.4) / 30);
            assert.equal(await last(page), frame);
            assertShown(await shown(page), coloursOf(frame), tolerance, `frame ${frame}, sought`);
        }
        const { pictures } = await page.evaluate(() => test.player.statistics);
        assert.deepEqual([pictures.coder, pictures.width, pictures.height], [coder, 128, 128]);
        assert.ok(pictures.megabitsPerSecond > 0);
        await page.evaluate(() => test.player.remove());
        const { open, all } = await counts(page);
        assert.equal(open, 0);
        assert.equal(all > 0, coder === 'VP9' || coder === 'AV1');
        assert.deepEqual(await page.evaluate(() => test.notices), []);
    });

// Without a graphics card Chromium converts blue of BT.709's limited range with a factor that is 5 % too small.
inPage('VP9 of limited range', async (page) => {
    await openPlayer(page, 'limited');
    assertShown(await shown(page), coloursOf(0), 12, 'frame 0');
});

inPage('in playing and in a loop, mesh and picture change in the same drawing', async (page) => {
    await openPlayer(page, 'VP9');
    const wrong = await page.evaluate(async ([places, expected]) => {
        test.player.loop = true;
        test.player.play();
        const wrong = [];
        test.clock.advance(2); // timestamps are rounded
        for (let i = 0; i < 75; ++i) {
            test.clock.advance(1000 / 30);
            await test.player.idle();
            const { frame } = test.frames.at(-1);
            const colours = await window.pictures.coloursAt(test.player, places);
            if (colours.flat().some((value, c) => Math.abs(value - expected[frame].flat()[c]) > 6)) wrong.push([i, frame, colours]);
        }
        test.player.pause();
        return wrong;
    }, [quarters, Array.from({ length: frames }, (_, frame) => coloursOf(frame))]);
    assert.deepEqual(wrong, []);
    const order = await page.evaluate(() => test.frames.map(({ frame }) => frame));
    assert.ok(order.length >= 70, `${order}`);
    assert.ok((await counts(page)).open <= 6, JSON.stringify(await counts(page)));
});

inPage('a frame without a picture shows the last one; gains raise what is decoded', async (page) => {
    server.made.set('sparse.htvm', withPictures('PNG', pictures.PNG, { leaveOut: [3, 4, 5, 29], gains: [2048, 4096, 6144] }));
    await openPlayer(page, 'sparse');
    const raised = (frame) => coloursOf(frame).map(([red, green, blue]) => [red / 2, green, Math.min(255, 1.5 * blue)]);
    for (const [frame, picture] of [[2, 2], [4, 2], [5, 2], [6, 6], [29, 28]]) {
        await page.evaluate((at) => test.seek(at), (frame + 0.4) / 30);
        assert.equal(await last(page), frame);
        assertShown(await shown(page), raised(picture), 3, `frame ${frame}`);
    }
});

inPage('from afar a pixel is the mean of its texels, and not of what lies beyond the gutter of a chart', async (page) => {
    // Lines of one texel, and eight texels of grey between them and green: as two charts lie.
    const bytes = await page.evaluate(async () => {
        const canvas = new OffscreenCanvas(256, 256);
        const context = canvas.getContext('2d');
        const fill = (colour, from, width) => {
            context.fillStyle = colour;
            context.fillRect(from, 0, width, 256);
        };
        for (let x = 0; x < 124; ++x) fill(x % 2 === 0 ? 'black' : 'white', x, 1);
        fill('rgb(128,128,128)', 124, 8);
        fill('rgb(0,255,0)', 132, 124);
        return [...new Uint8Array(await (await canvas.convertToBlob({ type: 'image/png' })).arrayBuffer())];
    });
    server.made.set('lines.htvm', withPictures('PNG', pictures.PNG.map(() => ({ key: true, bytes })), { width: 256, height: 256 }));
    await openPlayer(page, 'lines');
    const drawn = await page.evaluate(async () => {
        Object.assign(test.player.style, { width: '64px', height: '64px' });
        await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve))); // until its size is observed
        await test.player.idle();
        const bitmap = await createImageBitmap(await test.player.screenshot());
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
        context.drawImage(bitmap, 0, 0);
        const middle = [...context.getImageData(0, bitmap.height / 2, bitmap.width, 1).data];
        return Array.from({ length: bitmap.width }, (_, x) => middle.slice(4 * x, 4 * x + 4)).filter(([, , , alpha]) => alpha === 255).map((rgba) => rgba.slice(0, 3));
    });
    const texels = 256 / drawn.length; // of a pixel
    assert.ok(texels > 4 && texels < 8, `${drawn.length} pixels`);
    const half = Math.floor(drawn.length / 2);
    for (const [x, rgb] of drawn.slice(1, half - 1).entries()) for (const value of rgb) assert.ok(Math.abs(value - 128) < 40, `pixel ${x + 1}: ${rgb}`);
    for (const [x, rgb] of drawn.slice(half + 2, -1).entries()) assert.deepEqual(rgb, [0, 255, 0], `pixel ${half + 2 + x}`);
});

inPage('pictures of frames that a seek leaves out are decoded for those that need them', async (page) => {
    server.made.set('own.htvm', withPictures('AV1', pictures.own, { of: ownMeshes }));
    const frame = frames - 2;
    assert.ok(frame - Math.max(...startsOf(ownMeshes)) >= 3, `${startsOf(ownMeshes)}`);
    await openPlayer(page, 'own');
    await page.evaluate((at) => test.seek(at), (frame + 0.4) / 30);
    assert.equal(await last(page), frame);
    assertShown(await shown(page), coloursOf(frame), 8, `frame ${frame}`);
});

inPage('where pictures are damaged, words say so, and the rest is shown', async (page) => {
    const damaged = pictures.VP9.map((one, i) => (i === 0 ? { ...one, bytes: one.bytes.map((byte, at) => (at > 3 ? byte ^ 0x55 : byte)) } : one));
    server.made.set('damaged.htvm', withPictures('VP9', damaged));
    await openPlayer(page, 'damaged');
    await page.evaluate(() => test.seek(15.4 / 30));
    assert.equal(await last(page), 15);
    assertShown(await shown(page), coloursOf(15), 6, 'frame 15');
    assert.match((await page.evaluate(() => test.notices)).join(' '), /could not be decoded|damaged/);
});

inPage('a browser without WebCodecs shows the meshes, and says why without pictures', async (page) => {
    await openPlayer(page, 'AV1');
    assert.deepEqual(await page.evaluate(() => test.notices), ['The pictures of this stream, AV1, cannot be shown here: this browser has no WebCodecs.']);
    await page.evaluate(() => test.player.play());
    await page.evaluate(() => test.run());
    assert.equal(await last(page), frames - 1);
}, 'delete globalThis.VideoDecoder');

const noFfmpeg = spawnSync('ffmpeg', ['-version']).error !== undefined;

for (const codec of noFfmpeg ? ['av1', 'vp9'] : ['av1', 'vp9', 'h264'])
    inPage(`a capture with images, encoded with ${codec}, is shown with them, wherever playing starts`, async (page) => {
        const capture = join(work, 'capture');
        for (const [frame, { bytes }] of pictures.PNG.entries())
            await writeFile(join(capture, `${String(frame).padStart(3, '0')}.png`), Uint8Array.from(bytes));
        const stream = join(work, `${codec}.htvm`);
        const words = ['--fps', '30', '--profile', 'topology', '--keyint', '10', '--texture-as', 'captured', '--texture-codec', codec === 'h264' ? 'av1' : codec, '--texture-quality', '80'];
        execFileSync(program, ['encode', capture, ...words, '-o', stream], { stdio: 'pipe' });
        if (codec === 'h264') {
            const as = ['--texture-codec', codec, '--texture-quality', '80'];
            execFileSync(program, ['transcode', join(work, 'av1.htvm'), ...as, '-o', stream], { stdio: 'pipe' });
        }
        const bytes = await readFile(stream);
        // There are places to start that have no key picture.
        const keys = packetsOf(bytes).filter(isKeyPicture).map(({ frame }) => frame);
        assert.ok(startsOf(bytes).some((start) => !keys.includes(start)), `${startsOf(bytes)}; ${keys}`);
        server.made.set(`${codec}.htvm`, bytes);
        await openPlayer(page, codec);
        assertShown(await shown(page), coloursOf(0), 16, 'frame 0');
        for (const frame of [9, 28, 14, 1]) {
            await page.evaluate((at) => test.seek(at), (frame + 0.4) / 30);
            assert.equal(await last(page), frame);
            assertShown(await shown(page), coloursOf(frame), 16, `frame ${frame}`);
        }
        assert.deepEqual(await page.evaluate(() => test.notices), []);
    });

test('live: who joins in the middle sees frames with their own pictures', options, async () => {
    const hub = await new LiveHub().start();
    const publishing = new Publishing(hub, server.made.get('VP9.htvm'));
    const page = await newPage();
    try {
        await new Promise((resolve) => setTimeout(resolve, 1500)); // in the middle
        const seen = await page.evaluate(async ([src, places]) => {
            const player = document.createElement('htvm-player');
            for (const [name, value] of Object.entries({ src, live: '', autoplay: '', floor: 'none', orbit: '0 0' })) player.setAttribute(name, value);
            const seen = [];
            let at = null;
            player.addEventListener('framepresented', ({ detail }) => (at = detail.frame));
            document.body.append(player);
            while (seen.length < 8) {
                await new Promise((resolve) => setTimeout(resolve, 150));
                const frame = at;
                if (frame === null || player.statistics.live.state !== 'live') continue;
                seen.push([frame, await window.pictures.coloursAt(player, places)]);
            }
            player.remove();
            return seen;
        }, [hub.address('ws'), quarters]);
        for (const [frame, colours] of seen) assertShown(colours, coloursOf(frame % frames), 6, `frame ${frame}`);
        assert.equal((await counts(page)).open, 0);
    } finally {
        await page.close();
        publishing.stop();
        await hub.stop();
    }
});
