// Damaged boxes and playlists, as seeds draw them: each is read to an end, or refused in words, with no more work and memory than
// its bytes are worth. Needs no program: the files are those that the fuzz targets begin with.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const base = 'https://a.example/live/stream.m3u8';
const rounds = 3000;
const mostSamples = 1 << 20;

let parts, movies, playlist;

before(async () => {
    const contents = "export * from './playlist.ts'; export * from './mp4_tables.ts'; export * from './mp4_samples.ts'; export { SourceError } from './byte_source.ts';";
    const { outputFiles } = await build({
        stdin: { contents, resolveDir: path('../packages/player/src') }, bundle: true, format: 'esm', platform: 'node', write: false, logLevel: 'error',
    });
    parts = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
    // Behind the file stands which kind of input it is.
    const file = async (name) => {
        const bytes = await readFile(path(`../../fuzz/seeds/import_mp4/${name}`));
        return bytes.subarray(bytes.indexOf('ftyp') - 4);
    };
    movies = [await file('tiny'), await file('tiny--fragmented')];
    playlist = await readFile(path('../../fuzz/seeds/import_playlist/window'), 'latin1');
});

// Numbers that a seed draws, below a bound.
function draws(seed) {
    let state = seed >>> 0;
    return (bound) => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return Math.floor((state / 2 ** 32) * bound);
    };
}

const telling = [0, 1, 0x7f, 0x80, 0xff];

function damaged(bytes, below) {
    let out = Buffer.from(bytes);
    for (let changes = 1 + below(4); changes > 0 && out.length > 8; --changes) {
        const at = below(out.length);
        const kind = below(6);
        if (kind === 0) out[at] = telling[below(telling.length)];
        else if (kind === 1) out[at] ^= 1 << below(8);
        else if (kind === 2) out = out.subarray(0, at);
        else if (kind === 3) out = Buffer.concat([out.subarray(0, at), out.subarray(at + 1 + below(40))]);
        else if (kind === 4) out = Buffer.concat([out.subarray(0, at), out.subarray(below(out.length)), out.subarray(at)]).subarray(0, 4 * bytes.length);
        else if (at + 4 <= out.length) out.writeUInt32BE([0, 1, 0x7fffffff, 0xffffffff, out.length][below(5)], at);
    }
    return out;
}

// What is read of a file, as the player reads it; and how many bytes its samples were read for.
async function readAll(bytes) {
    let movie = null;
    for (const { type, begin, inside } of parts.boxesOf(bytes, true)) {
        if (type === 'moov' && !movie) movie = parts.readMovie(inside);
        if (type === 'moof' && movie) parts.readFragment(movie, begin, inside);
    }
    if (!movie) return { packets: 0, read: 0 };
    const samples = movie.tracks.reduce((sum, track) => sum + track.samples.count, 0);
    assert.ok(samples <= mostSamples, `${samples} samples`);
    let read = 0;
    const reader = new parts.SampleReader(movie, async (offset, size) => {
        const there = offset >= 0 && offset + size <= bytes.length;
        if (there) read += size;
        return there ? bytes.subarray(offset, offset + size) : null;
    });
    const meshes = movie.tracks.find(({ kind }) => kind === 'meshes').samples;
    let packets = 0;
    for (let i = 0; i < Math.min(meshes.count, 200); ++i) {
        reader.configurationOf(i);
        packets += (await reader.packetsOf(i)).packets.length;
    }
    return { packets, read };
}

test('the files themselves are read', async () => {
    for (const movie of movies) {
        const { packets } = await readAll(movie);
        assert.ok(packets >= 4, `${packets} packets`);
    }
});

test('damaged boxes are read to an end, or refused in words', async () => {
    let refused = 0;
    for (let seed = 1; seed <= rounds; ++seed) {
        const below = draws(seed);
        const bytes = new Uint8Array(damaged(movies[below(movies.length)], below));
        try {
            const { read } = await readAll(bytes);
            assert.ok(read <= 200 * bytes.length, `seed ${seed}: ${read} bytes read of ${bytes.length}`);
        } catch (error) {
            if (!(error instanceof parts.SourceError)) throw new Error(`seed ${seed}`, { cause: error });
            assert.match(error.message, /^Th(e|is) \.mp4/);
            ++refused;
        }
    }
    assert.ok(refused > rounds / 20 && refused < rounds, `${refused} of ${rounds} are refused`);
});

test('damaged playlists are read, or refused in words', () => {
    const lists = [playlist, ['#EXTM3U', '#EXT-X-STREAM-INF:BANDWIDTH=2500000,CODECS="htvm"', 'high.m3u8', '#EXT-X-STREAM-INF:BANDWIDTH=400000', 'low.m3u8'].join('\n')];
    let refused = 0;
    for (let seed = 1; seed <= rounds; ++seed) {
        const below = draws(seed);
        const text = damaged(Buffer.from(lists[below(lists.length)], 'latin1'), below).toString('latin1');
        try {
            const read = parts.readPlaylist(text, base);
            for (const { url } of read.variants ?? read.playlist.segments) assert.match(url, /^https?:/);
            for (const { seconds, number } of read.playlist?.segments ?? []) assert.ok(seconds >= 0 && seconds <= 3600 && Number.isSafeInteger(number));
        } catch (error) {
            if (!(error instanceof parts.SourceError)) throw new Error(`seed ${seed}`, { cause: error });
            ++refused;
        }
    }
    assert.ok(refused > rounds / 20 && refused < rounds, `${refused} of ${rounds} are refused`);
});

test('attributes without an end, and lines without a length, take no more than a moment', () => {
    for (const text of [`#EXTM3U\n#EXT-X-MAP:${'A'.repeat(1 << 20)}`, `#EXTM3U\n#EXT-X-STREAM-INF:${'A="'.repeat(1 << 18)}\nx`, `#EXTM3U\n${' '.repeat(1 << 20)}x`, `#EXTM3U\n#EXTINF:${'1'.repeat(1 << 20)}`])
        assert.throws(() => parts.readPlaylist(text, base), parts.SourceError);
});

test('packets whose rest is nowhere are not sought among all samples again and again', async () => {
    // A sample full of parted packets, and a track of pictures whose samples never have their size.
    const most = 1 << 23;
    let looked = 0;
    const counted = (values) => new Proxy(values, { get: (of, key) => (typeof key === 'string' && /^\d/.test(key) && ++looked, Reflect.get(of, key)) });
    const packet = movies[0].indexOf('HTVP');
    const part = Buffer.concat([Buffer.from('HTVX'), Buffer.from([1, 0, 1, 0]), movies[0].subarray(packet, packet + 32), Buffer.alloc(8)]);
    const sample = new Uint8Array(Buffer.concat(Array(8000).fill(part)));
    const column = (value, count) => new Array(count).fill(value);
    const track = (kind, sizes) => ({
        id: 1, kind, clock: 1000000, configurations: [], needs: new Map(), nextTime: 0, defaults: {},
        samples: { offsets: column(0, sizes.length), sizes, times: column(0, sizes.length), entries: column(0, sizes.length), sync: column(true, sizes.length), count: sizes.length },
    });
    const pictures = track('pictures', column(3, 5000));
    pictures.samples.sizes = counted(pictures.samples.sizes);
    const reader = new parts.SampleReader({ tracks: [track('meshes', [sample.length]), pictures], durationUs: null, fragmented: false }, async () => sample);
    await reader.packetsOf(0);
    assert.ok(looked < most + 5000, `${looked} sizes were looked at`);
});
