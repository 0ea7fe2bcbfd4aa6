// Speed and memory of the decoder under Node and of the player in Chromium, which draws in software here:
//   node tests/measure.mjs [--node] FILE.htvm ...     --node: the decoder alone
import { readFile } from 'node:fs/promises';
import { basename } from 'node:path';
import { fileURLToPath } from 'node:url';
import { loadDecoder } from '../packages/decoder/dist/node.js';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { packetsOf } from './streams.mjs';

const dist = fileURLToPath(new URL('../packages/player/dist', import.meta.url));
const pages = fileURLToPath(new URL('pages', import.meta.url));
const fixed = (value) => value.toFixed(1);

async function underNode(stream) {
    const module = await loadDecoder();
    const packets = packetsOf(stream);
    const least = new Map(); // by packet: its letter, and the shortest of several rounds
    let vertices = 0;
    for (let round = 0; round < 5; ++round) {
        const decoder = module.createDecoder();
        for (const [at, { bytes }] of packets.entries()) {
            const begin = performance.now();
            decoder.sendPacket(bytes);
            const frame = decoder.receive();
            const ms = performance.now() - begin;
            if (!frame) continue;
            vertices = Math.max(vertices, frame.vertices);
            least.set(at, { letter: frame.letter, ms: Math.min(ms, least.get(at)?.ms ?? Infinity) });
        }
        decoder.close();
    }
    const times = {};
    for (const { letter, ms } of least.values()) (times[letter] ??= []).push(ms);
    const all = Object.values(times).flat();
    const mean = (list) => list.reduce((sum, ms) => sum + ms, 0) / list.length;
    const percentile = (list, percent) => list.toSorted((a, b) => a - b)[Math.max(0, Math.ceil((percent * list.length) / 100) - 1)];
    const spread = (list) => `${fixed(percentile(list, 50))} ms, 99 %: ${fixed(percentile(list, 99))}, at most ${fixed(Math.max(...list))}`;
    const kinds = Object.entries({ ...times, all }).map(([name, list]) => `${name} ${spread(list)}`);
    const memory = (module.memoryBytes / 1e6).toFixed(0);
    return `${vertices} vertices; Node: ${fixed(1000 / mean(all))} frames/s (${kinds.join('; ')}), ${memory} MB`;
}

async function inChromium(browser, server, name) {
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction('window.ready');
    const result = await page.evaluate(async (src) => {
        const pictures = [];
        const player = document.createElement('htvm-player');
        player.style.cssText = 'width: 640px; height: 480px';
        // The browser's own clock, with each picture's time on the main thread.
        player.clock = {
            now: () => performance.now(),
            cancel: (request) => cancelAnimationFrame(request),
            request: (callback) =>
                requestAnimationFrame(() => {
                    const begin = performance.now();
                    callback();
                    pictures.push(performance.now() - begin);
                }),
        };
        const begin = performance.now();
        const first = new Promise((resolve) => player.addEventListener('framepresented', resolve, { once: true }));
        for (const name of ['loop', 'autoplay']) player.setAttribute(name, '');
        player.setAttribute('src', src);
        document.body.append(player);
        await first;
        const firstFrame = performance.now() - begin;
        let shown = 0;
        player.addEventListener('framepresented', () => ++shown);
        while (shown < 60) await new Promise(requestAnimationFrame);
        shown = 0;
        pictures.length = 0;
        const from = performance.now();
        while (performance.now() - from < 8000) await new Promise(requestAnimationFrame);
        const rate = (1000 * shown) / (performance.now() - from);
        pictures.sort((a, b) => a - b);
        const seeks = [];
        player.pause();
        for (const share of [0.9, 0.1, 0.6, 0.3]) {
            const start = performance.now();
            const exact = new Promise((resolve) => {
                player.addEventListener('framepresented', function listen({ detail }) {
                    if (detail.preview) return;
                    player.removeEventListener('framepresented', listen);
                    resolve();
                });
            });
            player.currentTime = share * player.duration;
            await exact;
            seeks.push(performance.now() - start);
            await player.idle(); // the next one begins from rest
        }
        gc();
        return {
            firstFrame, rate, seek: Math.max(...seeks), middle: pictures[pictures.length >> 1],
            high: pictures[Math.floor(pictures.length * 0.99)], statistics: player.statistics, heap: performance.memory.usedJSHeapSize,
        };
    }, `/as-is/${name}`);
    await page.close();
    const { firstFrame, rate, seek, middle, high, statistics, heap } = result;
    return (
        `${name}: Chromium: first frame ${firstFrame.toFixed(0)} ms after the element, ${fixed(rate)} frames/s shown, ` +
        `main thread ${fixed(middle)} ms a picture (99 %: ${fixed(high)}), decoding ${fixed(statistics.decodeMs)} ms, ` +
        `slowest of four seeks ${seek.toFixed(0)} ms, JavaScript heap ${fixed(heap / 1e6)} MB, decoder ${fixed(statistics.wasmBytes / 1e6)} MB`
    );
}

const paths = process.argv.slice(2).filter((word) => word !== '--node');
for (const path of paths) console.log(`${basename(path)}: ${await underNode(await readFile(path))}`);
if (!process.argv.includes('--node')) {
    const browser = await launch();
    const server = await new TestServer({ '': pages, player: dist, streams: '/' }).start();
    for (const path of paths) {
        server.made.set(basename(path), await readFile(path));
        console.log(await inChromium(browser, server, basename(path)));
    }
    await browser.close();
    server.stop();
}
