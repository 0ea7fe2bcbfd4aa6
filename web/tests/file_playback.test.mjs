// Which frame of a file is shown when, under Node, in virtual time: the worker is the test. live.test.mjs has live streams.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const frameUs = 40000; // 25 a second, so that times are whole numbers
const pictureMs = 10;
const names = ['opened', 'extent', 'arrived', 'sound', 'jumped', 'sought', 'waiting', 'ended', 'notice', 'failed', 'restarted', 'live'];

let Playback;

before(async () => {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/playback.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    ({ Playback } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
});

/** A playback of a file of 300 frames, or of a live stream, whose clock is `state.now`. */
async function playing(source = 'file') {
    const sent = [];
    const said = [];
    const state = { now: 1000 };
    let serial = 0;
    const worker = {
        postMessage: (request) => {
            sent.push(request);
            serial = request.serial ?? serial;
        },
        terminate: () => undefined,
    };
    const playback = new Playback(
        async () => worker, 'decoder.wasm', () => state.now, Object.fromEntries(names.map((name) => [name, () => said.push(name)])));
    playback.open('https://a.example/person.htvm', source);
    await new Promise(setImmediate);
    const take = (report) => worker.onmessage({ data: report });
    take({ type: 'extent', durationUs: 300 * frameUs });
    return {
        playback, said, state, serial: () => serial,
        requests: () => sent.splice(0).map(({ type }) => type),
        /** Frames from the first to the last, of that serial, come now. */
        give: (first, last, { of = serial, preview = false } = {}) => {
            for (let frame = first; frame <= last; ++frame) {
                const timeUs = frame * frameUs;
                take({
                    type: 'frame', serial: of, frame, timeUs, presentUs: timeUs, durationUs: frameUs, preview, topology: 0, indices: null,
                    buffer: new ArrayBuffer(16), live: null,
                });
            }
        },
        end: () => take({ type: 'ended', serial, frames: 300, durationUs: 300 * frameUs }),
        /** The numbers of the frames shown in so many frames' time. */
        run: (frames) => {
            const shown = [];
            const until = state.now + (frames * frameUs) / 1000;
            for (; state.now < until; state.now += pictureMs) {
                const frame = playback.tick();
                if (frame) shown.push(frame.frame);
            }
            return shown;
        },
    };
}

test('paused it shows the first frame and stands; playing, each at its time', async () => {
    const { playback, give, run } = await playing();
    give(0, 9);
    assert.deepEqual(run(5), [0]);
    playback.play();
    assert.deepEqual(run(4.5), [1, 2, 3, 4]);
    playback.pause();
    assert.deepEqual(run(5), []);
    playback.play();
    assert.deepEqual(run(2), [5, 6]);
});

test('at twice the rate every other frame is shown, where pictures are that far apart', async () => {
    const { playback, give, state } = await playing();
    give(0, 9);
    playback.setRate(2);
    playback.play();
    const shown = [];
    for (let n = 0; n < 4; ++n, state.now += frameUs / 1000) shown.push(playback.tick().frame);
    assert.deepEqual(shown, [0, 2, 4, 6]);
});

test('where frames are missing it says so once, stands still, and goes on from there', async () => {
    const { playback, give, run, said } = await playing();
    give(0, 1);
    playback.play();
    assert.deepEqual(run(20), [0, 1]);
    assert.deepEqual([playback.stalled, said.filter((name) => name === 'waiting').length], [true, 1]);
    assert.equal(playback.timeUs, 2 * frameUs);
    give(2, 6);
    assert.deepEqual(run(3.5), [2, 3, 4, 5]);
});

test('a seek shows a preview at once and takes no time until its frame has come; what was decoded for another place goes back', async () => {
    const { playback, give, run, said, serial, requests } = await playing();
    give(0, 3);
    playback.play();
    run(1.5);
    const before = serial();
    requests();
    playback.seek(100.5 * frameUs);
    assert.deepEqual(requests(), ['seek', 'done', 'done']);
    give(4, 5, { of: before });
    assert.deepEqual(requests(), ['done', 'done']);
    give(90, 90, { preview: true });
    assert.deepEqual(run(10), [90]);
    assert.equal(playback.timeUs, 100.5 * frameUs);
    assert.ok(!said.slice(said.lastIndexOf('jumped')).includes('sought'));
    give(100, 103);
    assert.ok(said.slice(said.lastIndexOf('jumped')).includes('sought'));
    assert.deepEqual(run(1.25), [100, 101], 'half of the first was over');
});

test('behind the last frame it ends, or begins again where it is to loop', async () => {
    const { playback, give, run, end, said, requests } = await playing();
    give(298, 299);
    end();
    playback.play();
    run(3);
    assert.deepEqual([playback.playing, said.filter((name) => name === 'ended').length], [false, 1]);
    requests();
    playback.play();
    assert.deepEqual([requests()[0], playback.soughtUs], ['seek', 0], 'played again, from the beginning');
    give(298, 299);
    end();
    playback.setLoop(true);
    run(3);
    assert.deepEqual([playback.playing, playback.soughtUs, said.filter((name) => name === 'ended').length], [true, 0, 1]);
});

test('hidden, the worker rests and the clock goes on; shown, it seeks to where that is', async () => {
    const { playback, give, run, state, requests } = await playing();
    give(0, 3);
    playback.play();
    run(1);
    requests();
    playback.hide();
    assert.deepEqual(requests(), ['rest']);
    state.now += 2000;
    playback.show();
    assert.equal(requests()[0], 'seek');
    assert.equal(playback.soughtUs, frameUs + 2e6);
});

test('a live stream has no other places and no other rates: nothing is asked of its worker', async () => {
    const { playback, requests } = await playing('live');
    requests();
    playback.play();
    playback.seek(5e6);
    playback.setRate(2);
    assert.deepEqual([playback.canSeek, playback.canChangeRate, playback.rate, requests()], [false, false, 1, []]);
});
