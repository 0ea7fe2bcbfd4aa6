// What is measured of an answer, and when it is asked for again. Under Node, by answers that the tests make up and a clock that they set.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const address = 'https://a.example/hls/anna/1.m4s';
const { signal } = new AbortController();
const plain = { fetch: globalThis.fetch, now: performance.now };

let fetchFile;
let clock = 0;

before(async () => {
    const { outputFiles } = await build({
        entryPoints: [path('../packages/player/src/segment_fetch.ts')], bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    ({ fetchFile } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`));
    performance.now = () => clock;
});

after(() => {
    globalThis.fetch = plain.fetch;
    performance.now = plain.now;
});

// An answer that begins so many milliseconds after it was asked for, and whose pieces come so many after the one before.
async function cameOf(beginMs, pieces) {
    clock = 1000;
    globalThis.fetch = async () => {
        clock += beginMs;
        const left = [...pieces];
        const body = new ReadableStream({
            pull(controller) {
                const [ms, bytes] = left.shift() ?? [];
                if (bytes === undefined) return controller.close();
                clock += ms;
                controller.enqueue(new Uint8Array(bytes));
            },
        }, { highWaterMark: 0 });
        return new Response(body);
    };
    const { outcome, came } = await fetchFile(address, signal);
    assert.equal(outcome, 'here');
    return came;
}

test('the way there and back is not measured', async () => {
    assert.deepEqual(await cameOf(700, [[40, 5000]]), { ms: 40, bits: 40000, bitsMs: 40 });
});

test('where bytes run, waiting for the first of them is not measured, nor are those that came with it', async () => {
    assert.deepEqual(await cameOf(10, [[300, 2000], [50, 1000], [50, 1000]]), { ms: 400, bits: 16000, bitsMs: 100 });
});

test('bytes that come at once, or nearly so, are measured with all of their answer', async () => {
    assert.deepEqual(await cameOf(10, [[30, 2000], [49, 3000]]), { ms: 79, bits: 40000, bitsMs: 79 });
});

test('a small rest that comes late says nothing of the line', async () => {
    assert.deepEqual(await cameOf(10, [[20, 9000], [100, 1000]]), { ms: 120, bits: 80000, bitsMs: 120 });
});

test('whether to give up is not asked before an answer has run for 0.3 s, however long it was waited for', async () => {
    clock = 1000;
    const asked = [];
    globalThis.fetch = async () => {
        clock += 5000;
        const body = new ReadableStream({
            async pull(controller) {
                // Ticks of the look come by the real clock; that of the transfer stands still but for these steps.
                await new Promise((resolve) => setTimeout(resolve, 150));
                clock += 200;
                controller.enqueue(new Uint8Array(100));
                if (clock > 6900) controller.close();
            },
        }, { highWaterMark: 0 });
        return new Response(body);
    };
    const giveUp = ({ bytes }) => {
        asked.push([clock - 6000, bytes]);
        return false;
    };
    assert.equal((await fetchFile(address, signal, { giveUp })).outcome, 'here');
    assert.ok(asked.length > 0);
    for (const [ms, bytes] of asked) assert.ok(ms >= 300 && bytes >= 100, `${ms} ms, ${bytes} bytes`);
});
