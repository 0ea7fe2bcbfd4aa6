// A live stream in Chromium, from a hub of the tests' own. The time is real here.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { LiveHub, Publishing } from './live_hub.mjs';
import { TestServer } from './server.mjs';
import { conformance, firstSequence } from './streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self' http: ws:";

let browser, server, hub, publishing;

before(async () => {
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist') }).start();
    server.pageHeaders = { 'Content-Security-Policy': policy };
    browser = await launch();
    hub = await new LiveHub().start();
    publishing = new Publishing(hub, firstSequence(await conformance('tracked')));
});

after(async () => {
    publishing?.stop();
    await browser?.close();
    server?.stop();
    await hub?.stop();
});

// A page that watches: its `shown` are the frames drawn, with Date.now(), `states` what the player said.
function watching(name, address, body, attributes = { autoplay: '' }) {
    test(name, { timeout: 60000 }, async () => {
        const page = await browser.newPage({ viewport: { width: 400, height: 300 } });
        const faults = [];
        page.on('pageerror', (error) => faults.push(error.message));
        try {
            await page.goto(`${server.origin}/page.html`);
            await page.waitForFunction('window.ready');
            await page.evaluate((given) => {
                const player = document.createElement('htvm-player');
                for (const [key, value] of Object.entries({ live: '', floor: 'none', ...given })) player.setAttribute(key, value);
                Object.assign(window, { player, shown: [], states: [] });
                player.addEventListener('framepresented', ({ detail: { frame, preview } }) => shown.push({ frame, preview, at: Date.now() }));
                player.addEventListener('livestate', ({ detail: { state } }) => states.push(state));
                document.body.append(player);
            }, { src: address(), ...attributes });
            await body(page);
            assert.deepEqual(faults, []);
            assert.equal(await page.evaluate(() => player.error), null);
        } finally {
            await page.close();
        }
    });
}

const live = (page, more = 10) =>
    page.waitForFunction((count) => {
        if (player.statistics.live?.state !== 'live') return false;
        window.least ??= shown.length + count;
        return shown.length >= window.least && delete window.least;
    }, more);
const words = (page) => page.getByRole('status').filter({ visible: true }).first().textContent();

watching('what is published now is shown, in order, once, soon', () => hub.address('ws'), async (page) => {
    await live(page);
    await page.waitForFunction(() => Number.isFinite(player.statistics.live.behind));
    const { behind, bufferMs, speed } = await page.evaluate(() => player.statistics.live);
    assert.ok(behind < 0.5 && bufferMs < 300 && Math.abs(speed - 1) <= 0.021, `${behind} s behind, ${bufferMs} ms, speed ${speed}`);
    assert.equal(await words(page), 'Live');
    // Frames come in their order, and none twice.
    const numbers = await page.evaluate(() => shown.filter(({ preview }) => !preview).map(({ frame }) => frame));
    assert.deepEqual(numbers, [...new Set(numbers)].sort((a, b) => a - b));
});

watching('when the hub has gone, the player says so, and goes on when it is back', () => hub.address('http'), async (page) => {
    await live(page);
    await hub.stop();
    await page.waitForFunction(() => states.at(-1) === 'reconnecting');
    assert.equal(await words(page), 'Reconnecting');
    await hub.start();
    await live(page);
    assert.ok(await page.evaluate(() => states.includes('reconnecting') && shown.at(-1).frame > shown[0].frame));
});

watching('a hidden tab leaves the hub; a shown one joins again, and has the picture within a second', () => hub.address('ws'), async (page) => {
    await live(page);
    const hidden = await page.evaluate(async () => {
        test.setVisibility('hidden');
        await new Promise((resolve) => setTimeout(resolve, 100));
        const before = shown.length;
        await new Promise((resolve) => setTimeout(resolve, 500));
        return shown.length - before;
    });
    assert.deepEqual([hidden, hub.viewers.length], [0, 0]);
    await page.evaluate(() => {
        shown.length = 0;
        test.setVisibility('visible');
    });
    await live(page);
    const first = await page.evaluate(() => shown[0].at);
    assert.ok(first - hub.viewers[0].since < 1000, `${first - hub.viewers[0].since} ms`);
    await page.waitForFunction(() => player.statistics.live.behind < 0.5);
});

watching('paused, it leaves the hub; without autoplay there is one picture', () => hub.address('ws'), async (page) => {
    await page.waitForFunction(() => shown.length > 0);
    while (hub.viewers.length > 0) await new Promise((resolve) => setTimeout(resolve, 10));
    assert.equal(await page.evaluate(() => player.paused), true);
    await page.evaluate(() => player.play());
    await live(page);
    await page.evaluate(() => player.pause());
    while (hub.viewers.length > 0) await new Promise((resolve) => setTimeout(resolve, 10));
}, {});

watching('where WebSockets are blocked, the endless body serves', () => {
    hub.socketsBlocked = true;
    return hub.address('http');
}, async (page) => {
    await live(page);
    hub.socketsBlocked = false;
});

watching('another session goes on in the same player', () => hub.address('ws'), async (page) => {
    await live(page);
    await page.evaluate(() => player.addEventListener('loadedmetadata', () => (window.again = true)));
    publishing.beginSession();
    await page.waitForFunction(() => window.again && shown.at(-1).frame < 20);
    await live(page);
});

watching('a publisher who has gone is told in words', () => hub.address('ws'), async (page) => {
    await live(page);
    publishing.published = false;
    for (const viewer of hub.viewers) viewer.say({ type: 'gone', reason: 'its connection ended' });
    publishing.stop();
    await page.waitForFunction(() => states.at(-1) === 'gone');
    assert.equal(await words(page), 'Publisher gone');
    publishing = new Publishing(hub, firstSequence(await conformance('tracked')));
    publishing.beginSession();
    await live(page);
});

watching('stamps tell when each frame passed each stage', () => `${hub.address('ws')}?stamps`, async (page) => {
    publishing.onFrame = (frame) => {
        const now = Date.now() * 1000;
        for (const viewer of hub.viewers) viewer.say({ type: 'stamp', frame, sent: now, hub: now });
    };
    await live(page, 40);
    await new Promise((resolve) => setTimeout(resolve, 1100));
    const stamps = (await page.evaluate(() => player.stamps())).filter(({ drawn }) => Number.isFinite(drawn));
    assert.ok(stamps.length > 10);
    for (const { sent, hub: came, received, decoded, drawn } of stamps)
        assert.ok(sent <= came && came <= received + 2000 && received <= decoded && decoded <= drawn + 2000 && drawn - sent < 2e6);
    assert.ok((await page.evaluate(() => player.stamps())).length < stamps.length, 'each frame is told once');
});
