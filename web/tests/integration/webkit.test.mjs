// The player in another engine: WebKitGTK, driven by WebDriver. It needs a display, such as that of xvfb-run. HTVM names the program
// that makes segments.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { TestServer } from '../server.mjs';
import { conformance, digests, encodeDancer, firstSequence, folder, packetsOf, padded } from '../streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const program = process.env.HTVM;
const withProgram = { skip: program ? false : 'HTVM names no program', timeout: 240000 };
const frames = 90;
let server, driver, session, work;
const started = [];

async function command(method, words, body) {
    const response = await fetch(`http://127.0.0.1:4455/${words}`, { method, body: body && JSON.stringify(body) });
    const { value } = await response.json();
    if (!response.ok) throw new Error(`${words}: ${value.error}: ${value.message}`);
    return value;
}

// Calls a function in the page; it may be asynchronous.
async function inPage(body, ...args) {
    const script = `const done = arguments[arguments.length - 1];
        (${body})(...Array.from(arguments).slice(0, -1)).then((value) => done({ value }), (error) => done({ error: String(error) }));`;
    const { value, error } = await command('POST', `session/${session}/execute/async`, { script, args });
    if (error) throw new Error(error);
    return value;
}

before(async () => {
    work = await mkdtemp(join(tmpdir(), 'htvm-webkit-'));
    server = await new TestServer({ '': path('../pages'), player: path('../../packages/player/dist'), streams: folder, segments: work }).start();
    server.made.set('long.htvm', padded(firstSequence(await conformance('tracked_by_chance')), 30000, 'front'));
    driver = spawn('WebKitWebDriver', ['--port=4455'], { stdio: 'ignore', env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' } });
    for (let tries = 0; ; ++tries) {
        try {
            await command('GET', 'status');
            break;
        } catch (error) {
            if (tries > 100) throw error;
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
    }
    const created = await command('POST', 'session', { capabilities: { alwaysMatch: {} } });
    session = created.sessionId;
    await command('POST', `session/${session}/timeouts`, { script: 60000, pageLoad: 30000 });
});

after(async () => {
    if (session) await command('DELETE', `session/${session}`).catch(() => undefined);
    driver?.kill();
    server?.stop();
    for (const one of started) one.kill();
    if (work) await rm(work, { recursive: true, force: true });
});

async function openPage() {
    await command('POST', `session/${session}/url`, { url: `${server.origin}/page.html` });
    await inPage(async () => {
        while (!window.ready) await new Promise((resolve) => setTimeout(resolve, 20));
    });
}

test('frames are those of the native decoder, and seeks find them', { timeout: 120000 }, async () => {
    await openPage();
    assert.deepEqual(await inPage((src) => test.playAll({ src }), '/as-is/tracked.htvm'), await digests('tracked'));
    const expected = (await digests('tracked_by_chance')).slice(0, packetsOf(firstSequence(await conformance('tracked_by_chance'))).length - 1);
    const found = await inPage(async () => {
        await test.open({ src: '/as-is/long.htvm' });
        const lines = [];
        for (const number of [50, 11]) lines.push((await test.seek((number + 0.4) / 30)).at(-1).line);
        return lines;
    });
    assert.deepEqual(found, [expected[50], expected[11]]);
    assert.ok(server.requests.some(({ path, range }) => path.endsWith('long.htvm') && range === 'bytes=0-262143'));
});

test('segments, and an .mp4, play as the bare stream does, and seeks find the same frames', withProgram, async () => {
    await writeFile(join(work, 'dancer.htvm'), await encodeDancer(program, frames));
    const pack = (...words) => execFileSync(program, ['pack', join(work, 'dancer.htvm'), '-o', ...words, '--quiet']);
    pack(join(work, 'dancer.m3u8'), '--segment', '0.6');
    pack(join(work, 'dancer.mp4'));
    await openPage();
    const bare = await inPage((src) => test.playAll({ src }), '/segments/dancer.htvm');
    assert.equal(bare.length, frames);
    for (const src of ['/segments/dancer.m3u8', '/segments/dancer.mp4'])
        assert.deepEqual(await inPage((address) => test.playAll({ src: address }), src), bare, src);
    const lines = await inPage(async () => {
        await test.open({ src: '/segments/dancer.m3u8' });
        const found = [];
        for (const seconds of [2.5, 0.7, 2.97]) found.push((await test.seek(seconds)).at(-1).line);
        return found;
    });
    assert.deepEqual(lines, [bare[75], bare[21], bare[89]]);
});

test('pictures are shown by a coder that this engine decodes, of a sibling if need be, and else words say what is missing', withProgram, async () => {
    const run = (...words) => execFileSync(program, [...words, '--quiet'], { cwd: work, stdio: 'pipe' });
    run('synth', 'textured', '--frames', '12', '--vertices', '1000', '--texture', '128');
    run('encode', 'textured', '--texture-size', '256', '-o', 'textured.htvm');
    run('transcode', 'textured.htvm');
    run('transcode', 'textured.htvm', '--texture-codec', 'vp9');
    await openPage();
    const seen = await inPage(async (src) => {
        const decodes = async (codec) => (await VideoDecoder.isConfigSupported({ codec, codedWidth: 256, codedHeight: 256 }).catch(() => null))?.supported === true;
        const can = { AV1: await decodes('av01.0.04M.08'), VP9: await decodes('vp09.00.40.08'), 'H.264': await decodes('avc1.640028') };
        await test.playAll({ src });
        return { can, coder: test.player.statistics.pictures?.coder ?? null, notices: test.notices };
    }, '/segments/textured.htvm');
    const expected = ['AV1', 'VP9', 'H.264'].find((coder) => seen.can[coder]) ?? null;
    console.log(JSON.stringify(seen));
    assert.equal(seen.coder, expected);
    if (expected) assert.deepEqual(seen.notices, []);
    else assert.match(seen.notices.join(' '), /AV1, cannot be shown here/);
});

test('segments of a live ladder play on, each frame at its time', withProgram, async () => {
    execFileSync(program, ['synth', join(work, 'capture'), '--frames', '60', '--vertices', '500', '--quiet']);
    execFileSync(program, ['encode', join(work, 'capture'), '--ladder', 'q15,q45', '--segment', '1', '--effort', '1', '--quiet', '-o', join(work, 'person.m3u8')]);
    const start = (...words) => {
        const one = spawn(program, words, { stdio: ['ignore', 'pipe', 'ignore'] });
        started.push(one);
        return one;
    };
    const [line] = await once(start('serve', '--port', '0', '--segments', '1', '--origin', server.origin).stdout, 'data');
    const hub = /http:\/\/[^/\s]+/.exec(String(line))[0];
    start('publish', join(work, 'person.m3u8'), '--ladder', `${hub.replace('http', 'ws')}/publish/anna`, '--loop');
    await inPage(async (src) => test.watch(src), `${hub}/hls/anna/master.m3u8`);
    const look = () =>
        inPage(async () => {
            const { ladder } = window.player.statistics;
            const shown = window.shown.filter(({ preview }) => !preview).map(({ time }) => time);
            return { shown, notices: window.notices, live: ladder?.live, lost: ladder?.lostSegments, rungs: ladder?.rungs.length };
        });
    let played = await look();
    while (!(played.shown.at(-1) >= played.shown[0] + 5)) {
        await new Promise((resolve) => setTimeout(resolve, 500));
        played = await look();
    }
    assert.deepEqual([played.live, played.lost, played.rungs], [true, 0, 2]);
    for (const [i, time] of played.shown.slice(1).entries()) assert.ok(time > played.shown[i], `${time} behind ${played.shown[i]}`);
    const wrong = played.notices.filter((text) => !/not there yet/.test(text)); // the player may be first
    assert.deepEqual(wrong, []);
});
