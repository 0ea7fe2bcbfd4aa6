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

let chooseRung, shouldGiveUp, Trials;

before(async () => {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/rung_choice.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    ({ chooseRung, shouldGiveUp, Trials } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
});

// ---- the choice -------------------------------------------------------------------------------------------------------

// came: what the line brought with each of the last segments, Mbit/s, and the share of its time that the segment took; where that
// is not told, it is what its rate would take.
const state = ({ came = [1.2, 1.2], ...more }) => {
    const out = { rungs: [0.3 * mega, 0.8 * mega, 2 * mega], current: 1, aheadSeconds: 4, segmentSeconds: 1, decodeShare: 0.1, restSeconds: 0, ...more };
    const shareAt = (rate) => out.rungs[out.current ?? 0] / (rate * mega);
    return { ...out, measured: came.map((one) => (Array.isArray(one) ? one : [one, shareAt(one)])).map(([rate, share]) => ({ bitsPerSecond: rate * mega, share })) };
};

for (const [what, more, rung, reason] of [
    ['a stream of one quality has no choice', { rungs: [mega], current: 0 }, 0, /only one/],
    ['before anything was measured it begins low', { current: null, came: [] }, 0, /begins low/],
    ['the line bears what is fetched: it stays', {}, 1, /1\.2 Mbit\/s/],
    ['the line bears more, twice in a row: it rises', { came: [4, 4] }, 2, /4\.0 Mbit\/s/],
    ['the line bore more only once: it stays', { came: [1, 4] }, 1, /4\.0 Mbit\/s/],
    ['the line bears more, but for one segment: it rises', { came: [4, 1, 4] }, 2, /4\.0 Mbit\/s/],
    ['the line bears far more than the next rung, if only once: it rises by one', { current: 0, came: [0.4, 4] }, 1, /4\.0 Mbit\/s/],
    ['from the lowest it may rise by two', { current: 0, came: [4, 4] }, 2, /4\.0 Mbit\/s/],
    ['the last segment came too slowly: it falls at once', { current: 2, came: [4, 0.4] }, 0, /0\.4 Mbit\/s/],
    ['it came too slowly, and hardly anything is ahead: it falls to the lowest', { current: 2, came: [4, 1.2], aheadSeconds: 0.5 }, 0, /1\.2 Mbit\/s/],
    ['the line bears not even the lowest: the lowest', { current: 2, came: [0.1] }, 0, /0\.1 Mbit\/s/],
    ['a segment that was given up came too slowly', { current: 2, came: [4, [0.4, Infinity]] }, 0, /0\.4 Mbit\/s/],
    ['a rate a little above the line is kept to until it falls short', { current: 1, came: [0.9] }, 1, /0\.9 Mbit\/s/],
    ['too little is ahead for the time that a finer segment takes more: it does not rise', { came: [4, 4], aheadSeconds: 0.1 }, 1, /too little is ahead/],
    ['near the end of a live stream little is ahead, but enough for that: it rises', { came: [4, 4], aheadSeconds: 0.16 }, 2, /4\.0 Mbit\/s/],
    ['for one rung it is enough, and for two it is not: it rises by one', { current: 0, came: [4, 4], aheadSeconds: 0.1 }, 1, /4\.0 Mbit\/s/],
    ['decoding takes too long: it falls, whatever the line', { came: [4, 4], decodeShare: 0.9 }, 0, /decoding takes too long/],
    ['decoding takes half of the time: it does not rise', { came: [4, 4], decodeShare: 0.5 }, 1, /50 % of the time/],
    ['a small segment that came in half of its time did not come too slowly', { came: [0.8, [0.3, 0.5]] }, 1, /0\.3 Mbit\/s/],
    ['one that took more of it did', { came: [0.8, [0.3, 0.51]] }, 0, /0\.3 Mbit\/s/],
])
    test(what, () => {
        const choice = chooseRung(state(more));
        assert.equal(choice.rung, rung);
        assert.match(choice.reason, reason);
        assert.ok(!choice.tried);
    });

// ---- small segments: they tell little of the line -----------------------------------------------------------------------

const small = [[0.4, 0.1], [0.4, 0.1]]; // a tenth of their time, and a rate that the next rung does not have
for (const [what, more, rung, tried] of [
    ['two small segments in a row came soon: the next rung is tried', {}, 1, true],
    ['one alone says too little', { came: [[0.4, 0.1]] }, 0, false],
    ['the one before did not come soon', { came: [[0.4, 0.26], [0.4, 0.1]] }, 0, false],
    ['a quarter of their time is soon', { came: [[0.4, 0.25], [0.4, 0.25]] }, 1, true],
    ['the rest after a trial in vain is not over', { restSeconds: 0.1 }, 0, false],
    ['too little is ahead', { aheadSeconds: 0.01 }, 0, false],
    ['a little is ahead, and a finer segment hardly comes later', { aheadSeconds: 0.02 }, 1, true],
    ['decoding takes half of the time', { decodeShare: 0.5 }, 0, false],
    ['from the highest there is nothing to try', { current: 2, came: [[2.5, 0.1], [2.5, 0.1]] }, 2, false],
    ['what the line brings is known to bear the next rung: that is no trial', { came: [[1.2, 0.1], [1.2, 0.1]] }, 1, false],
])
    test(`trials: ${what}`, () => {
        const choice = chooseRung(state({ current: 0, came: small, ...more }));
        assert.deepEqual([choice.rung, choice.tried ?? false], [rung, tried]);
    });

test('after each trial in vain none follows for twice as long, up to 64 s of the stream', () => {
    const trials = new Trials();
    const rests = [];
    for (let i = 0; i < 6; ++i) {
        assert.equal(trials.restSeconds, 0);
        trials.chose({ rung: 1, tried: true });
        trials.came(1);
        trials.chose({ rung: 0 });
        rests.push(trials.restSeconds);
        for (let second = 0; second < rests.at(-1); ++second) trials.came(1);
    }
    assert.deepEqual(rests, [4, 8, 16, 32, 64, 64]);
});

test('a rung that was tried and kept up for eight seconds is no trial any more, and the next rest is short again', () => {
    const trials = new Trials();
    const tryInVain = () => {
        trials.chose({ rung: 1, tried: true });
        trials.chose({ rung: 0 });
        return trials.restSeconds;
    };
    assert.deepEqual([tryInVain(), tryInVain()], [4, 8]);
    trials.chose({ rung: 1, tried: true });
    for (let second = 0; second < 8; ++second) {
        trials.came(1);
        trials.chose({ rung: 1 });
    }
    trials.chose({ rung: 0 });
    assert.equal(trials.restSeconds, 0, 'it fell for another reason');
    assert.equal(tryInVain(), 4);
});

test('whoever falls below a rung that was not tried may try at once', () => {
    const trials = new Trials();
    trials.chose({ rung: 2 });
    trials.chose({ rung: 0 });
    assert.equal(trials.restSeconds, 0);
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
