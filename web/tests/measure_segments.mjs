// What a viewer has of a stream in segments, with the real player: how soon the first frame is shown, how far it is behind the
// hub, every stall, and which rung was fetched and shown when.
//   htvm serve --segments 1 --parts 0.25 --trust-proxy 127.0.0.1 &   nginx -c $PWD/examples/cdn/hub.conf &
//   htvm encode CAPTURE --ladder 0.3,0.8,2 --segment 1 -o ws://localhost:8080/publish/NAME &
//   node web/tests/measure_segments.mjs http://localhost:8088/hls/NAME/master.m3u8 [SECONDS] [--line 4,0.4,4] [--webkit]
// In Chromium, which draws in software here; or in WebKitGTK, which needs a display (xvfb-run -a node ...); or, with --node, by the
// player's fetching alone, whose frames are taken when they are due and not decoded, on machines that cannot draw in time. --line: what the line
// carries, Mbit/s, one after the other, each for SECONDS, by a server between player and edge that sends so many bits a second
// and no more, all answers together; without it as much as this machine does.
// The dates in playlists say when frames came to the hub, by its clock, which must be this machine's.
import { createServer, request as ask } from 'node:http';
import { readFile } from 'node:fs/promises';
import { loadavg } from 'node:os';
import { spawn } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { isFrame } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';

const given = process.argv.slice(2);
const webkit = given.includes('--webkit');
const inNode = given.includes('--node');
const lineAt = given.indexOf('--line');
const line = lineAt < 0 ? null : given[lineAt + 1].split(',').map(Number);
const [address, seconds = '60'] = given.filter((word, i) => !word.startsWith('--') && (lineAt < 0 || i !== lineAt + 1));
if (!address || !(Number(seconds) > 0) || line?.some((one) => !(one > 0))) {
    console.error('usage: node web/tests/measure_segments.mjs http://HOST/hls/NAME/master.m3u8 [SECONDS] [--line MBITS,MBITS...] [--webkit | --node]');
    process.exit(2);
}
const stallMs = 200; // without a new frame
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const types = { html: 'text/html; charset=utf-8', js: 'text/javascript', css: 'text/css', wasm: 'application/wasm' };
const edge = new URL(address);
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// ---- the line -----------------------------------------------------------------------------------------------------------

let rate = line ? line[0] * 1e6 : Infinity; // bits a second, of all answers together
let free = 0; // when the line has sent all that it was given

// Sends in small pieces, each when the line is free.
async function send(response, body) {
    for (let at = 0; at < body.length && !response.destroyed; at += 1400) {
        const piece = body.subarray(at, at + 1400);
        // What a timer that comes late has cost is made up for.
        free = Math.max(free, performance.now() - 50) + (8000 * piece.length) / rate;
        const ms = free - performance.now();
        if (ms > 1) await wait(ms);
        response.write(piece);
    }
}

function pass(request, response) {
    const upstream = ask({ host: edge.hostname, port: edge.port, path: request.url, headers: { host: edge.host } }, (answer) => {
        const { 'transfer-encoding': _, connection: __, ...headers } = answer.headers;
        response.writeHead(answer.statusCode, headers);
        let sent = Promise.resolve();
        answer.on('data', (bytes) => (sent = sent.then(() => send(response, bytes))));
        answer.on('end', () => sent.then(() => response.end()));
    });
    upstream.on('error', () => response.destroy());
    response.on('close', () => upstream.destroy());
    upstream.end();
}

const server = createServer(async (request, response) => {
    const name = new URL(request.url, 'http://a').pathname;
    if (name.startsWith(`/${edge.pathname.split('/')[1]}/`)) return pass(request, response);
    try {
        const body = await readFile(path(name.startsWith('/player/') ? `../packages/player/dist/${name.slice(8)}` : `pages${name}`));
        response.writeHead(200, { 'Content-Type': types[name.split('.').at(-1)] ?? 'application/octet-stream' });
        response.end(body);
    } catch {
        response.writeHead(404);
        response.end();
    }
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
const here = `http://127.0.0.1:${server.address().port}`;

// ---- the browser --------------------------------------------------------------------------------------------------------

// In the page: plays, and notes what happens.
function watch(src) {
    Object.assign(window, { frames: [], ladder: [], begun: Date.now() });
    window.test.watch(src);
    window.player.addEventListener('framepresented', ({ detail }) => {
        const { ladder } = window.player.statistics;
        if (!detail.preview) window.frames.push({ at: Date.now(), time: detail.time, behind: ladder?.secondsBehind ?? null });
        const last = window.ladder.at(-1);
        if (ladder && (last?.fetched !== ladder.fetched || last?.shown !== ladder.shown))
            window.ladder.push({ at: Date.now(), fetched: ladder.fetched, shown: ladder.shown, reason: ladder.reason, ahead: ladder.secondsFetched });
    });
}
const found = () => ({ frames: window.frames, notices: window.notices, ladder: window.ladder, begun: window.begun, last: window.player.statistics.ladder });

async function inChromium() {
    const browser = await launch();
    const page = await browser.newPage({ viewport: { width: 480, height: 360 } });
    await page.goto(`${here}/page.html`);
    await page.waitForFunction(() => window.ready);
    return { run: (what, ...args) => page.evaluate(what, ...args), close: () => browser.close() };
}

async function inWebKit() {
    const driver = spawn('WebKitWebDriver', ['--port=4456'], { stdio: 'ignore', env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' } });
    const command = async (method, words, body) => {
        const response = await fetch(`http://127.0.0.1:4456/${words}`, { method, body: body && JSON.stringify(body) });
        const { value } = await response.json();
        if (!response.ok) throw new Error(`${words}: ${value.error}: ${value.message}`);
        return value;
    };
    for (let tries = 0; tries < 100; ++tries) {
        if (await command('GET', 'status').catch(() => null)) break;
        await wait(50);
    }
    const { sessionId } = await command('POST', 'session', { capabilities: { alwaysMatch: {} } });
    await command('POST', `session/${sessionId}/url`, { url: `${here}/page.html` });
    const run = (what, ...args) => command('POST', `session/${sessionId}/execute/sync`, { script: `return (${what})(...arguments);`, args });
    while (!(await run(() => window.ready ?? false))) await wait(50);
    const close = async () => {
        await command('DELETE', `session/${sessionId}`).catch(() => undefined);
        driver.kill();
    };
    return { run, close };
}

// Instead of a browser: frames are shown when they are due, and time stands still where they are late.
async function withoutDrawing() {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/segment_packets.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    const { SegmentPackets } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
    const decodedAheadMs = 300;
    const shown = { frames: [], notices: [], ladder: [], begun: Date.now(), last: null };
    let packets = null;
    const note = (rung) => {
        const { last } = shown;
        const before = shown.ladder.at(-1);
        if (last && (before?.fetched !== last.rung || before?.shown !== rung))
            shown.ladder.push({ at: Date.now(), fetched: last.rung, shown: rung, reason: last.reason, ahead: last.secondsFetched });
    };
    const play = async (src) => {
        let rung = null;
        packets = new SegmentPackets(src, (text) => shown.notices.push(text), (report) => {
            shown.last = report;
            note(rung);
        });
        const { timeUs } = await packets.seek(0);
        let startMs = null; // when media time 0 is shown
        for (let packet = await packets.next(); packet; packet = await packets.next()) {
            if (!isFrame(packet.kind) || packet.passed || packet.timeUs < timeUs - 1000) continue;
            const now = Date.now();
            startMs = Math.max(startMs ?? -Infinity, now - packet.timeUs / 1000);
            const due = startMs + packet.timeUs / 1000;
            const { timeUs: time, rung: its } = packet;
            setTimeout(() => {
                rung = its ?? 0;
                note(rung);
                const at = Date.now();
                shown.frames.push({ at, time: time / 1e6, behind: shown.last?.live && shown.last.zeroMs !== null ? (at - shown.last.zeroMs - time / 1000) / 1000 : null });
            }, Math.max(due - now, 0));
            if (due - decodedAheadMs > now) await wait(due - decodedAheadMs - now);
        }
    };
    const run = async (what, src) => (what === watch ? void play(src).catch((error) => shown.notices.push(String(error))) : shown);
    return { run, close: async () => packets.close() };
}

// ---- what is told -------------------------------------------------------------------------------------------------------

const engine = await (inNode ? withoutDrawing : webkit ? inWebKit : inChromium)();
try {
    console.log(`load ${loadavg().map((one) => one.toFixed(1)).join(' ')} at the beginning`);
    await engine.run(watch, new URL(edge.pathname + edge.search, here).href);
    const changes = [];
    for (const one of line ?? [null]) {
        rate = one === null ? Infinity : one * 1e6;
        if (one !== null) changes.push({ at: Date.now(), text: `the line carries ${one} Mbit/s` });
        await wait(Number(seconds) * 1000);
    }
    const { frames, notices, ladder, begun, last } = await engine.run(found);
    if (frames.length < 2) throw new Error(`no frames were shown: ${notices.join('; ')}`);
    const stalls = frames.slice(1).map(({ at, time }, i) => ({ at, ms: at - frames[i].at, time })).filter(({ ms }) => ms > stallMs);
    const behind = frames.map((one) => one.behind).filter((one) => one !== null).sort((a, b) => a - b);
    const share = (part) => `${behind[Math.min(behind.length - 1, Math.floor(part * behind.length))].toFixed(2)} s`;
    const events = [
        ...changes,
        ...ladder.map(({ at, fetched, shown, reason, ahead }) => ({ at, text: `fetched ${fetched + 1}, shown ${shown === null ? '-' : shown + 1} of ${last.rungs.length}; ${reason}; ${ahead.toFixed(1)} s fetched` })),
        ...stalls.slice(0, 50).map(({ at, ms, time }) => ({ at, text: `no frame for ${ms} ms, up to ${time.toFixed(2)} s of the stream` })),
    ];
    for (const { at, text } of events.sort((a, b) => a.at - b.at)) console.log(`${((at - begun) / 1000).toFixed(2).padStart(8)} s  ${text}`);
    console.log(`first frame after ${frames[0].at - begun} ms; ${frames.length} frames in ${((frames.at(-1).at - frames[0].at) / 1000).toFixed(1)} s`);
    console.log(behind.length > 0 ? `behind the hub, p50 / p99: ${share(0.5)} / ${share(0.99)}` : 'the playlist has no dates, or has ended');
    console.log(`${stalls.length} times no frame for more than ${stallMs} ms, the longest ${Math.max(0, ...stalls.map(({ ms }) => ms))} ms; ${last?.lostSegments ?? 0} segments lost`);
    for (const notice of new Set(notices)) console.log(`notice: ${notice}`);
    console.log(`load ${loadavg().map((one) => one.toFixed(1)).join(' ')} at the end`);
} finally {
    await engine.close();
    server.closeAllConnections();
    server.close();
}
process.exit();
