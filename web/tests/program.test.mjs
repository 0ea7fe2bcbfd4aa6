// The pages of `htvm play` and `htvm serve` in Chromium, from the program's own server: HTVM names the program.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { cp, mkdir, mkdtemp, readFile, readdir, rm, symlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { folder, makeCapture } from './streams.mjs';

const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 60000 };

let browser, work;

before(async () => {
    if (!program) return;
    browser = await launch();
    work = await mkdtemp(join(tmpdir(), 'htvm-program-'));
    await mkdir(join(work, 'streams', 'more'), { recursive: true });
    await cp(join(folder, 'tracked.htvm'), join(work, 'streams', 'tracked.htvm'));
    await cp(join(folder, 'person.htvm'), join(work, 'streams', 'more', 'a person.htvm'));
    await writeFile(join(work, 'streams', 'broken.htvm'), 'this is no stream');
    await cp(join(folder, 'tracked.htvm'), join(work, 'streams', 'posed.htvm'));
    execFileSync(program, ['still', join(folder, 'tracked.htvm'), '-o', join(work, 'streams', 'posed.png'), '--width', '40', '--height', '30', '--quiet']);
});

after(async () => {
    await browser?.close();
    if (work) await rm(work, { recursive: true });
});

// Runs the program, and the body with the address that it prints; Ctrl-C must end it.
async function running(words, body) {
    const child = spawn(program, words, { stdio: ['ignore', 'pipe', 'inherit'] });
    const exited = new Promise((resolve) => child.on('exit', (code, signal) => resolve({ code, signal })));
    const address = new Promise((resolve, reject) => {
        let text = '';
        child.stdout.on('data', (piece) => {
            text += piece;
            if (text.includes('\n')) resolve(text.trim());
        });
        exited.then(() => reject(new Error('the program ended')));
    });
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    const faults = [];
    page.on('pageerror', (error) => faults.push(error.message));
    page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
    try {
        await body(page, await address);
        assert.deepEqual(faults, []);
    } finally {
        await page.close();
        child.kill('SIGINT');
    }
    assert.deepEqual(await exited, { code: 0, signal: null });
}

test('htvm play shows a stream, in a loop, in the whole window', options, () =>
    running(['play', '--no-open', join(work, 'streams', 'tracked.htvm')], async (page, address) => {
        assert.match(address, /^http:\/\/127\.0\.0\.1:\d+\/$/);
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 8);
        assert.equal(await page.title(), 'tracked – htvm');
        assert.deepEqual(await page.evaluate(() => [document.querySelector('htvm-player').clientWidth, innerWidth]), [640, 640]);
        // Its keys work before anybody has clicked.
        await page.keyboard.press('Space');
        assert.equal(await page.evaluate(() => document.querySelector('htvm-player').paused), true);
    }));

test('htvm demo shows the stream that is inside the program', options, () =>
    running(['demo', '--no-open'], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 3);
        assert.equal(await page.title(), 'demo – htvm');
    }));

test('htvm play --orbit says where the stream is seen from', options, () =>
    running(['play', '--no-open', join(work, 'streams', 'tracked.htvm'), '--orbit', '180, 20'], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 0);
        const { yaw, pitch } = await page.evaluate(() => document.querySelector('htvm-player').view);
        assert.deepEqual([yaw, pitch].map(Math.round).map(Math.abs), [180, 20]);
    }));

test('htvm play takes z for up where the first mesh is longer along it, and the stream does not say', options, async () => {
    const stream = join(work, 'lying.htvm');
    const capture = join(work, 'lying');
    await makeCapture(capture, 3);
    for (const name of await readdir(capture)) {
        const path = join(capture, name);
        await writeFile(path, (await readFile(path, 'utf8')).replace(/^v (\S+) (\S+) (\S+)$/gm, 'v $1 $3 $2'));
    }
    execFileSync(program, ['encode', capture, '-o', stream], { stdio: 'pipe' });
    await running(['play', '--no-open', stream], async (page, address) => {
        assert.match(address, /\?up=z$/);
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 0);
        assert.equal(await page.evaluate(() => document.querySelector('htvm-player').getAttribute('up')), 'z');
    });
    execFileSync(program, ['encode', capture, '--up', 'y', '-o', stream], { stdio: 'pipe' });
    await running(['play', '--no-open', stream], async (page, address) => assert.match(address, /\d\/$/));
});

test('htvm play encodes a capture first', options, async () => {
    const capture = join(work, 'capture');
    await makeCapture(capture, 3);
    await running(['play', '--no-open', capture], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 3);
        assert.equal(await page.title(), 'capture – htvm');
    });
});

test('the view goes with somebody who walks off, unless it is fixed', options, async () => {
    const capture = join(work, 'walk');
    await makeCapture(capture, 12, 0.25);
    const stream = join(work, 'walk.htvm');
    execFileSync(program, ['encode', capture, '--keyint', '1', '-o', stream], { stdio: 'pipe' });
    await running(['play', '--no-open', stream], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 0);
        const seen = await page.evaluate(async () => {
            const player = document.querySelector('htvm-player');
            player.loop = false;
            player.pause();
            const at = async (frame) => {
                const shown = new Promise((resolve) =>
                    player.addEventListener('framepresented', ({ detail }) => detail.frame === frame && resolve()));
                player.currentTime = (frame + 0.5) / 30;
                await shown;
                return player.view.target[0];
            };
            await at(6);
            const out = [await at(0), await at(1), await at(11), await at(0)];
            player.fixed = true;
            return [...out, await at(11)];
        });
        // 2.75 m less twice the 18 cm that are left to move in; a step of 25 cm is within them. And back.
        const [first, second, last, back, fixed] = seen;
        assert.equal(second, first);
        assert.ok(last - first > 2.3 && last - first < 2.45, String(seen));
        assert.ok(Math.abs(back - first) < 1e-3, String(seen));
        assert.equal(fixed, back);
    });
});

test('htvm play --beside shows a capture and a stream of it in one window, in step, with a slider', options, async () => {
    const capture = join(work, 'compared');
    await makeCapture(capture, 12);
    const stream = join(work, 'compared.htvm');
    execFileSync(program, ['encode', capture, '-q', '30', '-o', stream], { stdio: 'pipe' });
    await running(['play', '--no-open', capture, '--beside', stream], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => [...document.querySelectorAll('htvm-player')].every(({ statistics }) => statistics.framesShown > 3));
        assert.equal(await page.title(), 'compared | compared – htvm');
        // Both show the same frame after every picture, through the end and the beginning again.
        const pairs = await page.evaluate(async () => {
            const [first, second] = document.querySelectorAll('htvm-player');
            const shown = [-1, -1];
            [first, second].forEach((player, i) => player.addEventListener('framepresented', ({ detail }) => (shown[i] = detail.frame)));
            const pairs = [];
            for (let i = 0; i < 60 || pairs.length < 30; ++i) {
                await new Promise(requestAnimationFrame);
                if (first.secondsAhead > 0 && second.secondsAhead > 0 && shown[0] >= 0) pairs.push([...shown]);
            }
            return pairs;
        });
        const apart = pairs.filter(([a, b]) => a !== b).length;
        assert.ok(apart <= pairs.length / 10, `${apart} of ${pairs.length} pictures are of different frames`); // at the beginning of a loop
        // What is done to the first is done to the second.
        const state = () => page.evaluate(async () => {
            const players = [...document.querySelectorAll('htvm-player')];
            for (const player of players) await player.idle();
            return players.map(({ paused, currentTime, lit, view }) => [paused, Math.floor(currentTime * 30 + 0.1), lit, view.yaw, view.distance]);
        });
        for (const action of [
            (first) => first.pause(), (first) => (first.currentTime = 7.4 / 30), (first) => first.step(-1), (first) => (first.lit = true),
            (first) => (first.view = { ...first.view, yaw: 40, distance: 2 }),
        ]) {
            await page.evaluate(`(${action})(document.querySelector('htvm-player'))`);
            if (`${action}`.includes('view')) await page.evaluate(() => document.querySelector('htvm-player').dispatchEvent(new Event('viewchange')));
            const [first, second] = await state();
            assert.deepEqual(second, first, `${action}`);
        }
        assert.equal((await state())[0][1], 6);
        // The slider shows more of the one or of the other.
        const covered = () => page.evaluate(() => getComputedStyle(document.querySelector('.over')).clipPath);
        assert.match(await covered(), /50%/);
        await page.getByRole('slider', { name: 'Where the second begins' }).press('ArrowLeft');
        assert.match(await covered(), /48%/);
        await page.mouse.move(0.48 * 640, 200);
        await page.mouse.down();
        await page.mouse.move(160, 200);
        await page.mouse.up();
        assert.match(await covered(), /25%/);
    });
});

test('htvm serve lists a folder with stills, and plays what is chosen', options, () =>
    running(['serve', '--files', join(work, 'streams'), '--port', '0'], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelectorAll('small').length === 4 && !document.querySelector('htvm-player'));
        const items = await page.evaluate(() =>
            [...document.querySelectorAll('li')].map((item) => [
                item.querySelector('span').textContent, item.querySelector('small').textContent, item.querySelector('img').src.slice(0, 5),
            ]));
        assert.deepEqual(items, [
            ['broken', '1 KB, cannot be played', 'data:'],
            ['more/a person', '15 KB, 0.2 s', 'blob:'],
            ['posed', '11 KB', 'http:'],
            ['tracked', '11 KB, 0.2 s', 'blob:'],
        ]);
        assert.equal(await page.evaluate(() => document.querySelector('img[src$="posed.png"]').naturalWidth), 40);
        await page.getByRole('link', { name: 'a person' }).click();
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 3);
        await page.getByRole('link', { name: 'All streams' }).click();
        await page.waitForFunction(() => document.querySelectorAll('li').length === 4);
    }));

test('htvm serve --link-keys: the page plays a file whose link it was given', options, async () => {
    const keys = join(work, 'keys.json');
    execFileSync(program, ['serve', '--link-keys', keys, '--add-link-key', '--quiet']);
    const link = execFileSync(program, ['link', 'more/a person.htvm', '--file', '--keys', keys, '--for', '1h'], { encoding: 'utf8' });
    const signed = link.trim().slice(link.indexOf('?') + 1);
    await running(['serve', '--files', join(work, 'streams'), '--link-keys', keys, '--port', '0'], async (page, address) => {
        await page.goto(`${address}?file=more%2Fa+person.htvm&orbit=180,20&${signed}`);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 3);
        assert.equal(await page.evaluate(() => document.querySelector('htvm-player').src), `/files/more/a%20person.htvm?${signed}`);
    });
});

test('htvm serve lists what is live, and shows it; the query of its address goes on to the stream', options, () =>
    running(['serve', '--port', '0'], async (page, address) => {
        await page.goto(address);
        await page.waitForFunction(() => document.querySelector('.empty:not([hidden])'));
        const hub = `${address.replace('http', 'ws')}publish/anna`;
        const publisher = spawn(program, ['publish', '--loop', '--quiet', join(folder, 'tracked_by_chance_2.htvm'), hub], { stdio: ['ignore', 'ignore', 'inherit'] });
        try {
            await page.getByRole('link', { name: 'anna' }).click();
            const live = () => page.waitForFunction(() => {
                const { live, framesShown } = document.querySelector('htvm-player')?.statistics ?? {};
                return live?.state === 'live' && framesShown > 10;
            });
            await live();
            assert.deepEqual([await page.title(), new URL(page.url()).pathname], ['anna – htvm', '/play/anna']);
            await page.goto(`${address}play/anna?key=1&stamps`);
            await live();
            assert.equal(await page.evaluate(() => document.querySelector('htvm-player').src), '/watch/anna?key=1&stamps');
            await page.waitForFunction(() => Number.isFinite(document.querySelector('htvm-player').statistics.live.behind));
        } finally {
            publisher.kill('SIGINT');
        }
        await page.waitForFunction(() => ['gone', 'reconnecting', 'ended'].includes(document.querySelector('htvm-player').statistics.live.state));
    }));

test('the five steps of docs/player.md lead to a page that plays', options, async () => {
    const project = fileURLToPath(new URL('../..', import.meta.url));
    const manual = await readFile(join(project, 'docs', 'player.md'), 'utf8');
    const steps = [...manual.matchAll(/```sh\n([^]*?)```/g)].map(([, block]) => block).find((block) => block.includes('# 1.'));
    assert.equal(steps.match(/#\s*\d\./g).length, 5);
    const place = join(work, 'steps');
    await mkdir(place);
    await makeCapture(join(place, 'capture'), 3);
    await symlink(join(project, 'web'), join(place, 'web'));
    // The player is built, and the server is the tests' own.
    const lines = steps.split('\n').filter((line) => !/^(\.\/dev web|python3 -m http\.server) /.test(line));
    assert.equal(lines.length, steps.split('\n').length - 2);
    const script = `set -e; htvm() { '${program}' "$@"; }\n${lines.join('\n')}`;
    execFileSync('bash', ['-c', script], { cwd: place, stdio: ['ignore', 'ignore', 'pipe'] });
    const server = await new TestServer({ '': join(place, 'site') }).start();
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    try {
        await page.goto(`${server.origin}/index.html`);
        await page.waitForFunction(() => document.querySelector('htvm-player')?.statistics.framesShown > 3);
    } finally {
        await page.close();
        server.stop();
    }
});
