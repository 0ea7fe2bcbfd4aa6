// The player in another engine: WebKitGTK, driven by WebDriver. It needs a display, such as that of xvfb-run.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { TestServer } from '../server.mjs';
import { conformance, digests, firstSequence, folder, packetsOf, padded } from '../streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
let server, driver, session;

async function command(method, words, body) {
    const response = await fetch(`http://127.0.0.1:4455/${words}`, { method, body: body && JSON.stringify(body) });
    const { value } = await response.json();
    if (!response.ok) throw new Error(`${words}: ${value.error}: ${value.message}`);
    return value;
}

// Calls a function in the page; it may be asynchronous.
async function inPage(body, ...args) {
    const script = `const done = arguments[arguments.length - 1];
        (${body})(...Array.from(arguments).slice(0, -1)).then((value) => done({ value }), (error) => done({ error: String(error) }));`;
    const { value, error } = await command('POST', `session/${session}/execute/async`, { script, args });
    if (error) throw new Error(error);
    return value;
}

before(async () => {
    server = await new TestServer({ '': path('../pages'), player: path('../../packages/player/dist'), streams: folder }).start();
    server.made.set('long.htvm', padded(firstSequence(await conformance('tracked_by_chance')), 30000, 'front'));
    driver = spawn('WebKitWebDriver', ['--port=4455'], { stdio: 'ignore', env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' } });
    for (let tries = 0; ; ++tries) {
        try {
            await command('GET', 'status');
            break;
        } catch (error) {
            if (tries > 100) throw error;
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
    }
    const created = await command('POST', 'session', { capabilities: { alwaysMatch: {} } });
    session = created.sessionId;
    await command('POST', `session/${session}/timeouts`, { script: 60000, pageLoad: 30000 });
});

after(async () => {
    if (session) await command('DELETE', `session/${session}`).catch(() => undefined);
    driver?.kill();
    server?.stop();
});

test('frames are those of the native decoder, and seeks find them', { timeout: 120000 }, async () => {
    await command('POST', `session/${session}/url`, { url: `${server.origin}/page.html` });
    await inPage(async () => {
        while (!window.ready) await new Promise((resolve) => setTimeout(resolve, 20));
    });
    assert.deepEqual(await inPage((src) => test.playAll({ src }), '/as-is/tracked.htvm'), await digests('tracked'));
    const expected = (await digests('tracked_by_chance')).slice(0, packetsOf(firstSequence(await conformance('tracked_by_chance'))).length - 1);
    const found = await inPage(async () => {
        await test.open({ src: '/as-is/long.htvm' });
        const lines = [];
        for (const number of [50, 11]) lines.push((await test.seek((number + 0.4) / 30)).at(-1).line);
        return lines;
    });
    assert.deepEqual(found, [expected[50], expected[11]]);
    assert.ok(server.requests.some(({ path, range }) => path.endsWith('long.htvm') && range === 'bytes=0-262143'));
});
