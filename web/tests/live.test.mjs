// A live stream's clock, source and decoding under Node, in virtual time: nothing waits for time to pass.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { conformance, packet, packetsOf, firstSequence } from './streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const sources = ['live_clock', 'live_source', 'live_state', 'live_session', 'playback'];

let LiveClock, LiveSource, LiveState, LiveSession, Playback, DecoderModule;
let module, stream;

before(async () => {
    const contents = [...sources.map((name) => `export * from './${name}.ts';`), "export * from '@htvm/decoder';"].join('\n');
    const { outputFiles } = await build({
        stdin: { contents, resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm', platform: 'node', write: false,
        logLevel: 'error',
    });
    ({ LiveClock, LiveSource, LiveState, LiveSession, Playback, DecoderModule } = await import(
        `data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
    module = await DecoderModule.load(await readFile(path('../packages/decoder/dist/htvm_decoder.wasm')));
    stream = packetsOf(firstSequence(await conformance('tracked_by_chance')));
    // Once, so that later the compiler takes no time.
    const decoder = module.createDecoder();
    for (const { bytes } of stream) {
        decoder.sendPacket(bytes);
        decoder.receive();
    }
    decoder.close();
});

// ---- the clock ----------------------------------------------------------------------------------------------------

// A pseudo-random number in 0..1 for each whole number.
const noise = (n) => (((n * 2654435761) ^ (n >>> 3)) >>> 8) % 65536 / 65536;
const frameMs = 1000 / 30;

/**
 * Frames at 30 a second, each `transit(n, ms)` on its way, seen at every 1/60 s. ppm: how much faster the viewer's clock is.
 * Tells of each picture: the time, how long ago what it shows was sent, the speed, and whether the frame that is due is there.
 */
function watch({ seconds, transit, ppm = 0 }) {
    const clock = new LiveClock();
    const arrivals = [];
    for (let n = 0; n * frameMs < 1000 * seconds; ++n) {
        const sent = n * frameMs;
        arrivals.push({ presentUs: sent * 1000, at: sent * (1 + ppm * 1e-6) + transit(n, sent) });
    }
    arrivals.sort((a, b) => a.at - b.at);
    const pictures = [];
    let next = 0;
    let newest = null;
    let before = null;
    for (let now = arrivals[0].at; now < 1000 * seconds; now += 1000 / 60) {
        for (; next < arrivals.length && arrivals[next].at <= now; ++next) {
            clock.ready('frame', arrivals[next].at, arrivals[next].presentUs);
            newest = Math.max(newest ?? 0, arrivals[next].presentUs);
        }
        const presentUs = clock.presentUs(now);
        const late = presentUs > newest + 1000 * frameMs;
        if (presentUs > newest + 1000 * frameMs + 50000) clock.tooLate(now, newest);
        else clock.inTime();
        const delay = now - (presentUs / 1000) * (1 + ppm * 1e-6);
        const speed = before === null ? 1 : (presentUs - before.presentUs) / 1000 / (now - before.now);
        before = { presentUs, now };
        pictures.push({ ms: now, delay, late, speed });
    }
    return { clock, pictures, from: (ms, until = Infinity) => pictures.filter((picture) => picture.ms >= ms && picture.ms < until) };
}

const most = (pictures, name) => Math.max(...pictures.map((picture) => picture[name]));
const least = (pictures, name) => Math.min(...pictures.map((picture) => picture[name]));
const lateShare = (pictures) => pictures.filter(({ late }) => late).length / pictures.length;

test('on a quiet line what comes is shown within 30 ms, and nothing is late', () => {
    const { from } = watch({ seconds: 30, transit: (n) => 20 + 5 * noise(n) });
    assert.ok(most(from(0), 'delay') < 20 + 5 + 55, 'from the beginning on');
    assert.ok(most(from(10000), 'delay') < 20 + 30, `${most(from(10000), 'delay')}`);
    assert.equal(lateShare(from(2000)), 0);
});

test('the buffer grows with jitter by at most 20 ms a second, and shrinks ten seconds after it by at most 10 ms a second', () => {
    const jitter = (ms) => (ms > 15000 && ms < 45000 ? 100 : 5);
    const { from } = watch({ seconds: 90, transit: (n, ms) => 20 + jitter(ms) * noise(n) });
    const grown = from(25000, 44000);
    assert.ok(least(grown, 'delay') > 110 && most(grown, 'delay') < 140, `${least(grown, 'delay')} to ${most(grown, 'delay')}`);
    assert.ok(lateShare(grown) < 0.02, `${lateShare(grown)}`);
    assert.ok(most(from(75000), 'delay') < 50, `${most(from(75000), 'delay')}`);
    const speeds = from(2100);
    assert.ok(least(speeds, 'speed') > 0.9799 && most(speeds, 'speed') < 1.0101, `${least(speeds, 'speed')} to ${most(speeds, 'speed')}`);
});

for (const ppm of [200, -200])
    test(`clocks that drift apart by ${ppm} ppm are followed for 20 minutes, in which they get 240 ms apart`, () => {
        const { from } = watch({ seconds: 1200, ppm, transit: (n) => 20 + 5 * noise(n) });
        const later = from(20000);
        assert.ok(least(later, 'delay') > 20 && most(later, 'delay') < 55, `${least(later, 'delay')} to ${most(later, 'delay')}`);
        assert.ok(lateShare(later) < 0.001);
        assert.ok(least(later, 'speed') > 0.99 && most(later, 'speed') < 1.01);
    });

test('a way that becomes 400 ms longer makes the clock jump within 0.3 s, and one that becomes shorter within 11 s', () => {
    const { from } = watch({ seconds: 60, transit: (n, ms) => (ms > 20000 && ms < 40000 ? 420 : 20) + 5 * noise(n) });
    assert.equal(lateShare(from(20800, 39000)), 0);
    assert.ok(most(from(22000, 39000), 'delay') < 480);
    assert.ok(most(from(51500), 'delay') < 80, `${most(from(51500), 'delay')}`);
});

test('a second without anything, made up for at once, does not change the clock', () => {
    // Frames of that second come together at its end.
    const { from } = watch({ seconds: 60, transit: (n, ms) => 20 + 5 * noise(n) + (ms > 20000 && ms < 21000 ? 21000 - ms : 0) });
    assert.ok(lateShare(from(20100, 20900)) > 0.9, 'in it there is nothing to show');
    assert.equal(lateShare(from(21200)), 0);
    assert.ok(most(from(35000), 'delay') < 350);
    assert.ok(most(from(58000), 'delay') < 120, `${most(from(58000), 'delay')}`);
});

test('of what comes late at the beginning, because it was catching up, nothing is left after a few seconds', () => {
    const { from } = watch({ seconds: 20, transit: (n) => 20 + 5 * noise(n) + Math.max(0, 3000 - 100 * n) });
    assert.ok(most(from(6000), 'delay') < 60, `${most(from(6000), 'delay')}`);
});

test('behind is by the fastest of ten heartbeats', () => {
    const clock = new LiveClock();
    assert.ok(Number.isNaN(clock.behindMs(0, 0)));
    for (const [at, late] of [[1000, 50], [2000, 10], [3000, 70]]) clock.publisher(at + late, at * 1000);
    assert.equal(clock.behindMs(3200, 2.9e6), 290);
    // Another run of the publisher is another clock.
    clock.publisher(4000, 100e6);
    assert.equal(clock.behindMs(4300, 100.2e6), 100);
});

// ---- what is shown ------------------------------------------------------------------------------------------------

/** A live playback whose worker is the test. */
async function showing() {
    const sent = [];
    const state = { now: 1000 };
    const worker = { postMessage: (request) => sent.push(request), terminate: () => undefined };
    const said = [];
    const listener = Object.fromEntries(
        ['opened', 'extent', 'arrived', 'sound', 'jumped', 'sought', 'waiting', 'ended', 'notice', 'failed', 'restarted', 'live'].map((name) =>
            [name, () => said.push(name)]));
    const playback = new Playback(async () => worker, 'decoder.wasm', () => state.now, listener);
    playback.open('ws://a.example/watch/me', 'live');
    playback.play();
    await new Promise(setImmediate);
    const { serial } = sent[0];
    return {
        playback, sent, state, said,
        take: (report) => worker.onmessage({ data: report }),
        /** Frame n, of n / 30 s, comes now. */
        give: (n, preview = false) => {
            const ms = performance.timeOrigin + performance.now();
            worker.onmessage({
                data: {
                    type: 'frame', serial, frame: n, timeUs: (n * 1e6) / 30, presentUs: (n * 1e6) / 30, durationUs: 1e6 / 30, preview, topology: 0,
                    indices: null, buffer: new ArrayBuffer(16), live: { receivedMs: ms, decodedMs: ms, readyMs: ms, leftOut: 0 },
                },
            });
        },
        /** The numbers of the frames shown until then, a picture each 1/60 s. */
        until: (ms) => {
            const shown = [];
            for (; state.now < ms; state.now += 1000 / 60) {
                const frame = playback.tick();
                if (frame) shown.push(frame.frame);
            }
            return shown;
        },
    };
}

// 100 frames as they should come, shown one after the other.
function smoothly({ give, until }) {
    const shown = [];
    for (let n = 0; n < 100; ++n) {
        give(n);
        shown.push(...until(1000 + (n + 1) * frameMs));
    }
    assert.deepEqual(shown, Array.from({ length: shown.length }, (_, i) => i));
    assert.ok(shown.length >= 98);
}

test('frames that come too late are not shown, but those behind them, which come in time', async () => {
    const scene = await showing();
    smoothly(scene);
    const { give, until, playback } = scene;
    // For half a second nothing comes, then all of it at once.
    const begin = 1000 + 100 * frameMs;
    assert.ok(until(begin + 500).length <= 2);
    const shown = [];
    for (let n = 100; n < 120; ++n) {
        give(n);
        shown.push(...until(Math.max(begin + 500 + (n - 99), 1000 + (n + 1) * frameMs)));
    }
    assert.ok(shown[0] >= 111 && shown[0] <= 114 && shown.at(-1) >= 118, `${shown}`);
    assert.ok(playback.live.notShown >= 10);
});

test('where all frames have become late, they are shown after 0.2 s', async () => {
    const scene = await showing();
    smoothly(scene);
    const { give, until } = scene;
    const shown = [];
    for (let n = 100; n < 130; ++n) {
        until(1250 + n * frameMs);
        give(n);
        shown.push(...until(1250 + (n + 1) * frameMs));
    }
    assert.ok(shown[0] >= 103 && shown[0] <= 109, `${shown}`);
    assert.deepEqual(shown, Array.from({ length: shown.length }, (_, i) => shown[0] + i));
});

test('a frame that came in time is shown however late drawing is', async () => {
    const { give, until, state, playback } = await showing();
    for (let n = 0; n < 10; ++n) {
        give(n);
        until(1000 + (n + 1) * frameMs);
    }
    for (let n = 10; n < 20; ++n) {
        give(n);
        state.now += frameMs;
    }
    state.now += 400; // the page was busy
    assert.equal(playback.tick().frame, 19);
});

test('paused, the worker rests with the picture that there is; played again, it joins anew', async () => {
    const { give, until, playback, sent } = await showing();
    give(0, true);
    assert.deepEqual(until(1020), [0]);
    playback.pause();
    assert.equal(sent.at(-1).type, 'rest');
    playback.play();
    assert.equal(sent.at(-1).type, 'seek');
    playback.hide();
    assert.equal(sent.at(-1).type, 'rest');
    playback.show();
    assert.equal(sent.at(-1).type, 'seek');
});

// ---- words --------------------------------------------------------------------------------------------------------

test('what is said of a live stream', () => {
    const state = new LiveState();
    const say = (shown = true, behindMs = 200) => {
        const { state: name, text } = state.describe(shown, behindMs);
        return `${name}: ${text}`;
    };
    const link = (name, reason = '') => state.report({ type: 'link', link: name, reason });
    const beat = (published) => state.report({ type: 'heartbeat', atMs: 0, published, clockUs: 0, viewers: 3, dropped: 7 });
    assert.equal(say(false), 'connecting: Connecting');
    link('open');
    assert.equal(say(false), 'waiting: Waiting for the first picture');
    assert.equal(say(), 'live: Live');
    assert.equal(say(true, 1432), 'behind: 1.4 s behind');
    beat(false);
    assert.equal(say(), 'gone: Publisher gone');
    beat(true);
    assert.equal(say(), 'live: Live');
    assert.deepEqual([state.viewers, state.droppedByHub], [3, 7]);
    state.report({ type: 'gone', reason: 'its connection ended' });
    assert.equal(say(), 'gone: Publisher gone');
    state.frame();
    assert.equal(say(), 'live: Live');
    link('reconnecting', 'the hub shuts down');
    assert.equal(say(), 'reconnecting: Reconnecting: the hub shuts down');
    link('ended');
    assert.equal(say(), 'ended: The stream has ended');
});

// ---- the source ---------------------------------------------------------------------------------------------------

/** A network in virtual time: `sockets` are all that were asked for, `fetches` likewise. */
class Network {
    time = 0;
    sockets = [];
    fetches = [];
    #timers = [];

    get surroundings() {
        return {
            now: () => this.time,
            random: () => 1,
            after: (milliseconds, callback) => {
                const timer = { at: this.time + milliseconds, callback };
                this.#timers.push(timer);
                return () => (this.#timers = this.#timers.filter((other) => other !== timer));
            },
            socket: (address, protocol) => {
                const socket = { address, protocol, at: this.time, sent: [], closed: false, send: (text) => socket.sent.push(text), close: () => (socket.closed = true) };
                this.sockets.push(socket);
                return socket;
            },
            fetch: (address) => new Promise((resolve, reject) => this.fetches.push({ address, resolve, reject })),
        };
    }

    async advance(milliseconds) {
        const until = this.time + milliseconds;
        for (;;) {
            await new Promise(setImmediate);
            this.#timers.sort((a, b) => a.at - b.at);
            if (!(this.#timers[0]?.at <= until)) break;
            this.time = this.#timers[0].at;
            this.#timers.shift().callback();
        }
        this.time = until;
    }
}

function watching(url = 'https://a.example/watch/me?key=1&signature=ab') {
    const network = new Network();
    const log = [];
    const source = new LiveSource(url, {
        packet: ({ kind, frame }, first) => log.push(`packet ${kind} ${frame}${first ? ' first' : ''}`),
        message: (message) => log.push(message.type),
        link: (link, reason) => log.push(reason ? `${link}: ${reason}` : link),
        failed: ({ code, message }) => log.push(`failed ${code}: ${message}`),
    }, network.surroundings);
    source.connect();
    return { network, source, log, last: () => network.sockets.at(-1), said: () => log.splice(0) };
}

const open = (socket) => socket.onopen();
const hear = (socket, data) => socket.onmessage({ data: typeof data === 'string' || data instanceof ArrayBuffer ? data : JSON.stringify(data) });
const bytesOf = ({ bytes }) => bytes.slice().buffer;

test('a socket with the protocol of the hub, whose path and query are kept, gives packets and messages', () => {
    const { last, said } = watching();
    assert.deepEqual([last().address, last().protocol], ['wss://a.example/watch/me?key=1&signature=ab', 'htvm.1']);
    open(last());
    hear(last(), { type: 'hello', version: 1, stream: 'me', session: '0123456789abcdef', hubs: [], later: true });
    for (const one of stream.slice(0, 2)) hear(last(), bytesOf(one));
    hear(last(), { type: 'heartbeat', published: true, clock: 5, viewers: 1, dropped: 0 });
    assert.deepEqual(said(), ['connecting', 'open', 'hello', 'packet 1 0 first', 'packet 2 0', 'heartbeat']);
});

test('what is no message or no packet is passed over', () => {
    const { last, said } = watching();
    open(last());
    for (const text of ['', '7', 'null', '{', '{"type":"later"}', '{"type":"stamp","frame":1e99}', `{"type":"gone","reason":"${'x'.repeat(5000)}"}`]) hear(last(), text);
    hear(last(), new Uint8Array(100).buffer);
    hear(last(), bytesOf(stream[0]).slice(0, 90)); // cut off: what follows is whole
    hear(last(), bytesOf(stream[1]));
    assert.deepEqual(said(), ['connecting', 'open', 'packet 2 0 first']);
});

test('after three seconds of silence it connects again, to the next address, pausing longer each time up to 3 s', async () => {
    const { network, last, said } = watching();
    open(last());
    hear(last(), { type: 'hello', hubs: ['wss://b.example:8080', 'wss://a.example', 'javascript:alert(1)', 7] });
    await network.advance(2900);
    hear(last(), bytesOf(stream[0]));
    await network.advance(2900);
    assert.equal(network.sockets.length, 1);
    said();
    await network.advance(200);
    assert.deepEqual([said(), network.sockets.length, network.sockets[0].closed], [['reconnecting'], 2, true]);
    assert.equal(last().address, 'wss://b.example:8080/watch/me?key=1&signature=ab');
    // Nothing answers any more: neither sockets nor bodies.
    const pauses = [];
    for (let i = 0; i < 8; ++i) {
        const { at } = last();
        last().onclose({ code: 1006, reason: '' });
        await network.advance(0);
        network.fetches.at(-1).reject(new Error('no connection'));
        await network.advance(3001);
        pauses.push(network.sockets.at(-1).at - at);
        network.time = network.sockets.at(-1).at;
    }
    assert.deepEqual(pauses, [200, 400, 800, 1600, 3000, 3000, 3000, 3000]);
    assert.deepEqual(new Set(network.sockets.map(({ address }) => new URL(address).host)), new Set(['a.example', 'b.example:8080']));
});

test('where no socket can be opened, the endless body serves, and the socket is tried first again', async () => {
    const { network, last, said } = watching('ws://a.example/watch/me');
    last().onclose({ code: 1006, reason: '' });
    assert.equal(network.fetches[0].address, 'http://a.example/watch/me');
    let body;
    network.fetches[0].resolve(new Response(new ReadableStream({ start: (controller) => (body = controller) })));
    await network.advance(0);
    const both = Buffer.concat([stream[0].bytes, stream[1].bytes]);
    body.enqueue(both.subarray(0, 100));
    await network.advance(0);
    body.enqueue(both.subarray(100));
    await network.advance(0);
    assert.deepEqual(said(), ['connecting', 'open', 'packet 1 0 first', 'packet 2 0']);
    body.close();
    await network.advance(200);
    assert.deepEqual([said(), network.sockets.length], [['reconnecting'], 2]);
});

for (const [status, words] of [[404, /^failed missing: There is no live stream at http:\/\/a\.example.*404/], [403, /^failed refused: .*403/]])
    test(`where neither is given, status ${status} says why`, async () => {
        const { network, last, said } = watching('ws://a.example/watch/me');
        last().onclose({ code: 1006, reason: '' });
        network.fetches[0].resolve(new Response(null, { status }));
        await network.advance(0);
        assert.match(said().at(-1), words);
        await network.advance(60000);
        assert.equal(network.sockets.length, 1);
    });

for (const [code, said] of [
    [1000, 'ended: goodbye'], [1001, 'reconnecting: goodbye'], [1008, 'failed refused: The hub ended the connection: goodbye.'],
    [1009, 'failed refused: The hub ended the connection: goodbye.'], [1011, 'reconnecting: goodbye'], [1013, 'reconnecting: goodbye'],
    [4001, 'failed refused: The hub ended the connection: goodbye.'],
])
    test(`closing with code ${code}: ${said}`, async () => {
        const { network, last, said: all } = watching();
        open(last());
        last().onclose({ code, reason: 'goodbye' });
        assert.equal(all().at(-1), said);
        await network.advance(4000);
        assert.equal(network.sockets.length > 1, said.startsWith('reconnecting'));
        if (code === 1013) assert.equal(network.sockets[1].at, 1000);
    });

test('a stream that has ended is looked for again, and goes on without a word in between once it is there', async () => {
    const { network, last, said } = watching();
    open(last());
    last().onclose({ code: 1000, reason: 'goodbye' });
    assert.equal(said().at(-1), 'ended: goodbye');
    for (let look = 1; look <= 3; ++look) {
        await network.advance(5000);
        assert.equal(network.sockets.length, 1 + look);
        last().onopen();
        last().onclose({ code: 1013, reason: 'there is no such stream' });
    }
    await network.advance(5000);
    last().onopen();
    assert.deepEqual(said(), []);
    hear(last(), bytesOf(stream[0]));
    assert.deepEqual(said(), ['open', 'packet 1 0 first']);
});

test('a viewer by body who was watching tries for 30 s more where the stream is missing, as at a hub that has just started', async () => {
    const { network, last, said } = watching('ws://a.example/watch/me');
    const body = async (response) => {
        last().onclose({ code: 1006, reason: '' });
        await network.advance(0);
        network.fetches.at(-1).resolve(response);
        await network.advance(0);
    };
    await body(new Response(stream[0].bytes));
    while (network.time < 29000) {
        assert.equal(said().at(-1), 'reconnecting');
        await network.advance(3000);
        await body(new Response(null, { status: 404 }));
    }
    await network.advance(3000);
    await body(new Response(null, { status: 404 }));
    assert.match(said().at(-1), /^failed missing/);
});

test('a key frame is asked for at most once a second', async () => {
    const { network, source, last } = watching();
    source.askForKeyFrame(); // there is nobody to ask yet
    open(last());
    for (const pause of [0, 500, 499, 1, 10]) {
        await network.advance(pause);
        source.askForKeyFrame();
    }
    assert.deepEqual(last().sent, ['{"type":"key_frame"}', '{"type":"key_frame"}']);
});

// ---- decoding -----------------------------------------------------------------------------------------------------

/** A live session without a network: `give` is what the hub sends, `frames` what the page is sent. */
function decoding({ room = 100 } = {}) {
    const reports = [];
    const asked = [];
    const state = { now: 1e6 };
    let listener;
    const session = new LiveSession(
        { type: 'open', url: 'ws://a.example/watch/me', serial: 1, source: 'live' }, module, (report) => reports.push(report),
        (given) => {
            listener = given;
            return { connect: () => asked.push('connect'), close: () => asked.push('close'), askForKeyFrame: () => asked.push('key frame') };
        },
        () => state.now);
    session.request({ type: 'room', frames: room });
    void session.run();
    let first = true;
    return {
        session, reports, asked, state, listener,
        give: (one) => {
            listener.packet(one, first);
            first = false;
        },
        reconnect: () => (first = true),
        /** Until nothing more comes of it. */
        settle: async () => {
            for (let before = -1; reports.length !== before; ) {
                before = reports.length;
                await new Promise((resolve) => setTimeout(resolve, 40));
            }
        },
        /** Numbers of the frames sent since the last call, previews in brackets. */
        frames: () => {
            const out = reports.filter(({ type }) => type === 'frame').map(({ frame, preview }) => (preview ? `(${frame})` : frame));
            for (let i = reports.length - 1; i >= 0; --i) if (reports[i].type === 'frame') reports.splice(i, 1);
            return out;
        },
    };
}

const again = ({ kind, bytes, frame, reference, timestampUs, flags }, byFrames, byUs = Math.round((byFrames * 1e6) / 30)) => {
    const made = packet(kind, bytes.slice(32, -4), { frame: frame + byFrames, reference: reference + byFrames, timestampUs: timestampUs + byUs, flags });
    return packetsOf(made)[0];
};

test('of what the newest frame needs, the first picture and the newest are sent, then every frame', async () => {
    const { give, settle, frames } = decoding();
    for (const one of stream.slice(0, 9)) give(one);
    await settle();
    assert.deepEqual(frames(), ['(0)', 7]);
    for (const one of stream.slice(9, 11)) {
        give(one);
        await settle();
    }
    assert.deepEqual(frames(), [8, 9]);
});

test('a connection that begins again with what was seen goes on behind it', async () => {
    const { give, settle, frames, reconnect } = decoding();
    for (const one of stream.slice(0, 9)) give(one);
    await settle();
    frames();
    reconnect();
    for (const one of stream.slice(0, 10)) give(one);
    await settle();
    assert.deepEqual(frames(), [8]);
});

test('a new session goes on in present time, as much later as it arrives', async () => {
    const { give, settle, reports, state } = decoding();
    give(stream[0]);
    for (const one of stream.slice(1, 4)) {
        give(one);
        await settle();
    }
    const header = stream[0].bytes.slice(32, -4);
    header[7] ^= 1; // the lattice's origin
    state.now += 40;
    give(packetsOf(packet(1, header))[0]);
    give(again(stream[1], 0, -1e9));
    await settle();
    const sent = reports.filter(({ type }) => type === 'frame');
    const [before, after] = sent.slice(-2);
    assert.deepEqual([after.letter, after.frame, after.presentUs - before.presentUs], ['I', 0, 40000]);
    assert.equal(reports.filter(({ type }) => type === 'opened').length, 2);
});

test('frames whose reference is missing make it ask for a key frame, and the next I-frame is shown', async () => {
    const { give, settle, frames, asked } = decoding();
    const tracked = stream.findIndex(({ kind }, i) => i > 2 && kind === 7);
    for (const one of stream.slice(0, 2)) give(one);
    await settle();
    assert.deepEqual(asked, ['connect']);
    give(again(stream[tracked], 40));
    await settle();
    assert.deepEqual(asked, ['connect', 'key frame']);
    give(again(stream[1], 50));
    await settle();
    assert.deepEqual(frames(), [0, 50]);
});

test('a page that takes no frames holds up a bounded number of packets, and goes on at the newest place to start', async () => {
    const { give, settle, frames, session, state, reports } = decoding({ room: 1 });
    const group = stream.slice(1, 6);
    give(stream[0]);
    for (let round = 0; round < 40; ++round)
        for (const one of group) {
            give(again(one, round * group.length));
            state.now += 1000 / 30;
        }
    await settle();
    const buffer = reports.find(({ type }) => type === 'frame').buffer;
    assert.equal(frames().length, 1);
    session.request({ type: 'room', frames: 100 });
    session.request({ type: 'done', buffer });
    await settle();
    const shown = frames();
    assert.ok(shown.length <= group.length && shown.at(-1) === 40 * group.length - 1, `${shown}`);
    assert.ok(reports.findLast(({ type }) => type === 'memory').heldBytes < 1 << 24);
});

/**
 * A stream of one I-frame, a patch, and T-frames from then on. Those that `anew` tells refer to the patch alone, the others to
 * the frame before; of these only the first behind each can be decoded.
 */
async function patchedStream(frames, anew) {
    const [header, intra, , patched, first, next] = packetsOf(await conformance('patched_4'));
    const patch = packet(11, patched.bytes.slice(32, -4), { ...patched, frame: 1, reference: 0 });
    const out = [header, intra, packetsOf(patch)[0]];
    for (let frame = 2; frame < frames; ++frame) {
        const alone = frame === 2 || anew(frame);
        const of = alone ? first : next;
        const timestampUs = intra.timestampUs + Math.round((frame * 1e6) / 30);
        const reference = alone ? 1 : frame - 1;
        out.push(packetsOf(packet(7, of.bytes.slice(32, -4), { frame, reference, timestampUs, flags: alone ? 131 : 129 }))[0]);
    }
    return out;
}

test('a page that falls behind goes on at the newest frame that needs the reference alone, which it keeps', async () => {
    const { give, settle, frames, session, state, reports, asked } = decoding({ room: 1 });
    for (const one of await patchedStream(95, (frame) => frame % 10 === 3)) {
        give(one);
        state.now += 1000 / 30;
    }
    await settle();
    const buffer = reports.find(({ type }) => type === 'frame').buffer;
    assert.deepEqual(frames(), [0]);
    session.request({ type: 'room', frames: 100 });
    session.request({ type: 'done', buffer });
    await settle();
    assert.deepEqual(frames(), [1, 93, 94]);
    assert.deepEqual(asked, ['connect']);
});

test('where T-frames alone were thrown away, it goes on at the next one that needs none of them', async () => {
    const { give, settle, frames, session, state, asked } = decoding({ room: 3 });
    const stream = await patchedStream(122, (frame) => frame === 120);
    for (const one of stream.slice(0, 4)) {
        give(one);
        await settle();
    }
    assert.deepEqual(frames(), [0, 1, 2]);
    for (const one of stream.slice(4, 110)) {
        give(one);
        state.now += 1000 / 30;
    }
    await settle();
    assert.deepEqual(asked, ['connect', 'key frame']);
    session.request({ type: 'room', frames: 100 });
    for (const one of stream.slice(110)) give(one);
    await settle();
    assert.deepEqual(frames(), [120, 121]);
});

test('a hidden page closes the connection, and a shown one begins a new one', async () => {
    const { session, asked } = decoding();
    session.request({ type: 'rest' });
    session.request({ type: 'seek', serial: 2, timeUs: 0 });
    assert.deepEqual(asked, ['connect', 'close', 'connect']);
});
