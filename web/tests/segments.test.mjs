// Streams in .mp4 files and in segments: under Node how playlists and boxes are read, in Chromium that the player shows what it
// shows of the bare stream. HTVM names the program that makes the streams.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cp, mkdir, mkdtemp, readdir, readFile, rm, unlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';
import { encodeDancer } from './streams.mjs';

const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 180000 };
const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const frames = 90;
const base = 'https://a.example/live/stream.m3u8';

let work, server, browser, page, parts;

before(async () => {
    const contents = "export * from './playlist.ts'; export * from './mp4_tables.ts'; export * from './mp4_samples.ts'; export * from './segment_list.ts';";
    const { outputFiles } = await build({
        stdin: { contents, resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    parts = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
    if (!program) return;
    work = await mkdtemp(join(tmpdir(), 'htvm-segments-'));
    await writeFile(join(work, 'dancer.htvm'), await encodeDancer(program, frames));
    const pack = (...words) => execFileSync(program, ['pack', join(work, 'dancer.htvm'), '-o', ...words, '--quiet']);
    pack(join(work, 'dancer.mp4'));
    pack(join(work, 'pieces.mp4'), '--fragmented', '--fragment', '1');
    for (const name of ['whole', 'holes', 'lies', 'cut', 'window']) {
        await mkdir(join(work, name));
        pack(join(work, name, 'dancer.m3u8'), '--segment', '0.6');
    }
    server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: work, segments: work }).start();
    browser = await launch();
    page = await browser.newPage();
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction(() => window.ready);
});

after(async () => {
    await browser?.close();
    server?.stop();
    if (work) await rm(work, { recursive: true });
});

const play = (src) => page.evaluate((address) => window.test.playAll({ src: address }), src);
const seek = (seconds) => page.evaluate((to) => window.test.seek(to), seconds);

// ---- playlists --------------------------------------------------------------------------------------------------------

const list = (...lines) => ['#EXTM3U', '#EXT-X-TARGETDURATION:2', ...lines].join('\n');

test('a playlist tells the segments, their maps, numbers and times, and whether it has ended', () => {
    const text = list('#EXT-X-MEDIA-SEQUENCE:7', '#EXT-X-MAP:URI="map.mp4"', '#EXTINF:2.000000,', 'a.m4s', '#EXTINF:1.5,', '../b.m4s', '#EXT-X-ENDLIST');
    const { playlist } = parts.readPlaylist(text, base);
    assert.deepEqual(playlist, {
        targetSeconds: 2, firstNumber: 7, ended: true, open: null, partSeconds: 0, partHoldBack: 0, hint: '', canWait: false,
        segments: [
            { number: 7, url: 'https://a.example/live/a.m4s', mapUrl: 'https://a.example/live/map.mp4', seconds: 2, parts: [], dateMs: null },
            { number: 8, url: 'https://a.example/b.m4s', mapUrl: 'https://a.example/live/map.mp4', seconds: 1.5, parts: [], dateMs: null },
        ],
    });
});

test('a list of playlists tells the qualities, the lowest first', () => {
    const text = ['#EXTM3U', '#EXT-X-STREAM-INF:BANDWIDTH=2500000,AVERAGE-BANDWIDTH=2000000,RESOLUTION=1024x1024,CODECS="htvm,av01.0.08M.08"', 'high.m3u8',
        '#EXT-X-STREAM-INF:BANDWIDTH=400000', 'low.m3u8'].join('\n');
    assert.deepEqual(parts.readPlaylist(text, base), {
        variants: [
            { url: 'https://a.example/live/low.m3u8', bitsPerSecond: 400000, resolution: '', codecs: '' },
            { url: 'https://a.example/live/high.m3u8', bitsPerSecond: 2000000, resolution: '1024x1024', codecs: 'htvm,av01.0.08M.08' },
        ],
    });
});

for (const [what, text, words] of [
    ['that is a web page', '<!doctype html>', /#EXTM3U/],
    ['with a duration that is no number', list('#EXT-X-MAP:URI="m"', '#EXTINF:Infinity,', 'a'), /#EXTINF has a number that is none/],
    ['with a segment of a day', list('#EXT-X-MAP:URI="m"', '#EXTINF:86400,', 'a'), /#EXTINF has a number that is none/],
    ['with a segment without a duration', list('#EXT-X-MAP:URI="m"', 'a'), /no #EXTINF/],
    ['with a segment without a map', list('#EXTINF:1,', 'a'), /no #EXT-X-MAP/],
    ['that names a file of the viewer\'s', list('#EXT-X-MAP:URI="m"', '#EXTINF:1,', 'file:///etc/passwd'), /an address of another kind: file:/],
    ['that is encrypted', list('#EXT-X-KEY:METHOD=AES-128,URI="k"', '#EXT-X-MAP:URI="m"', '#EXTINF:1,', 'a'), /encrypted/],
    ['with parts of files', list('#EXT-X-MAP:URI="m"', '#EXTINF:1,', '#EXT-X-BYTERANGE:10@0', 'a'), /parts of files/],
    ['with too many segments', list('#EXT-X-MAP:URI="m"', ...Array(100001).fill('#EXTINF:1,\na')), /more segments than are taken/],
])
    test(`a playlist ${what} is refused in words`, () => {
        assert.throws(() => parts.readPlaylist(text, base), words);
    });

// ---- boxes ------------------------------------------------------------------------------------------------------------

const box = (type, ...inside) => {
    const body = Buffer.concat(inside);
    const header = Buffer.alloc(8);
    header.writeUInt32BE(8 + body.length);
    header.write(type, 4, 'latin1');
    return Buffer.concat([header, body]);
};
const words = (...numbers) => Buffer.concat(numbers.map((number) => {
    const out = Buffer.alloc(4);
    out.writeUInt32BE(number >>> 0);
    return out;
}));
const movie = (...tables) =>
    box('trak', box('tkhd', words(0, 0, 0, 1)), box('mdia', box('mdhd', words(0, 0, 0, 1000000)),
        box('minf', box('stbl', box('stsd', words(0, 1), box('htvm', Buffer.alloc(78))), ...tables))));

test('tables that lie about counts are refused before memory is taken for them', () => {
    const chunks = [box('stsc', words(0, 1, 1, 2, 1)), box('stco', words(0, 1, 100))];
    const read = (...tables) => parts.readMovie(new Uint8Array(movie(...tables)));
    assert.equal(read(box('stsz', words(0, 0, 2, 10, 20)), ...chunks).tracks[0].samples.count, 2);
    assert.deepEqual(read(box('stsz', words(0, 0, 2, 10, 20)), ...chunks).tracks[0].samples.offsets, [100, 110]);
    assert.throws(() => read(box('stsz', words(0, 0, 3, 10, 20)), ...chunks), /table of sizes is cut short/);
    assert.throws(() => read(box('stsz', words(0, 1, 0xffffffff)), ...chunks), /more than are taken/);
    assert.throws(() => read(box('stsz', words(0, 1, 3)), ...chunks), /fewer samples than there are/);
    assert.throws(() => read(box('stsz', words(0, 0, 2, 10, 20)), box('stsc', words(0, 1, 1, 2, 1)), box('stco', words(0, 9, 100))), /table of chunks is cut short/);
});

test('runs of fragments that lie about counts are refused', () => {
    const read = (flags, count, ...fields) => {
        const one = parts.readMovie(new Uint8Array(movie(box('stsz', words(0, 0, 0)))));
        parts.readFragment(one, 50, new Uint8Array(box('traf', box('tfhd', words(0x20000, 1)), box('trun', words(flags, count, ...fields)))));
        return one.tracks[0].samples;
    };
    assert.deepEqual(read(0x301, 2, 8, 33333, 10, 33333, 20).offsets, [58, 68]);
    assert.throws(() => read(0x301, 3, 8, 33333, 10, 33333, 20), /cut short/);
    assert.throws(() => read(0x1, 0xffffffff, 8), /more than are taken/);
});

test('boxes that go beyond those around them are refused', () => {
    const cut = movie(box('stsz', words(0, 0, 0)));
    cut.writeUInt32BE(cut.length + 1);
    assert.throws(() => parts.readMovie(new Uint8Array(cut)), /boxes are cut short/);
});

// ---- in Chromium ------------------------------------------------------------------------------------------------------

test('an .mp4, whole or in fragments, and a playlist play as the bare stream does', options, async () => {
    const bare = await play('/as-is/dancer.htvm');
    assert.equal(bare.length, frames);
    for (const src of ['/as-is/dancer.mp4', '/no-ranges/dancer.mp4', '/as-is/pieces.mp4', '/segments/whole/dancer.m3u8'])
        assert.deepEqual(await play(src), bare, src);
    assert.deepEqual(await page.evaluate(() => window.test.notices), []);
});

test('seeks in an .mp4 and in segments show the same frames as in the bare stream', options, async () => {
    const shown = [];
    for (const src of ['/as-is/dancer.htvm', '/as-is/dancer.mp4', '/as-is/pieces.mp4', '/segments/whole/dancer.m3u8']) {
        await page.evaluate((address) => window.test.open({ src: address }), src);
        const lines = [];
        for (const seconds of [2.5, 0.7, 1.41, 0, 2.97]) lines.push((await seek(seconds)).at(-1).line);
        shown.push(lines);
        assert.ok(Math.abs((await page.evaluate(() => window.test.player.duration)) - frames / 30) < 0.001, src);
    }
    for (const lines of shown.slice(1)) assert.deepEqual(lines, shown[0]);
});

test('after a seek in segments only what is needed is fetched: a map, and the segments from there on', options, async () => {
    await page.evaluate(() => window.test.open({ src: '/segments/whole/dancer.m3u8' }));
    const names = (await readdir(join(work, 'whole'))).filter((name) => name.endsWith('.m4s')).sort((a, b) => parseInt(a) - parseInt(b));
    await new Promise((resolve) => setTimeout(resolve, 500)); // what comes after the beginning is fetched
    server.requests.length = 0;
    await seek(2.9);
    const asked = server.requests.map((request) => request.path.split('/').at(-1)).filter((name) => name.endsWith('.m4s'));
    assert.deepEqual(asked, names.slice(-1));
});

test('a segment that is gone, and one that is not what it says, are left out with a note', options, async () => {
    const folder = join(work, 'holes');
    const names = (await readdir(folder)).filter((name) => name.endsWith('.m4s')).sort((a, b) => parseInt(a) - parseInt(b));
    await unlink(join(folder, names[1]));
    await writeFile(join(folder, names[3]), Buffer.alloc(5000, 7));
    const bare = await play('/as-is/dancer.htvm');
    const shown = await play('/segments/holes/dancer.m3u8');
    const seconds = [...(await readFile(join(folder, 'dancer.m3u8'), 'utf8')).matchAll(/#EXTINF:([\d.]+)/g)].map((found) => Number(found[1]));
    assert.equal(shown.length, Math.round(30 * (seconds.reduce((sum, one) => sum + one) - seconds[1] - seconds[3])));
    for (const line of shown) assert.ok(bare.includes(line), line);
    assert.equal(shown.at(-1), bare.at(-1));
    assert.match((await page.evaluate(() => window.test.notices)).join('\n'), /A segment of the stream is gone, or cannot be read, and is left out/);
    assert.equal(await page.evaluate(() => window.test.player.statistics.ladder.lostSegments), 2);
});

test('behind a segment that is cut short the next one begins with what its map has, and the panel says so', options, async () => {
    const folder = join(work, 'cut');
    const names = (await readdir(folder)).filter((name) => name.endsWith('.m4s')).sort((a, b) => parseInt(a) - parseInt(b));
    const bytes = await readFile(join(folder, names[1]));
    await writeFile(join(folder, names[1]), bytes.subarray(0, Math.floor(bytes.length / 2)));
    const bare = await play('/as-is/dancer.htvm');
    server.requests.length = 0;
    const shown = await play('/segments/cut/dancer.m3u8');
    assert.ok(shown.length > frames - 20 && shown.length < frames, `${shown.length} frames`);
    assert.equal(shown.at(-1), bare.at(-1));
    const whole = bare.filter((line) => !shown.includes(line)).length;
    assert.equal(whole, frames - shown.length, 'all that is shown is right');
    assert.equal(await page.evaluate(() => window.test.player.statistics.ladder.lostSegments), 1);
});

test('a seek in an .mp4 asks for the bytes there alone', options, async () => {
    // What is behind the first megabyte is not read, but for where is sought.
    const bytes = await readFile(join(work, 'dancer.mp4'));
    const free = box('free', Buffer.alloc(8 << 20));
    const at = bytes.indexOf('mdat') - 4;
    // Tables in front, then 8 MiB that nobody needs, before the samples, whose places move by as much.
    const moved = Buffer.from(bytes);
    for (let chunk = moved.indexOf('co64'); chunk >= 0 && chunk < at; chunk = moved.indexOf('co64', chunk + 4)) {
        const count = moved.readUInt32BE(chunk + 8);
        for (let i = 0; i < count; ++i) moved.writeUInt32BE(moved.readUInt32BE(chunk + 16 + 8 * i) + free.length, chunk + 16 + 8 * i);
    }
    server.made.set('far.mp4', Buffer.concat([moved.subarray(0, at), free, moved.subarray(at)]));
    const bare = await play('/as-is/dancer.htvm');
    server.requests.length = 0;
    await page.evaluate(() => window.test.open({ src: '/as-is/far.mp4' }));
    assert.equal((await seek(2.97)).at(-1).line, bare[89]);
    const asked = server.requests.map(({ range }) => /bytes=(\d+)-(\d+)/.exec(range ?? '')).filter((range) => range);
    const covered = new Set(asked.flatMap(([, from, to]) => [Number(from) >> 18, Math.min(Number(to), (8 << 20) + bytes.length) >> 18]));
    assert.ok(covered.size > 0 && ![...covered].some((block) => block > 5 && block < 31), `blocks ${[...covered]}`);
});

test('a truncated segment shows its whole frames', options, async () => {
    const folder = join(work, 'lies');
    const names = (await readdir(folder)).filter((name) => name.endsWith('.m4s')).sort((a, b) => parseInt(a) - parseInt(b));
    const last = join(folder, names.at(-1));
    const bytes = await readFile(last);
    await writeFile(last, bytes.subarray(0, Math.floor(bytes.length / 2)));
    const shown = await play('/segments/lies/dancer.m3u8');
    assert.ok(shown.length > frames - 20 && shown.length < frames, `${shown.length} frames`);
    assert.match((await page.evaluate(() => window.test.notices)).join('\n'), /Parts of a segment are damaged/);
});

test('a live window is joined near its end, plays on as it slides, and ends where the list does', options, async () => {
    const folder = join(work, 'window');
    const whole = await readFile(join(folder, 'dancer.m3u8'), 'utf8');
    const blocks = whole.split('\n').reduce((out, line) => {
        if (line.startsWith('#EXT-X-MAP')) out.map = line;
        if (line.startsWith('#EXTINF')) out.push([out.map, line]);
        if (line && !line.startsWith('#')) out.at(-1).push(line);
        return out;
    }, []);
    const write = (from, to, end = '') =>
        writeFile(join(folder, 'live.m3u8'), ['#EXTM3U', '#EXT-X-VERSION:7', '#EXT-X-TARGETDURATION:1', `#EXT-X-MEDIA-SEQUENCE:${from}`,
            ...blocks.slice(from, to).flat(), end, ''].join('\n'));
    assert.ok(blocks.length >= 4, `${blocks.length} segments`);
    await write(0, 3);
    await page.evaluate(() => window.test.open({ src: '/segments/window/live.m3u8' }));
    const bare = (await play('/as-is/dancer.htvm'));
    await page.evaluate(() => {
        window.playing = window.test.open({ src: '/segments/window/live.m3u8' }).then(() => {
            window.test.player.play();
            return window.test.run();
        });
    });
    await page.waitForFunction(() => window.test.frames.length > 0);
    await write(1, blocks.length - 1);
    await new Promise((resolve) => setTimeout(resolve, 1200));
    await write(2, blocks.length, '#EXT-X-ENDLIST');
    await page.evaluate(() => window.playing);
    const shown = await page.evaluate(() => window.test.frames.map(({ line }) => line));
    assert.deepEqual(shown, bare.slice(bare.length - shown.length));
    assert.ok(shown.length > frames / 3, `${shown.length} frames`);
});

test('a playlist that is not there yet is waited for, with a notice, and then plays', options, async () => {
    const bare = await play('/as-is/dancer.htvm');
    await page.evaluate(() => {
        window.playing = window.test.playAll({ src: '/segments/later/dancer.m3u8' });
    });
    await page.waitForFunction(() => window.test.notices.length > 0);
    assert.deepEqual(await page.evaluate(() => [window.test.notices, window.test.player.error]), [['The stream is not there yet. It is waited for.'], null]);
    await cp(join(work, 'whole'), join(work, 'later'), { recursive: true });
    assert.deepEqual(await page.evaluate(() => window.playing), bare);
});

test('words where a playlist is none', options, async () => {
    const error = async (src) => {
        await page.evaluate((address) => window.test.open({ src: address }), src);
        await page.waitForFunction(() => window.test.player.error !== null);
        return page.evaluate(() => window.test.player.error);
    };
    await writeFile(join(work, 'page.m3u8'), '<!doctype html>');
    assert.match((await error('/segments/page.m3u8')).message, /does not begin with #EXTM3U/);
    await writeFile(join(work, 'picture.mp4'), box('ftyp', Buffer.from('isom0000')));
    assert.match((await error('/as-is/picture.mp4')).message, /cut short/);
});
