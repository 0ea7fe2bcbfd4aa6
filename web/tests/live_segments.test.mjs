// A ladder that is encoded and published live, as viewers of the hub's segments have it: parts, rungs, and back in the window.
// HTVM names the program.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { isFrame } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 180000 };
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const frames = 360;

let work, page, server, browser, hub, SegmentPackets;
const started = [];

function start(...words) {
    const one = spawn(program, words, { stdio: ['ignore', 'pipe', 'inherit'] });
    started.push(one);
    return one;
}

// The capture, encoded and published as a ladder at the time of its frames.
const publish = (name) => start('encode', join(work, 'capture'), '--ladder', 'q15,q45', '--segment', '1', '--effort', '1', '--end', '--quiet', '-o', `${hub.replace('http', 'ws')}/publish/${name}`);

async function there(address) {
    for (;;) {
        const response = await fetch(address);
        if (response.ok) return response.text();
        await new Promise((resolve) => setTimeout(resolve, 100));
    }
}

before(async () => {
    if (!program) return;
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/segment_packets.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    ({ SegmentPackets } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
    work = await mkdtemp(join(tmpdir(), 'htvm-live-segments-'));
    execFileSync(program, ['synth', join(work, 'capture'), '--frames', `${frames}`, '--vertices', '500', '--quiet']);
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist') }).start();
    const serve = start('serve', '--port', '0', '--segments', '1', '--parts', '0.25', '--origin', server.origin);
    const [line] = await once(serve.stdout, 'data');
    hub = /http:\/\/[^/\s]+/.exec(String(line))[0];
    browser = await launch();
    page = await browser.newPage({ viewport: { width: 320, height: 240 } });
});

after(async () => {
    await browser?.close();
    server?.stop();
    for (const one of started) one.kill();
    if (work) await rm(work, { recursive: true, force: true });
});

test('rungs of a ladder that is published are cut alike, and the hub lists them', options, async () => {
    publish('anna');
    const master = await there(`${hub}/hls/anna/master.m3u8`);
    assert.deepEqual(master.match(/^[^#\n].*$/gm), ['../anna~1/stream.m3u8', '../anna~2/stream.m3u8']);
    assert.match(master, /FRAME-RATE=30\.000/);
    const [low, high] = [...master.matchAll(/[,:]BANDWIDTH=(\d+)/g)].map(([, rate]) => Number(rate));
    assert.ok(high > 1.5 * low, `${low} ${high}`);
    const told = async (rung) => {
        const text = await there(`${hub}/hls/anna~${rung}/stream.m3u8`);
        const number = Number(/MEDIA-SEQUENCE:(\d+)/.exec(text)[1]);
        return new Map([...text.matchAll(/DATE-TIME:(\S+)\n(?:#EXT-X-PART.*\n)*#EXTINF:([\d.]+)/g)].map(([, date, seconds], i) => [number + i, `${date} ${seconds}`]));
    };
    const [first, second] = [await told(1), await told(2)];
    const both = [...first.keys()].filter((number) => second.has(number));
    assert.ok(both.length > 0);
    for (const number of both) assert.equal(first.get(number), second.get(number));
});

test('a viewer has each frame once, part by part, and goes up to the finest rung that is there', options, async () => {
    publish('berta');
    await there(`${hub}/hls/berta/master.m3u8`);
    const asked = [];
    const listed = new Set(); // names of parts, as far as lists that came have them
    const ahead = []; // parts that were asked for before
    const { fetch: plain } = globalThis;
    globalThis.fetch = async (url, more) => {
        asked.push(String(url));
        const name = String(url).split('/').at(-1);
        if (/\.\d+\.m4s$/.test(name) && !listed.has(name)) ahead.push(name);
        const response = await plain(url, more);
        if (/master\.m3u8/.test(url)) return new Response(`${await response.text()}#EXT-X-STREAM-INF:BANDWIDTH=99000000,AVERAGE-BANDWIDTH=400000\n../berta~3/stream.m3u8\n`);
        if (/\.m3u8/.test(url)) for (const [, one] of (await response.clone().text()).matchAll(/^#EXT-X-PART:.*URI="([^"]+)"/gm)) listed.add(one);
        return response;
    };
    const notices = [];
    // Frames are taken as a player does that has something ahead, however fast the machine encodes: some for each part that comes.
    let [may, wake] = [0, () => undefined];
    const packets = new SegmentPackets(`${hub}/hls/berta/master.m3u8`, (text) => notices.push(text), ({ secondsFetched }) => {
        if (secondsFetched >= 0.6) may += 8;
        wake();
    });
    // At the end nothing comes any more.
    const atTheEnd = setInterval(() => {
        may += 8;
        wake();
    }, 3000);
    const mayTake = async () => {
        while (may <= 0) await new Promise((resolve) => (wake = resolve));
        --may;
    };
    try {
        const { timeUs } = await packets.seek(0);
        const shown = [];
        for (let packet = await packets.next(); packet; packet = await packets.next()) {
            if (!isFrame(packet.kind) || packet.passed) continue;
            shown.push({ frame: packet.frame, timeUs: packet.timeUs, rung: packet.rung });
            await mayTake();
        }
        assert.deepEqual(shown.map(({ frame }) => frame), Array.from({ length: shown.length }, (_, i) => shown[0].frame + i));
        assert.equal(shown.at(-1).frame, frames - 1);
        assert.ok(shown[0].timeUs <= timeUs && timeUs < shown.at(-1).timeUs, 'it begins where decoding can start for the place where playing begins');
        for (const [i, one] of shown.entries()) assert.ok(Math.abs(one.timeUs - shown[0].timeUs - (1e6 * i) / 30) < 2000, `frame ${one.frame} at ${one.timeUs}`);
        assert.equal(shown[0].rung, 0);
        assert.equal(shown.at(-1).rung, 1);
        assert.deepEqual(notices, []);
        const parts = asked.filter((url) => /\/\d+-[0-9a-f]{8}\.\d+\.m4s$/.test(url));
        assert.ok(parts.length > 8, `${parts.length} parts`);
        assert.equal(new Set(parts).size, parts.length, 'each is asked for once');
        const vain = asked.filter((url) => url.endsWith('berta~3/stream.m3u8')).length;
        assert.ok(vain >= 1 && vain < 12, `a finer rung that is not there was asked for ${vain} times`);
        assert.ok(ahead.length > 4, `${ahead.length} parts were asked for before they were listed`);
        assert.ok(asked.some((url) => /_HLS_msn=\d+&_HLS_part=\d+/.test(url)));
    } finally {
        clearInterval(atTheEnd);
        globalThis.fetch = plain;
        packets.close();
    }
});

test('a viewer in Chromium goes back within the window, and returns to live', options, async () => {
    publish('clara');
    const address = `${hub}/hls/clara/master.m3u8`;
    await there(address);
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction(() => window.ready);
    await page.evaluate((src) => test.watch(src), address);
    const shownFrom = (time) => page.waitForFunction((from) => window.shown.filter((one) => !one.preview && one.time >= from).length >= 10, time);
    await shownFrom(0);
    const joined = await page.evaluate(() => ({ ...window.shown.find(({ preview }) => !preview), live: window.player.statistics.ladder.live, duration: window.player.duration }));
    assert.ok(joined.live);
    assert.ok(joined.time > 0, 'it is joined near its end');
    assert.ok(joined.duration >= joined.time);
    // Back to the first frame of the list, and on from there.
    await page.evaluate(() => {
        window.shown.length = 0;
        window.player.currentTime = 0.1;
    });
    await page.waitForFunction(() => window.shown.length >= 10);
    const back = await page.evaluate(() => window.shown.filter(({ preview }) => !preview));
    assert.ok(Math.abs(back[0].time - 0.1) < 0.04, `${back[0].time}`);
    for (const [i, one] of back.slice(1).entries()) assert.ok(one.frame > back[i].frame);
    // To live again: as far behind the end as who joins.
    const before = await page.evaluate(() => {
        window.shown.length = 0;
        window.player.currentTime = window.player.duration;
        return window.player.duration;
    });
    await page.waitForFunction((from) => window.shown.some(({ time, preview }) => !preview && time > from), before);
    const live = await page.evaluate(() => window.shown.filter(({ preview }) => !preview));
    assert.ok(live[0].time <= before, `${live[0].time} is not beyond the end, ${before}`);
    assert.ok(live[0].time > back.at(-1).time);
    assert.deepEqual(await page.evaluate(() => window.notices), []);
});
