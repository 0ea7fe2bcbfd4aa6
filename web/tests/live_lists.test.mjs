// Live playlists as a viewer takes them: parts of segments, lists that are waited for, rungs that number their segments
// otherwise; and servers that lie. Under Node, by answers that the tests make up.
import assert from 'node:assert/strict';
import { before, beforeEach, mock, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const base = 'https://a.example/hls/anna/stream.m3u8';
const { signal } = new AbortController();

let parts, asked, answer;

before(async () => {
    const contents = "export * from './playlist.ts'; export * from './segment_list.ts';";
    const { outputFiles } = await build({
        stdin: { contents, resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    parts = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
    globalThis.fetch = async (url, { signal: aborts }) => {
        asked.push(url.replace('https://a.example/hls/', ''));
        const text = await answer(new URL(url), aborts);
        return text === null ? new Response('', { status: 404 }) : new Response(text);
    };
});

beforeEach(() => {
    asked = [];
});

const control = '#EXT-X-SERVER-CONTROL:CAN-BLOCK-RELOAD=YES,PART-HOLD-BACK=0.75';
const part = (name, seconds = 0.25) => `#EXT-X-PART:DURATION=${seconds},URI="${name}"`;
const list = (...lines) => ['#EXTM3U', '#EXT-X-TARGETDURATION:1', control, '#EXT-X-PART-INF:PART-TARGET=0.25', '#EXT-X-MAP:URI="map"', ...lines].join('\n');
const segments = (first, count) => [`#EXT-X-MEDIA-SEQUENCE:${first}`, ...Array.from({ length: count }, (_, i) => `#EXTINF:1,\n${first + i}.m4s`)];
const read = (text) => parts.readPlaylist(text, base).playlist;

async function opened(text) {
    answer = () => text;
    const lists = new parts.SegmentLists(base);
    await lists.open(signal);
    return lists;
}

// ---- what is read -----------------------------------------------------------------------------------------------------

test('parts are those of their segment, and the last ones of a segment that is not whole', () => {
    const { segments: [first], open, partSeconds, partHoldBack, canWait } = read(list('#EXT-X-MEDIA-SEQUENCE:7', part('7.0'), part('7.1', 0.2), '#EXTINF:0.45,', '7.m4s', part('8.0')));
    assert.deepEqual(first.parts.map(({ url, seconds }) => [url, seconds]), [['https://a.example/hls/anna/7.0', 0.25], ['https://a.example/hls/anna/7.1', 0.2]]);
    assert.equal(open.number, 8);
    assert.equal(open.url, '');
    assert.equal(open.mapUrl, 'https://a.example/hls/anna/map');
    assert.deepEqual(open.parts.map(({ url }) => url), ['https://a.example/hls/anna/8.0']);
    assert.deepEqual([partSeconds, partHoldBack, canWait], [0.25, 0.75, true]);
});

test('a list that has ended has no segment that is not whole', () => {
    assert.equal(read(list(...segments(1, 1), part('2.0'), '#EXT-X-ENDLIST')).open, null);
});

test('parts that last longer than the list says are taken at what they say', () => {
    assert.equal(read(list(...segments(1, 1), part('2.0', 0.9))).partSeconds, 0.9);
});

for (const [what, lines, words] of [
    ['without a name', ['#EXT-X-PART:DURATION=0.2'], /a name is missing/],
    ['without a duration', ['#EXT-X-PART:URI="a"'], /DURATION of a part has a number that is none/],
    ['of a day', [part('a', 86400)], /DURATION of a part has a number that is none/],
    ['of another kind of address', [part('file:///etc/passwd')], /an address of another kind: file:/],
    ['that are parts of files', ['#EXT-X-PART:DURATION=0.2,URI="a",BYTERANGE="10@0"'], /parts of files/],
    ['that never end', Array(1001).fill(part('a')), /more parts than are taken/],
])
    test(`parts ${what} are refused in words`, () => assert.throws(() => read(list(...lines)), words));

test('the part that is announced is read, and what is announced of another kind, or as a part of a file, is passed over', () => {
    const hint = (line) => read(list(...segments(1, 1), part('2.0'), line)).hint;
    assert.equal(hint('#EXT-X-PRELOAD-HINT:TYPE=PART,URI="2.1"'), 'https://a.example/hls/anna/2.1');
    assert.equal(hint('#EXT-X-PRELOAD-HINT:TYPE=MAP,URI="map"'), '');
    assert.equal(hint('#EXT-X-PRELOAD-HINT:TYPE=PART,URI="2.m4s",BYTERANGE-START=0'), '');
    assert.throws(() => hint('#EXT-X-PRELOAD-HINT:TYPE=PART,URI="file:///etc/passwd"'), /an address of another kind: file:/);
});

// ---- where playing begins -----------------------------------------------------------------------------------------------

test('a stream in parts is joined as far behind its end as the list says', async () => {
    const lists = await opened(list(...segments(10, 5), part('15.0'), part('15.1')));
    assert.deepEqual(lists.placeAt(0, null), { number: 14, timeUs: 5.5e6 - 0.75e6 });
    assert.equal(lists.endUs, 5.5e6);
});

test('where the server says at once what comes, two segments and a half are enough', async () => {
    const lists = await opened(['#EXTM3U', '#EXT-X-TARGETDURATION:1', '#EXT-X-SERVER-CONTROL:CAN-BLOCK-RELOAD=YES', '#EXT-X-MAP:URI="map"', ...segments(10, 5)].join('\n'));
    assert.deepEqual(lists.placeAt(0, null), { number: 12, timeUs: 2.5e6 });
});

test('where it does not, playing begins three segments before the end, with a whole one', async () => {
    const lists = await opened(['#EXTM3U', '#EXT-X-TARGETDURATION:1', '#EXT-X-MAP:URI="map"', ...segments(10, 5)].join('\n'));
    assert.deepEqual(lists.placeAt(0, null), { number: 12, timeUs: 2e6 });
});

test('a list that wants players hours behind its end has them three segments behind', async () => {
    const lists = await opened(list(...segments(10, 5), part('15.0')).replace('PART-HOLD-BACK=0.75', 'PART-HOLD-BACK=3600'));
    assert.equal(lists.placeAt(0, null).timeUs, 5.25e6 - 3e6);
});

test('who goes back within the window has that place, and who goes beyond the end has the place where playing begins', async () => {
    const lists = await opened(list(...segments(10, 5), part('15.0'), part('15.1')));
    assert.deepEqual(lists.placeAt(0, 1.2e6), { number: 11, timeUs: 1.2e6 });
    assert.deepEqual(lists.placeAt(0, 60e6), lists.placeAt(0, null));
});

// ---- what is fetched ----------------------------------------------------------------------------------------------------

test('a whole segment is fetched whole, one that is not part by part, and one that was begun in parts goes on so', async () => {
    const lists = await opened(list('#EXT-X-MEDIA-SEQUENCE:7', part('7.0'), part('7.1'), '#EXTINF:0.5,', '7.m4s', part('8.0')));
    const piece = (number, from) => {
        const found = lists.piece(0, { number, part: from }, true);
        return found?.url ? [found.url.replace('https://a.example/hls/anna/', ''), found.beginUs] : found;
    };
    assert.deepEqual(piece(7, 0), ['7.m4s', 0]);
    assert.deepEqual(piece(7, 1), ['7.1', 0.25e6]);
    assert.equal(piece(7, 2), 'over');
    assert.deepEqual(piece(8, 0), ['8.0', 0.5e6]);
    assert.equal(piece(8, 1), null);
    assert.equal(piece(9, 0), null);
});

test('what comes next is asked for by its place, and the list is there once that is', async () => {
    const lists = await opened(list(...segments(10, 2), part('12.0')));
    assert.ok(lists.waits(0));
    assert.deepEqual(lists.end(0), { number: 12, part: 1 });
    answer = () => list(...segments(10, 2), part('12.0'), part('12.1'));
    assert.ok(await lists.waitFor(0, { number: 12, part: 1 }, true, signal));
    assert.equal(asked.at(-1), 'anna/stream.m3u8?_HLS_msn=12&_HLS_part=1');
    assert.equal(lists.endUs, 2.5e6);
});

test('the part that comes next is known by its address before it is listed, and no other', async () => {
    const lists = await opened(list(...segments(10, 2), part('12.0'), '#EXT-X-PRELOAD-HINT:TYPE=PART,URI="12.1"'));
    assert.equal(lists.announced(0, { number: 12, part: 1 }), 'https://a.example/hls/anna/12.1');
    assert.equal(lists.announced(0, { number: 12, part: 0 }), null);
    assert.equal(lists.announced(0, { number: 13, part: 0 }), null);
});

test('where three parts in a row were announced and did not come, that is not believed any more', async () => {
    const lists = await opened(list(...segments(10, 2), part('12.0'), '#EXT-X-PRELOAD-HINT:TYPE=PART,URI="12.1"'));
    const known = () => lists.announced(0, { number: 12, part: 1 }) !== null;
    for (const came of [false, false, true, false, false]) {
        lists.announcedCame(0, came);
        assert.ok(known());
    }
    lists.announcedCame(0, false);
    assert.equal(known(), false);
});

test('who does not take parts has the segment once it is whole, and asks for that', async () => {
    const lists = await opened(list(...segments(10, 2), part('12.0')));
    assert.equal(lists.piece(0, { number: 12, part: 0 }, false), null);
    answer = () => list(...segments(10, 3));
    assert.ok(await lists.waitFor(0, { number: 12, part: 0 }, false, signal));
    assert.equal(asked.at(-1), 'anna/stream.m3u8?_HLS_msn=12');
    assert.equal(lists.piece(0, { number: 12, part: 0 }, false).part, null);
});

test('what it takes to read the list for each part is known by its length', async () => {
    const text = list(...segments(10, 2), part('12.0'));
    assert.equal((await opened(text)).bitsForParts(0), 8 * text.length * 4);
    assert.equal((await opened(['#EXTM3U', '#EXT-X-MAP:URI="map"', ...segments(10, 2)].join('\n'))).bitsForParts(0), 0);
});

test('a list that is compressed takes a third of that', async () => {
    const text = list(...segments(10, 2), part('12.0'));
    const { fetch: plain } = globalThis;
    globalThis.fetch = async () => new Response(text, { headers: { 'Content-Encoding': 'gzip' } });
    try {
        const lists = new parts.SegmentLists(base);
        await lists.open(signal);
        assert.equal(lists.bitsForParts(0), (8 * text.length * 4) / 3);
    } finally {
        globalThis.fetch = plain;
    }
});

test('the query of a link is kept', async () => {
    const text = list(...segments(10, 2));
    answer = () => text;
    const lists = new parts.SegmentLists(`${base}?sign=a`);
    await lists.open(signal);
    await lists.waitFor(0, { number: 12, part: 0 }, true, signal);
    assert.equal(asked.at(-1), 'anna/stream.m3u8?sign=a&_HLS_msn=12&_HLS_part=0');
});

// ---- servers that lie ---------------------------------------------------------------------------------------------------

test('a server that says it waits, and does not, is asked three times, and again once something came', async () => {
    const text = list(...segments(10, 2));
    const lists = await opened(text);
    for (let i = 0; i < 3; ++i) {
        assert.ok(lists.waits(0));
        assert.equal(await lists.waitFor(0, lists.end(0), true, signal), false);
    }
    assert.equal(lists.waits(0), false);
    answer = () => list(...segments(10, 3));
    await lists.read(0, signal);
    assert.ok(lists.waits(0));
});

test('one that never answers is waited for as long as four segments, and not asked so again', async () => {
    const lists = await opened(list('#EXT-X-MEDIA-SEQUENCE:1', '#EXTINF:0.1,', 'a').replace('TARGETDURATION:1', 'TARGETDURATION:0.1'));
    answer = (_, aborts) => new Promise((_, reject) => aborts.addEventListener('abort', () => reject(new Error('aborted'))));
    assert.equal(await lists.waitFor(0, lists.end(0), true, signal), false);
    assert.equal(lists.waits(0), false);
    assert.equal(asked.length, 2);
});

test('one that has lost the stream is told nothing more than that', async () => {
    const lists = await opened(list(...segments(10, 2)));
    answer = () => null;
    assert.equal(await lists.waitFor(0, lists.end(0), true, signal), false);
    assert.equal(lists.listOf(0).segments.length, 2, 'the last list stays');
});

test('a list that is older than the one before is taken, and times stay', async () => {
    const lists = await opened(list(...segments(10, 3), part('13.0')));
    answer = () => list(...segments(9, 3));
    await lists.read(0, signal);
    assert.equal(lists.beginUs(11), 1e6);
    assert.equal(lists.beginUs(9), -1e6);
    assert.equal(lists.endUs, 3.25e6);
});

// ---- what is not there yet ----------------------------------------------------------------------------------------------

// Runs it in virtual time: the seconds at which something was asked for, what was said, and what came of it.
async function waitingFor(run) {
    mock.timers.enable({ apis: ['setTimeout'] });
    const [seconds, notices] = [[], []];
    const { fetch: plain } = globalThis;
    let [second, outcome] = [0, null];
    globalThis.fetch = (...more) => {
        seconds.push(second);
        return plain(...more);
    };
    try {
        run((text) => notices.push(text)).then((value) => (outcome = { value }), (error) => (outcome = { error }));
        for (; ; ++second) {
            for (let i = 0; i < 20; ++i) await new Promise((resolve) => setImmediate(resolve));
            if (outcome || second > 200) return { seconds, notices, outcome };
            mock.timers.tick(1000);
        }
    } finally {
        globalThis.fetch = plain;
        mock.timers.reset();
    }
}

test('a playlist that is not there yet is asked for again, with pauses that grow, and said to be waited for once', async () => {
    let answers = 0;
    answer = () => (++answers < 5 ? null : list(...segments(10, 2)));
    let lists;
    const { seconds, notices, outcome } = await waitingFor((notice) => (lists = new parts.SegmentLists(base, notice)).open(signal));
    assert.equal(outcome.error, undefined);
    assert.deepEqual(seconds, [0, 1, 3, 7, 15]);
    assert.deepEqual(notices, ['The stream is not there yet. It is waited for.']);
    assert.equal(lists.listOf(0).segments.length, 2);
});

test('one that does not come within a minute is missing', async () => {
    answer = () => null;
    const { seconds, outcome } = await waitingFor((notice) => new parts.SegmentLists(base, notice).open(signal));
    assert.deepEqual(seconds, [0, 1, 3, 7, 15, 23, 31, 39, 47, 55, 63]);
    assert.equal(outcome.error.code, 'missing');
    assert.match(outcome.error.message, /There is no playlist at https:\/\/a\.example\/hls\/anna\/stream\.m3u8/);
});

test('the lowest playlist of a list of them is waited for, too', async () => {
    let answers = 0;
    answer = ({ pathname }) => (pathname.endsWith('master.m3u8') ? ladder : ++answers < 3 ? null : list(...segments(10, 2)));
    const { seconds, notices, outcome } = await waitingFor((notice) => new parts.SegmentLists('https://a.example/hls/anna/master.m3u8', notice).open(signal));
    assert.equal(outcome.error, undefined);
    assert.deepEqual(seconds, [0, 0, 1, 3]);
    assert.equal(notices.length, 1);
});

test('whoever leaves waits no longer', async () => {
    const abort = new AbortController();
    answer = () => null;
    setImmediate(() => abort.abort());
    const { seconds, outcome } = await waitingFor((notice) => new parts.SegmentLists(base, notice).open(abort.signal));
    assert.equal(outcome.error.message, 'aborted');
    assert.deepEqual(seconds, [0]);
});

test('a finer playlist that is not there is put off, each time for longer', async () => {
    const lists = await withRungs(list(...segments(10, 2)), null);
    const { now } = performance;
    let clock = 0;
    performance.now = () => clock;
    try {
        const seconds = [];
        for (let i = 0; i < 6; ++i) {
            await assert.rejects(lists.read(1, signal), { code: 'missing' });
            lists.putOff(1);
            const begin = clock;
            while (lists.isPutOff(1)) clock += 500;
            seconds.push((clock - begin) / 1000);
        }
        assert.deepEqual(seconds, [1, 2, 4, 8, 8, 8]);
        assert.equal(lists.isPutOff(0), false);
    } finally {
        performance.now = now;
    }
});

test('a list that was there, and is not for a while, is asked for less and less, and given up after a minute', async () => {
    const { now } = performance;
    let clock = 0;
    performance.now = () => clock;
    try {
        answer = () => list(...segments(10, 2));
        const notices = [];
        const lists = new parts.SegmentLists(base, (text) => notices.push(text));
        await lists.open(signal);
        answer = () => null;
        const seconds = [];
        const noted = [];
        for (;;) {
            const good = lists.goodForMs(0);
            clock += good;
            seconds.push(good / 1000);
            const failed = await lists.read(0, signal).then(() => null, (error) => error);
            noted.push(notices.length);
            if (failed) {
                assert.equal(failed.code, 'missing');
                break;
            }
        }
        assert.deepEqual(seconds, [0.5, 0.5, 1, 2, 4, 8, 8, 8, 8, 8, 8]);
        assert.deepEqual(noted.slice(0, 4), [0, 0, 1, 1]);
        assert.deepEqual(notices, ['What comes next of the stream cannot be had at the moment. It is waited for.']);
    } finally {
        performance.now = now;
    }
});

test('one that is there again is asked for as before', async () => {
    const lists = await opened(list(...segments(10, 2)));
    const { now } = performance;
    performance.now = () => 1000;
    try {
        answer = () => null;
        for (let i = 0; i < 4; ++i) await lists.read(0, signal);
        assert.equal(lists.goodForMs(0), 4000);
        answer = () => list(...segments(10, 3));
        await lists.read(0, signal);
        assert.equal(lists.goodForMs(0), 500);
    } finally {
        performance.now = now;
    }
});

// ---- rungs --------------------------------------------------------------------------------------------------------------

const dated = (first, count, ms) =>
    list(`#EXT-X-MEDIA-SEQUENCE:${first}`, ...Array.from({ length: count }, (_, i) => `#EXT-X-PROGRAM-DATE-TIME:${new Date(ms + 1000 * i).toISOString()}\n#EXTINF:1,\n${first + i}.m4s`));
const ladder = ['#EXTM3U', '#EXT-X-STREAM-INF:BANDWIDTH=1', '../anna~1/stream.m3u8', '#EXT-X-STREAM-INF:BANDWIDTH=2', '../anna~2/stream.m3u8'].join('\n');

async function withRungs(first, second) {
    const texts = { '/hls/anna/master.m3u8': ladder, '/hls/anna~1/stream.m3u8': first, '/hls/anna~2/stream.m3u8': second };
    answer = ({ pathname }) => texts[pathname] ?? null;
    const lists = new parts.SegmentLists('https://a.example/hls/anna/master.m3u8');
    await lists.open(signal);
    if (second) await lists.read(1, signal);
    return lists;
}

const noon = Date.UTC(2026, 0, 1, 12);

test('segments of the same date are the same in all rungs, whatever their numbers', async () => {
    const lists = await withRungs(dated(100, 5, noon), dated(7, 4, noon + 2040));
    assert.deepEqual(lists.listOf(1).segments.map(({ number }) => number), [102, 103, 104, 105]);
    assert.equal(lists.piece(1, { number: 103, part: 0 }, true).url, 'https://a.example/hls/anna~2/8.m4s');
    assert.equal(lists.beginUs(103), 3e6);
    await lists.waitFor(1, { number: 106, part: 0 }, true, signal);
    assert.equal(asked.at(-1), 'anna~2/stream.m3u8?_HLS_msn=11&_HLS_part=0', 'its server is asked by its own numbers');
});

test('dates that have nothing to do with each other change no numbers', async () => {
    const lists = await withRungs(dated(100, 5, noon), dated(101, 4, noon + 3600000));
    assert.deepEqual(lists.listOf(1).segments.map(({ number }) => number), [101, 102, 103, 104]);
});

test('dates that are none are passed over', async () => {
    const lists = await opened(list('#EXT-X-PROGRAM-DATE-TIME:yesterday', ...segments(10, 2)));
    assert.equal(lists.listOf(0).segments[0].dateMs, null);
});
