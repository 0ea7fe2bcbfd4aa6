// Which quality is fetched next, and that a player goes from one to the other without a gap. measure_ladder.mjs has a line that
// changes. HTVM names the program that makes the streams.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 180000 };
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const mega = 1e6;

let chooseRung, shouldGiveUp;

before(async () => {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/rung_choice.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    ({ chooseRung, shouldGiveUp } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
});

// ---- the choice -------------------------------------------------------------------------------------------------------

const state = (more) => ({
    rungs: [0.3 * mega, 0.8 * mega, 2 * mega], current: 1, bitsPerSecond: [1.2 * mega, 1.2 * mega], aheadSeconds: 4, segmentSeconds: 1, decodeShare: 0.1,
    ...more,
});

for (const [what, more, rung, reason] of [
    ['a stream of one quality has no choice', { rungs: [mega], current: 0 }, 0, /only one/],
    ['before anything was measured it begins low', { current: null, bitsPerSecond: [] }, 0, /begins low/],
    ['the line bears what is fetched: it stays', {}, 1, /1\.2 Mbit\/s/],
    ['the line bears more, twice in a row: it rises', { bitsPerSecond: [4 * mega, 4 * mega] }, 2, /4\.0 Mbit\/s/],
    ['the line bore more only once: it stays', { bitsPerSecond: [1 * mega, 4 * mega] }, 1, /4\.0 Mbit\/s/],
    ['the line bears more, but for one segment: it rises', { bitsPerSecond: [4 * mega, 1 * mega, 4 * mega] }, 2, /4\.0 Mbit\/s/],
    ['the line bears far more than the next rung, if only once: it rises by one', { current: 0, bitsPerSecond: [0.4 * mega, 4 * mega] }, 1, /4\.0 Mbit\/s/],
    ['from the lowest it may rise by two', { current: 0, bitsPerSecond: [4 * mega, 4 * mega] }, 2, /4\.0 Mbit\/s/],
    ['the last segment came too slowly: it falls at once', { current: 2, bitsPerSecond: [4 * mega, 0.4 * mega] }, 0, /0\.4 Mbit\/s/],
    ['it came too slowly, and hardly anything is ahead: it falls to the lowest', { current: 2, bitsPerSecond: [4 * mega, 1.2 * mega], aheadSeconds: 0.5 }, 0, /1\.2 Mbit\/s/],
    ['the line bears not even the lowest: the lowest', { current: 2, bitsPerSecond: [0.1 * mega] }, 0, /0\.1 Mbit\/s/],
    ['a rate a little above the line is kept to until it falls short', { current: 1, bitsPerSecond: [0.9 * mega] }, 1, /0\.9 Mbit\/s/],
    ['too little is ahead: it does not rise', { bitsPerSecond: [4 * mega, 4 * mega], aheadSeconds: 0.3 }, 1, /too little is ahead/],
    ['decoding takes too long: it falls, whatever the line', { bitsPerSecond: [4 * mega, 4 * mega], decodeShare: 0.9 }, 0, /decoding takes too long/],
    ['decoding takes half of the time: it does not rise', { bitsPerSecond: [4 * mega, 4 * mega], decodeShare: 0.5 }, 1, /50 % of the time/],
])
    test(what, () => {
        const choice = chooseRung(state(more));
        assert.equal(choice.rung, rung);
        assert.match(choice.reason, reason);
    });

const arriving = (more) => ({
    bitsLeft: 1.5 * mega, bitsPerSecond: 4 * mega, aheadSeconds: 3, segmentSeconds: 1, rung: 2, lowestBits: 0.3 * mega, ...more,
});

for (const [what, more, expected] of [
    ['a segment that comes in time is waited for', {}, false],
    ['one that would come too late is given up', { bitsPerSecond: 0.4 * mega }, true],
    ['one of the lowest rung is waited for, however long', { bitsPerSecond: 0.01 * mega, rung: 0 }, false],
    ['one of which nothing comes is given up', { bitsPerSecond: 0 }, true],
    ['one that is nearly here is waited for', { bitsPerSecond: 0.1 * mega, bitsLeft: 0.2 * mega }, false],
])
    test(what, () => assert.equal(shouldGiveUp(arriving(more)), expected));

// ---- in Chromium ------------------------------------------------------------------------------------------------------

test('a player begins low, rises, and shows each frame of the stream once, at its time', options, async () => {
    const work = await mkdtemp(join(tmpdir(), 'htvm-ladder-'));
    const run = (...words) => execFileSync(program, [...words, '--quiet']);
    const frames = 180;
    run('synth', join(work, 'capture'), '--motion', 'fast', '--frames', `${frames}`, '--vertices', '4000');
    await mkdir(join(work, 'ladder'));
    run('encode', join(work, 'capture'), '--ladder', 'q20,q60', '--segment', '1', '-o', join(work, 'ladder', 'dancer.m3u8'));
    const server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: work, ladder: join(work, 'ladder') }).start();
    const browser = await launch();
    try {
        const page = await browser.newPage();
        await page.goto(`${server.origin}/page.html`);
        await page.waitForFunction(() => window.ready);
        await page.evaluate(() => window.test.open({ src: '/ladder/dancer.m3u8' }));
        const shown = await page.evaluate(async () => {
            const rungs = [];
            window.test.player.addEventListener('framepresented', () => rungs.push(window.test.player.statistics.ladder.shown));
            window.test.player.play();
            await window.test.run();
            return { rungs, frames: window.test.frames.map(({ frame, time }) => ({ frame, time })) };
        });
        assert.deepEqual(shown.frames.map(({ frame }) => frame), Array.from({ length: frames }, (_, frame) => frame));
        for (const { frame, time } of shown.frames) assert.ok(Math.abs(time - frame / 30) < 0.001, `frame ${frame} at ${time}`);
        assert.equal(shown.rungs[0], 0);
        assert.equal(shown.rungs.at(-1), 1);
        const rise = shown.rungs.indexOf(1);
        assert.ok(shown.rungs.slice(rise).every((rung) => rung === 1), 'it does not go back');
        assert.deepEqual(await page.evaluate(() => window.test.notices), []);
    } finally {
        await browser.close();
        server.stop();
        await rm(work, { recursive: true });
    }
});
