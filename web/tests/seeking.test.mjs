// Seeking in a stream with one I-frame, patches and places to start between: under Node what is read, in Chromium what is
// shown. HTVM names the program that makes the stream.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { isAccess, isFrame, isReference, loadDecoder, packetKind } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { encodeDancer, folder, framesOf, packetsOf, padded } from './streams.mjs';

const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 120000 };
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const frames = 60;
const padding = 400000; // bytes behind each frame, so that what is fetched for one does not bring others

let server, browser, module, FilePackets, ByteSource;
let played; // the line of each frame
let headers; // of the packets of frames

before(async () => {
    if (!program) return;
    const contents = "export * from './file_packets.ts'; export * from './byte_source.ts';";
    const { outputFiles } = await build({
        stdin: { contents, resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm', platform: 'node', write: false,
        logLevel: 'error',
    });
    ({ FilePackets, ByteSource } = await import(
        `data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
    module = await loadDecoder();
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: folder }).start();
    browser = await launch();
    const dancer = await encodeDancer(program, frames);
    for (const index of ['front', 'none']) server.made.set(`${index}.htvm`, padded(dancer, padding, index));
    const packets = packetsOf(dancer);
    headers = packets.filter(({ kind }) => isFrame(kind));
    const decoder = module.createDecoder();
    played = framesOf(decoder, packets);
    decoder.close();
});

after(async () => {
    await browser?.close();
    server?.stop();
});

const timeOf = (frame) => Math.round((frame * 1e6) / 30) + 1000;

// The last place to start at or before a frame, and what it refers to, in order.
function routeTo(frame) {
    const route = [headers.findLast((one) => one.frame <= frame && isAccess(one))];
    while (route[0].kind !== packetKind.intra) route.unshift(headers.find((one) => one.frame === route[0].reference));
    return route.map((one) => one.frame);
}

// A file of the server's of which the beginning was read.
async function openFile(name) {
    const source = new ByteSource(`${server.origin}/as-is/${name}`);
    const file = new FilePackets(source, module);
    file.seek(0);
    for (let packet = await file.next(); !isFrame(packet.kind); packet = await file.next());
    server.requests.length = 0;
    return { file, source };
}

// What comes after seeking to a frame, up to that frame: the numbers of the frames, and the lines that they are decoded to.
async function seekTo(file, frame) {
    const packets = [{ bytes: file.seek(timeOf(frame)) }];
    do {
        const packet = await file.next();
        assert.ok(packet, `frame ${frame} does not come`);
        if (isFrame(packet.kind)) packets.push({ ...packet, bytes: packet.bytes.slice() });
    } while (packets.at(-1).frame !== frame);
    const decoder = module.createDecoder();
    const lines = framesOf(decoder, packets);
    decoder.close();
    return { numbers: packets.slice(1).map((packet) => packet.frame), lines };
}

const from = (first, last) => Array.from({ length: last - first + 1 }, (_, i) => first + i);

test('the stream has what is to be tested: patches, and tracked frames to start at', options, () => {
    assert.equal(headers.filter(({ kind }) => kind === packetKind.intra).length, 1);
    assert.ok(headers.filter(isReference).length >= 3);
    assert.ok(headers.filter((one) => isAccess(one) && !isReference(one)).length >= 4);
    assert.ok(headers.every((one, i) => i === 0 || one.frame === headers[i - 1].frame + 1));
});

test('by the index, seeking reads what a frame needs and nothing else, with a request for each place', options, async () => {
    const { file, source } = await openFile('front.htvm');
    for (const frame of [58, 31, 9, 44]) {
        const route = routeTo(frame);
        server.requests.length = 0;
        const { numbers, lines } = await seekTo(file, frame);
        assert.deepEqual(numbers, [...route, ...from(route.at(-1) + 1, frame)]);
        assert.equal(lines.at(-1), played[frame]);
        assert.ok(frame - route.at(-1) <= 10, `${route}`);
        const beyond = Math.ceil(((frame - route.at(-1) + 3) * padding) / (1 << 18)); // read on from the last place
        assert.ok(server.requests.length <= route.length + beyond, `${server.requests.length} requests for ${route.length} places`);
    }
    source.close();
});

test('places are learnt from a file that was read through without an index', options, async () => {
    const { file, source } = await openFile('none.htvm');
    while (await file.next());
    for (const frame of [50, 12]) {
        const route = routeTo(frame);
        const { numbers, lines } = await seekTo(file, frame);
        assert.deepEqual(numbers, [...route, ...from(route.at(-1) + 1, frame)]);
        assert.equal(lines.at(-1), played[frame]);
    }
    source.close();
});

test('where something else is at a place that the index names, the file is read on from the last that is sound', options, async () => {
    const frame = 58;
    const route = routeTo(frame);
    const patch = route.at(-2);
    const stream = server.made.get('front.htvm').slice();
    const at = packetsOf(stream).find((one) => one.frame === patch && isFrame(one.kind)).offset;
    stream[at + 40] ^= 1;
    server.made.set('damaged.htvm', stream);
    const { file, source } = await openFile('damaged.htvm');
    file.seek(timeOf(frame));
    const numbers = [];
    for (let packet = await file.next(); packet; packet = await file.next()) if (isFrame(packet.kind)) numbers.push(packet.frame);
    const before = route.slice(0, -2);
    const rest = from(before.at(-1) + 1, frames - 1).filter((number) => number !== patch);
    assert.deepEqual(numbers, [...before, ...before, ...rest]);
    source.close();
});

test('in the player, what is sought is the frame that playing shows, and what it refers to is not shown', options, async () => {
    const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
    const seek = (frame) => page.evaluate((at) => test.seek(at), timeOf(frame) / 1e6);
    try {
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction('window.ready');
        for (const name of ['front', 'none']) {
            assert.deepEqual(await page.evaluate((src) => test.playAll({ src }), `/as-is/${name}.htvm`), played);
            await page.evaluate((src) => test.open({ src }), `/as-is/${name}.htvm`);
            for (const frame of [58, 31, 9, 44]) {
                const shown = await seek(frame);
                assert.equal(shown.at(-1).line, played[frame]);
                const first = name === 'front' ? routeTo(frame).at(-1) : 0;
                assert.ok(shown.every((one) => one.frame >= first), `${frame}: ${shown.map((one) => one.frame)}`);
            }
            // And it plays on from there.
            await page.evaluate(() => test.player.play());
            await page.evaluate(() => test.run());
            assert.deepEqual(await page.evaluate((last) => test.frames.slice(-last).map(({ line }) => line), frames - 45), played.slice(45));
        }
    } finally {
        await page.close();
    }
});
