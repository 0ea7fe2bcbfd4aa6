// Sound and frames in step, in Chromium: HTVM names the program that makes the stream. The time is real here: it is the
// sound card's, or what the browser has in its place.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { readAudio } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';
import { LiveHub, Publishing } from './live_hub.mjs';
import { TestServer } from './server.mjs';
import { conformance, makeCapture, packetsOf } from './streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 60000 };
const clicksFile = path('../../tests/data/audio/clicks.opus'); // at 0.25 s, 0.75 s, ... of 3 s
const mostSeconds = 0.04;

let browser, server, work;

before(async () => {
    if (!program) return;
    browser = await launch();
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), audio: path('../../tests/data/audio') }).start();
    server.pageHeaders = { 'Content-Security-Policy': "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self' ws:" };
    work = await mkdtemp(join(tmpdir(), 'htvm-sound-'));
    await makeCapture(join(work, 'capture'), 90);
    for (const [name, more] of [['sound', ['--audio', clicksFile]], ['silent', []]]) {
        const stream = join(work, `${name}.htvm`);
        execFileSync(program, ['encode', join(work, 'capture'), '--fps', '30', '-o', stream, ...more], { stdio: 'pipe' });
        server.made.set(`${name}.htvm`, await readFile(stream));
    }
});

after(async () => {
    await browser?.close();
    server?.stop();
    if (work) await rm(work, { recursive: true });
});

// A page in which a player with these attributes plays. What is evaluated counts as a click, so sound is allowed.
async function listening(attributes, body) {
    const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
    const faults = [];
    page.on('pageerror', (error) => faults.push(error.message));
    try {
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction('window.ready');
        await page.evaluate(async (given) => {
            await import('/listen.js');
            const player = document.createElement('htvm-player');
            for (const [name, value] of Object.entries({ floor: 'none', autoplay: '', ...given })) player.setAttribute(name, value);
            window.player = player;
            window.notices = [];
            player.addEventListener('notice', ({ detail }) => notices.push(detail));
            document.body.append(player);
            listen.watch(player);
        }, attributes);
        await page.waitForFunction(() => listen.context?.currentTime > 0);
        await page.evaluate(() => listen.ready);
        await body(page);
        assert.deepEqual(faults, []);
        assert.deepEqual(await page.evaluate(() => notices), []);
    } finally {
        await page.close();
    }
}

// Plays for some seconds and compares each click with the pictures at the time at which it is heard. Gives the clicks' media
// times. A machine that stands still for a moment displaces a click, but sound that is out of step displaces them all: so the
// middle one of how far they are off counts.
async function inStep(page, seconds, rate = 1) {
    const { clicks, pictures, latency } = await page.evaluate(async (time) => {
        listen.clicks.length = listen.pictures.length = 0;
        await listen.for(time);
        return { clicks: [...listen.clicks], pictures: [...listen.pictures], latency: listen.latency };
    }, seconds);
    const media = [];
    const offs = [];
    for (const click of clicks) {
        const after = pictures.findIndex(({ context }) => context >= click + latency);
        if (after < 1) continue;
        const [a, b] = [pictures[after - 1], pictures[after]];
        if (!(b.media > a.media && b.media - a.media < 0.5)) continue; // the end of a loop lies between
        const heard = a.media + (click + latency - a.context) * rate;
        const meant = 0.25 + 0.5 * Math.round((heard - 0.25) / 0.5);
        media.push(meant);
        offs.push((heard - meant) / rate);
    }
    const middle = [...offs].sort((a, b) => Math.abs(a) - Math.abs(b))[(offs.length - 1) >> 1] ?? 0;
    assert.ok(Math.abs(middle) < mostSeconds, `clicks of ${media} s are heard ${offs.map((off) => off.toFixed(3))} s off`);
    // The frame shown is the one of the media time, give or take what drawing takes.
    const behind = pictures.map((picture) => picture.media - picture.frame).sort((a, b) => a - b);
    assert.ok(Math.abs(behind[behind.length >> 1]) < 1 / 30 + mostSeconds, `frames are ${behind[behind.length >> 1]} s behind`);
    return media;
}

test('sound is within 40 ms of the frames: from the beginning, through a loop, after seeks, at other speeds', options, () =>
    listening({ src: '/as-is/sound.htvm', loop: '' }, async (page) => {
        const through = await inStep(page, 4);
        assert.ok(through.length >= 6 && through.includes(0.25) && through.includes(2.75), `${through}`);
        for (const time of [1.1, 0.2]) {
            await page.evaluate(async (at) => {
                const sought = new Promise((resolve) => player.addEventListener('seeked', resolve, { once: true }));
                player.currentTime = at;
                await sought;
            }, time);
            assert.ok((await inStep(page, 1.2)).length >= 1);
        }
        for (const rate of [2, 0.5]) {
            await page.evaluate((by) => (player.playbackRate = by), rate);
            await page.evaluate(() => listen.for(0.1));
            assert.ok((await inStep(page, 1.5, rate)).length >= 1);
        }
    }));

test('where the browser allows no sound yet, the player plays without, and a button turns it on', options, async () => {
    const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
    try {
        // The page is not touched before: even to ask it for its elements counts as a click.
        const playing = page.waitForEvent('console', (message) => message.text() === 'ten frames');
        await page.goto(`${server.origin}/autoplay.html`);
        await playing;
        const button = page.getByRole('button', { name: 'Turn the sound on' });
        await button.click();
        await page.waitForFunction(() => listen.context.currentTime > 0.3 && player.statistics.framesShown > 3);
        assert.equal(await button.isVisible(), false);
        assert.ok((await inStep(page, 1.2)).length >= 1);
    } finally {
        await page.close();
    }
});

test('a pause is silent, and so is muted sound', options, () =>
    listening({ src: '/as-is/sound.htvm', loop: '' }, async (page) => {
        const heard = (seconds) => page.evaluate(async (time) => {
            await listen.for(0.1);
            listen.clicks.length = 0;
            await listen.for(time);
            return listen.clicks.length;
        }, seconds);
        await page.evaluate(() => player.pause());
        assert.equal(await heard(0.8), 0);
        await page.evaluate(() => player.play());
        assert.ok((await inStep(page, 1.2)).length >= 1);
        await page.evaluate(() => (player.muted = true));
        assert.equal(await heard(0.8), 0);
    }));

test('sound from a file beside the stream is in step too', options, () =>
    listening({ src: '/as-is/silent.htvm', audio: '/audio/clicks.opus', loop: '' }, async (page) => {
        assert.ok((await inStep(page, 4)).length >= 4);
    }));

test('live sound is within 40 ms of the frames, and after a gap again', options, async () => {
    const hub = await new LiveHub().start();
    const publishing = new Publishing(hub, server.made.get('sound.htvm'));
    try {
        await listening({ src: hub.address('ws'), live: '' }, async (page) => {
            await page.waitForFunction(() => player.statistics.live.state === 'live' && player.statistics.framesShown > 30);
            assert.ok((await inStep(page, 4)).length >= 5);
            for (const viewer of hub.viewers) viewer.destroy();
            await page.waitForFunction(() => player.statistics.live.state === 'reconnecting');
            await page.waitForFunction(() => player.statistics.live.state === 'live');
            await page.evaluate(() => listen.for(1.5));
            assert.ok((await inStep(page, 3)).length >= 3);
            await page.evaluate(() => (player.muted = true));
            assert.equal(await page.evaluate(async () => {
                await listen.for(0.2);
                listen.clicks.length = 0;
                await listen.for(1);
                return listen.clicks.length;
            }), 0);
        });
    } finally {
        publishing.stop();
        await hub.stop();
    }
});

test('where the browser has no WebCodecs, live streams play without sound, and the player says so', options, async () => {
    const hub = await new LiveHub().start();
    const publishing = new Publishing(hub, server.made.get('sound.htvm'));
    const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
    try {
        await page.addInitScript(() => delete globalThis.AudioDecoder);
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction('window.ready');
        await page.evaluate((src) => {
            window.player = document.createElement('htvm-player');
            for (const [name, value] of Object.entries({ src, live: '', autoplay: '', floor: 'none' })) player.setAttribute(name, value);
            window.notices = [];
            player.addEventListener('notice', ({ detail }) => notices.push(detail));
            document.body.append(player);
        }, hub.address('ws'));
        await page.waitForFunction(() => notices.length > 0 && player.statistics.framesShown > 10);
        assert.deepEqual(await page.evaluate(() => notices), ['Live sound is not possible here: this browser has no WebCodecs.']);
    } finally {
        await page.close();
        publishing.stop();
        await hub.stop();
    }
});

test('a page of its own clock plays without sound, and a decoder of frames passes over audio', options, async () => {
    const page = await browser.newPage();
    try {
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction('window.ready');
        assert.equal((await page.evaluate(() => test.playAll({ src: '/as-is/sound.htvm' }))).length, 90);
    } finally {
        await page.close();
    }
});

test('audio packets are read, and damaged ones are not', async () => {
    const packets = packetsOf(await conformance('audio_2')).filter(({ kind }) => kind === 10);
    const audio = packets.map(readAudio);
    assert.deepEqual(audio.map((read) => read && [read.channels, read.gain, read.samples, read.skipBegin, read.skipEnd]), [
        [1, -256, 1920, 312, 0], [2, 0, 1920, 0, 320], [1, -256, 1920, 0, 0], null, // the last is of another coder
    ]);
    const { bytes, ...rest } = packets[0];
    for (let size = 0; size < bytes.length - 36; ++size)
        assert.equal(readAudio({ ...rest, bytes: new Uint8Array([...bytes.subarray(0, 32 + size), 0, 0, 0, 0]) }), null);
});
