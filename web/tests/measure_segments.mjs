// What a viewer has of a live stream in segments, in Chromium, which draws in software here: how soon the first frame is shown,
// how far it is behind the hub, and every stall.
//   htvm serve --segments 1 --trust-proxy 127.0.0.1 &   nginx -c $PWD/examples/cdn/hub.conf &
//   htvm publish FILE.htvm ws://localhost:8080/publish/NAME --loop &
//   node web/tests/measure_segments.mjs http://localhost:8088/hls/NAME/stream.m3u8 [SECONDS]
// The dates in the playlist say when frames came to the hub, by its clock, which must be this machine's.
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';

const [address, seconds = '60'] = process.argv.slice(2);
if (!address || !(Number(seconds) > 0)) {
    console.error('usage: node web/tests/measure_segments.mjs http://HOST/hls/NAME/stream.m3u8 [SECONDS]');
    process.exit(2);
}
const stallMs = 200; // without a new frame
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const types = { html: 'text/html; charset=utf-8', js: 'text/javascript', css: 'text/css', wasm: 'application/wasm' };

const server = createServer(async (request, response) => {
    try {
        const name = new URL(request.url, 'http://a').pathname;
        const body = await readFile(path(name.startsWith('/player/') ? `../packages/player/dist/${name.slice(8)}` : `pages${name}`));
        response.writeHead(200, { 'Content-Type': types[name.split('.').at(-1)] ?? 'application/octet-stream' });
        response.end(body);
    } catch {
        response.writeHead(404);
        response.end();
    }
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

const browser = await launch();
try {
    const page = await browser.newPage({ viewport: { width: 480, height: 360 } });
    let dated = null; // when the first frame of the first playlist came to the hub
    page.on('response', async (response) => {
        if (dated !== null || !response.url().startsWith(address)) return;
        const date = /#EXT-X-PROGRAM-DATE-TIME:(\S+)/.exec(await response.text().catch(() => ''));
        if (date) dated ??= Date.parse(date[1]);
    });
    await page.goto(`http://127.0.0.1:${server.address().port}/page.html`);
    await page.waitForFunction(() => window.ready);
    await page.evaluate((src) => {
        const player = document.createElement('htvm-player');
        Object.assign(window, { player, frames: [], notices: [], begun: Date.now() });
        player.addEventListener('framepresented', ({ detail }) => window.frames.push({ at: Date.now(), time: detail.time }));
        player.addEventListener('notice', ({ detail }) => window.notices.push(detail));
        player.addEventListener('error', ({ detail }) => window.notices.push(detail.message));
        player.setAttribute('floor', 'none');
        player.src = src;
        player.muted = true;
        document.body.append(player);
        player.play();
    }, address);
    await new Promise((resolve) => setTimeout(resolve, Number(seconds) * 1000));
    const { frames, notices, begun, ladder } = await page.evaluate(() => ({ frames: window.frames, notices: window.notices, begun: window.begun, ladder: window.player.statistics.ladder }));
    if (frames.length < 2) throw new Error(`no frames were shown: ${notices.join('; ')}`);
    const stalls = frames.slice(1).map(({ at }, i) => at - frames[i].at).filter((gap) => gap > stallMs);
    const behind = dated === null ? [] : frames.map(({ at, time }) => at - dated - 1000 * time).sort((a, b) => a - b);
    const share = (part) => `${(behind[Math.min(behind.length - 1, Math.floor(part * behind.length))] / 1000).toFixed(2)} s`;
    console.log(`first frame after ${frames[0].at - begun} ms; ${frames.length} frames in ${seconds} s`);
    console.log(behind.length > 0 ? `behind the hub, p50 / p99: ${share(0.5)} / ${share(0.99)}` : 'the playlist has no dates');
    console.log(`${stalls.length} times no frame for more than ${stallMs} ms, the longest ${Math.max(0, ...stalls)} ms; ${ladder?.lostSegments ?? 0} segments lost`);
    for (const notice of new Set(notices)) console.log(`notice: ${notice}`);
} finally {
    await browser.close();
    server.closeAllConnections();
    server.close();
}
