// A viewer whose line goes from 4 Mbit/s to 0.4 and back, at a live playlist of several qualities:
//
//   node web/tests/measure_ladder.mjs FOLDER/stream.m3u8 [SECONDS-OF-EACH] [--node]
//
// In Chromium; or, with --node, by the player's fetching alone, whose frames are taken when they are due and not decoded, for
// machines that cannot draw in time.
// The playlists of `htvm encode --ladder` are handed out as if the stream came now, by a server that sends so many bytes a
// second and no more. Prints which rung was fetched and shown when, and every stall.
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { basename, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { isFrame } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const inNode = process.argv.includes('--node');
const [list, each = '15'] = process.argv.slice(2).filter((word) => word !== '--node');
const folder = dirname(list);
const megabits = [4, 0.4, 4];
const types = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };

let rate = megabits[0] * 1e6; // bits a second, of all answers together
let begin = 0; // of the live stream, ms
let free = 0; // when the line has sent all that it was given

// Sends in small pieces, each when the line is free.
async function send(response, body) {
    for (let at = 0; at < body.length && !response.destroyed; at += 1400) {
        const piece = body.subarray(at, at + 1400);
        // What a timer that comes late has cost is made up for.
        free = Math.max(free, performance.now() - 100) + (8000 * piece.length) / rate;
        const wait = free - performance.now();
        if (wait > 1) await new Promise((resolve) => setTimeout(resolve, wait));
        response.write(piece);
    }
    response.end();
}

// The list as it is so many seconds after the beginning, with 12 s from before it; the stream goes round.
function asLive(text) {
    const lines = text.split('\n');
    const segments = [];
    let map = '';
    for (const [i, line] of lines.entries()) {
        if (line.startsWith('#EXT-X-MAP')) map = line;
        if (line.startsWith('#EXTINF')) segments.push({ map, line, name: lines[i + 1], seconds: Number(line.slice(8, -1)) });
    }
    const now = (performance.now() - begin) / 1000 + 6;
    const listed = [];
    for (let number = 0, end = 0; end <= now; ++number) {
        const segment = segments[number % segments.length];
        end += segment.seconds;
        if (end <= now && end > now - 12) listed.push({ ...segment, number });
    }
    const target = Math.ceil(Math.max(...segments.map(({ seconds }) => seconds)) - 0.001);
    const out = ['#EXTM3U', '#EXT-X-VERSION:7', `#EXT-X-TARGETDURATION:${target}`, `#EXT-X-MEDIA-SEQUENCE:${listed[0].number}`];
    for (const one of listed) out.push(one.map, one.line, one.name);
    return `${out.join('\n')}\n`;
}

const server = createServer(async (request, response) => {
    const name = basename(new URL(request.url, 'http://a').pathname);
    try {
        if (request.url.startsWith('/stream/')) {
            let body = await readFile(join(folder, name));
            if (name.endsWith('.m3u8') && !body.includes('STREAM-INF')) body = Buffer.from(asLive(body.toString()));
            response.writeHead(200, { 'Content-Length': body.length, 'Cache-Control': 'no-store' });
            await send(response, body);
            return;
        }
        const root = request.url.startsWith('/player/') ? '../packages/player/dist/' : 'pages/';
        const body = await readFile(path(root + name));
        response.writeHead(200, { 'Content-Type': types[/\.\w+$/.exec(name)?.[0]] ?? 'application/octet-stream' });
        response.end(body);
    } catch {
        response.writeHead(404);
        response.end();
    }
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

// The line's rates one after another; when each began, ms after t0, by the clock that is given.
async function changeTheLine(now, t0) {
    const changes = [];
    for (const one of megabits) {
        rate = one * 1e6;
        changes.push({ at: (await now()) - t0, one });
        await new Promise((resolve) => setTimeout(resolve, Number(each) * 1000));
    }
    return changes;
}

const aheadMs = 400; // frames that are decoded ahead

async function watchInNode(address) {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/segment_packets.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    const { SegmentPackets } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
    const t0 = performance.now();
    const [log, stalls] = [[], []];
    let ladder = null;
    const tell = (shown) => {
        const before = log.at(-1);
        if (ladder && (before?.fetched !== ladder.rung || before?.shown !== shown))
            log.push({ at: performance.now(), ...ladder, fetched: ladder.rung, shown });
    };
    let [shownRung, shown, over] = [null, 0, false];
    const packets = new SegmentPackets(address, (notice) => log.push({ at: performance.now(), notice }), (report) => {
        ladder = report;
        tell(shownRung);
    });
    const watching = (async () => {
        await packets.seek(0);
        let startMs = null; // when media time 0 is shown
        while (!over) {
            const packet = await packets.next();
            if (!packet) break;
            if (!isFrame(packet.kind) || packet.passed) continue;
            const now = performance.now();
            startMs ??= now - packet.timeUs / 1000;
            const lateMs = now - (startMs + packet.timeUs / 1000);
            if (lateMs > 0) {
                if (lateMs > 100) stalls.push({ at: now, ms: lateMs, time: packet.timeUs / 1e6 });
                startMs += lateMs;
            }
            ++shown;
            const due = startMs + packet.timeUs / 1000;
            setTimeout(() => tell((shownRung = packet.rung)), Math.max(due - now, 0));
            if (due - aheadMs > now) await new Promise((resolve) => setTimeout(resolve, due - aheadMs - now));
        }
    })();
    const changes = await changeTheLine(() => performance.now(), t0);
    over = true;
    packets.close();
    await watching.catch(() => undefined);
    return { t0, changes, log, stalls, shown };
}

async function watchInChromium(address) {
    const browser = await launch();
    const page = await browser.newPage({ viewport: { width: 480, height: 360 } });
    await page.goto(new URL('/page.html', address).href);
    await page.waitForFunction(() => window.ready);
        await page.evaluate((src) => {
        document.querySelector('htvm-player')?.remove();
        const player = document.createElement('htvm-player');
        window.player = player;
        window.log = [];
        window.stalls = [];
        let last = null;
        player.addEventListener('framepresented', ({ detail }) => {
            const now = performance.now();
            if (last !== null && now - last > 200) window.stalls.push({ at: now, ms: now - last, time: detail.time });
            last = now;
        });
        player.addEventListener('notice', ({ detail }) => window.log.push({ at: performance.now(), notice: detail }));
        player.addEventListener('error', ({ detail }) => window.log.push({ at: performance.now(), notice: detail.message }));
        player.setAttribute('floor', 'none');
        player.src = src;
        player.muted = true;
        document.body.append(player);
        player.play();
        let before = '';
        setInterval(() => {
            const { ladder } = player.statistics;
            if (!ladder) return;
            const line = `${ladder.fetched} ${ladder.shown}`;
            if (line !== before) window.log.push({ at: performance.now(), ...ladder });
            before = line;
        }, 50);
    }, address);
    const t0 = await page.evaluate(() => performance.now());
    const changes = await changeTheLine(() => page.evaluate(() => performance.now()), t0);
    const { log, stalls, shown } = await page.evaluate(() => ({ log: window.log, stalls: window.stalls, shown: window.player.statistics.framesShown }));
    await page.screenshot({ path: process.env.SCREENSHOT ?? '/dev/null', type: 'png' }).catch(() => undefined);
    await browser.close();
    return { t0, changes, log, stalls, shown };
}

begin = performance.now();
const address = `http://127.0.0.1:${server.address().port}/stream/${basename(list)}`;
const { t0, changes, log, stalls, shown } = await (inNode ? watchInNode : watchInChromium)(address);
const second = (at) => `${((at - t0) / 1000).toFixed(2).padStart(7)} s`;
const events = [
    ...changes.map(({ at, one }) => ({ at: at + t0, text: `the line carries ${one} Mbit/s` })),
    ...log.map((entry) => ({
        at: entry.at,
        text: entry.notice ?? `fetched ${entry.fetched + 1}, shown ${entry.shown === null ? '-' : entry.shown + 1}; ${entry.reason}; ${entry.secondsFetched.toFixed(1)} s fetched`,
    })),
    ...stalls.map(({ at, ms, time }) => ({ at, text: `no frame for ${ms.toFixed(0)} ms, up to ${time.toFixed(2)} s of the stream` })),
];
for (const { at, text } of events.sort((a, b) => a.at - b.at)) console.log(second(at), text);
console.log(`${shown} frames shown; ${stalls.length} stalls, the longest ${Math.max(0, ...stalls.map(({ ms }) => ms)).toFixed(0)} ms`);
server.closeAllConnections();
server.close();
process.exit();
