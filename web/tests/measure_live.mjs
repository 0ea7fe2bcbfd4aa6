// The delay of a live stream by stage, in Chromium, which draws in software here:
//   htvm serve &   htvm publish FILE.htvm ws://localhost:8080/publish/NAME --loop --stamps &
//   node tests/measure_live.mjs http://localhost:8080/play/NAME [SECONDS]
// All clocks must be this machine's. `drawn` has the time in the jitter buffer in it.
import { launch } from './browser.mjs';

const [address, seconds = '60'] = process.argv.slice(2);
if (!address || !(Number(seconds) > 0)) {
    console.error('usage: node tests/measure_live.mjs http://HUB/play/NAME [SECONDS]');
    process.exit(2);
}
const stages = [['sent', 'hub'], ['hub', 'received'], ['received', 'decoded'], ['decoded', 'drawn'], ['sent', 'drawn']];
const settlingMs = 5000; // of the jitter buffer, not measured

const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

function row(name, frames) {
    const cells = stages.map(([from, to]) => {
        const delays = frames.map((frame) => (frame[to] - frame[from]) / 1000).filter(Number.isFinite).sort((a, b) => a - b);
        if (delays.length === 0) return '-';
        const at = (share) => delays[Math.min(delays.length - 1, Math.floor(share * delays.length))].toFixed(1);
        return `${at(0.5)} / ${at(0.99)}`;
    });
    console.log(`| ${[name, frames.length, ...cells].join(' | ')} |`);
}

const browser = await launch();
try {
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    const url = new URL(address);
    url.searchParams.set('stamps', '');
    await page.goto(url.href);
    await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.live?.state === 'live');
    const take = () => page.evaluate(() => document.querySelector('htvm-player').stamps());
    await sleep(settlingMs);
    await take();
    const frames = [];
    for (let left = Number(seconds); left > 0; left -= 1) {
        await sleep(1000);
        frames.push(...(await take()));
    }
    if (frames.length === 0) throw new Error('no stamps came: does the publisher send them (htvm publish --stamps)?');
    const statistics = await page.evaluate(() => document.querySelector('htvm-player').statistics);
    const shown = frames.filter(({ drawn }) => Number.isFinite(drawn));
    console.log(`p50 / p99, ms, of ${frames.length} frames, ${shown.length} of them drawn\n`);
    console.log(`| frames | number | ${stages.map(([from, to]) => `${from} → ${to}`).join(' | ')} |`);
    console.log(`|---|---|${stages.map(() => '---|').join('')}`);
    row('I', frames.filter(({ letter }) => letter === 'I'));
    row('others', frames.filter(({ letter }) => letter !== 'I'));
    const { behind, bufferMs, jitterMs, droppedByHub, leftOut, notShown } = statistics.live;
    console.log(
        `\nbuffer ${bufferMs.toFixed(0)} ms, jitter of arrivals ${jitterMs.toFixed(0)} ms, behind the publisher's clock ${(1000 * behind).toFixed(0)} ms; ` +
            `${droppedByHub} frames dropped by the hub, ${leftOut} not decoded, ${notShown} not shown; ${statistics.framesPerSecond.toFixed(1)} frames/s`);
} finally {
    await browser.close();
}
