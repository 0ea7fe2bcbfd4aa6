// examples/nginx/htvm.conf with Debian's nginx and a certificate of its own: what the server says, and the player behind it. And
// examples/cdn/hub.conf before a hub that the tests make up: what is said of a playlist that was not there, or is old.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createServer as createHttpServer } from 'node:http';
import { request } from 'node:https';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from '../browser.mjs';
import { conformance, digests, firstSequence, packetsOf, padded } from '../streams.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const name = 'captures.example.org';
let work, nginx, port, stream, expected, edge, edgePort, hub;

function freePort() {
    return new Promise((resolve) => {
        const server = createServer().listen(0, '127.0.0.1', () => {
            const { port } = server.address();
            server.close(() => resolve(port));
        });
    });
}

before(async () => {
    work = await mkdtemp(join(tmpdir(), 'htvm-nginx-'));
    const site = join(work, 'site');
    await mkdir(site);
    for (const file of ['htvm-player.js', 'htvm-worker.js', 'htvm_decoder.wasm']) await cp(path(`../../packages/player/dist/${file}`), join(site, file));
    await cp(path('../../examples/page.html'), join(site, 'index.html'));
    const original = firstSequence(await conformance('tracked_by_chance'));
    stream = padded(original, 30000, 'front');
    expected = (await digests('tracked_by_chance')).slice(0, packetsOf(original).length - 1);
    await writeFile(join(site, 'person.htvm'), stream);
    execFileSync('openssl', [
        'req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-keyout', join(work, 'key.pem'), '-out', join(work, 'cert.pem'), '-days', '2',
        '-subj', `/CN=${name}`, '-addext', `subjectAltName=DNS:${name}`,
    ], { stdio: 'pipe' });
    port = await freePort();
    const plain = await freePort();
    // As it is, but for places and ports, which only the administrator may use.
    const configuration = (await readFile(path('../../../examples/nginx/htvm.conf'), 'utf8'))
        .replace(/^ *listen \[::\].*\n/gm, '')
        .replace('listen 80;', `listen 127.0.0.1:${plain};`)
        .replace('listen 443 ', `listen 127.0.0.1:${port} `)
        .replace(/ssl_certificate .*;/, `ssl_certificate ${work}/cert.pem;`)
        .replace(/ssl_certificate_key .*;/, `ssl_certificate_key ${work}/key.pem;`)
        .replace('root /var/www/captures;', `root ${site};`);
    nginx = await startNginx('site', `include /etc/nginx/mime.types; access_log ${work}/access.log;\n${configuration}`);
    await answers('site', () => get('/'));
    hub = await startHub();
    edgePort = await freePort();
    edge = await startNginx('edge', (await readFile(path('../../../examples/cdn/hub.conf'), 'utf8'))
        .replace(/^[^]*?http \{/, '').replace(/\}\s*$/, '')
        .replaceAll('/var/lib/nginx', work).replaceAll('127.0.0.1:8080', `127.0.0.1:${hub.port}`)
        .replace('listen 8088', `listen 127.0.0.1:${edgePort}`));
    await answers('edge', () => playlist('nothing'));
});

// What belongs between the braces of http, in a configuration of its own.
async function startNginx(called, configuration) {
    const places = ['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((kind) => `${kind}_temp_path ${work}/${called}_${kind};`).join(' ');
    await writeFile(join(work, `${called}.conf`),
        `${process.getuid() === 0 ? 'user root; ' : ''}pid ${work}/${called}.pid; error_log ${work}/${called}.log; events {} http { ${places}\n${configuration}\n}\n`);
    return spawn('nginx', ['-c', join(work, `${called}.conf`), '-g', 'daemon off;'], { stdio: 'inherit' });
}

async function answers(called, ask) {
    for (let tries = 0; tries < 100; ++tries) {
        try {
            return void (await ask());
        } catch {
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
    }
    throw new Error(`nginx does not answer: ${await readFile(join(work, `${called}.log`), 'utf8')}`);
}

after(async () => {
    for (const one of [nginx, edge].filter((each) => each)) {
        const ended = new Promise((resolve) => one.on('exit', resolve));
        one.kill('SIGTERM');
        await ended;
    }
    hub?.server.closeAllConnections();
    hub?.server.close();
    if (work) await rm(work, { recursive: true });
});

function get(target, headers = {}) {
    return new Promise((resolve, reject) => {
        const asked = request({ host: '127.0.0.1', port, path: target, servername: name, headers: { Host: name, ...headers }, rejectUnauthorized: false }, (response) => {
            const pieces = [];
            response.on('data', (piece) => pieces.push(piece));
            response.on('end', () => resolve({ status: response.statusCode, headers: response.headers, body: Buffer.concat(pieces) }));
        });
        asked.on('error', reject);
        asked.end();
    });
}

test('streams are given by ranges, uncompressed, to pages of any site', async () => {
    const part = await get('/person.htvm', { Range: 'bytes=1000-2999', 'Accept-Encoding': 'gzip' });
    assert.equal(part.status, 206);
    assert.equal(part.headers['content-range'], `bytes 1000-2999/${stream.length}`);
    assert.equal(part.headers['content-encoding'], undefined);
    assert.equal(part.headers['access-control-allow-origin'], '*');
    assert.deepEqual(part.body, Buffer.from(stream.subarray(1000, 3000)));
    assert.equal((await get('/person.htvm', { Range: `bytes=${stream.length}-` })).status, 416);
    assert.equal((await get('/nowhere.htvm')).headers['access-control-allow-origin'], '*');
});

test('what has not changed is not sent again', async () => {
    for (const target of ['/person.htvm', '/htvm-player.js', '/']) {
        const { headers } = await get(target);
        assert.equal(headers['cache-control'], 'no-cache');
        assert.equal((await get(target, { 'If-None-Match': headers.etag })).status, 304);
    }
});

test('scripts and the decoder are compressed, with their types; pages have a policy', async () => {
    for (const [target, type] of [['/htvm-player.js', /javascript/], ['/htvm-worker.js', /javascript/], ['/htvm_decoder.wasm', /^application\/wasm/]]) {
        const { headers } = await get(target, { 'Accept-Encoding': 'gzip' });
        assert.match(headers['content-type'], type);
        assert.equal(headers['content-encoding'], 'gzip', target);
    }
    assert.match((await get('/')).headers['content-security-policy'], /wasm-unsafe-eval/);
});

test('the player plays through it, by ranges', { timeout: 60000 }, async () => {
    const browser = await launch([`--host-resolver-rules=MAP ${name} 127.0.0.1`]);
    try {
        const page = await browser.newPage({ ignoreHTTPSErrors: true, viewport: { width: 640, height: 480 } });
        const faults = [];
        page.on('console', (message) => message.type() === 'error' && !/favicon|404/.test(message.text()) && faults.push(message.text()));
        await page.addInitScript(() => {
            window.shown = [];
            addEventListener('framepresented', ({ detail }) => {
                if (!detail.preview) shown.push(`${detail.frame} ${detail.digest().toString(16).padStart(8, '0')}`);
            }, { capture: true });
        });
        await page.goto(`https://${name}:${port}/`);
        await page.waitForFunction(() => shown.length > 20);
        const right = new Set(expected.map((line) => `${line.split(' ')[0]} ${line.split(' ')[4]}`));
        assert.deepEqual((await page.evaluate(() => shown)).filter((line) => !right.has(line)), []);
        assert.deepEqual(faults, []);
    } finally {
        await browser.close();
    }
    const log = await readFile(join(work, 'access.log'), 'utf8');
    assert.match(log, /GET \/person\.htvm HTTP\/[12][.\d]*" 206 262144/);
});

// ---- an edge before a hub -----------------------------------------------------------------------------------------------

// A hub whose playlists are what `lists` has by name, and others not there; `held` keeps its answers back until it is called.
async function startHub() {
    const lists = new Map();
    const asked = [];
    const out = { lists, asked, wait: null };
    out.server = createHttpServer(async (incoming, response) => {
        const stream = incoming.url.split('/')[2];
        asked.push(stream);
        await out.wait;
        const list = lists.get(stream);
        response.writeHead(list ? 200 : 404, { 'Cache-Control': 'public, max-age=1', 'Content-Type': 'application/vnd.apple.mpegurl' });
        response.end(list ?? '');
    });
    await new Promise((resolve) => out.server.listen(0, '127.0.0.1', resolve));
    out.port = out.server.address().port;
    return out;
}

async function playlist(stream) {
    const response = await fetch(`http://127.0.0.1:${edgePort}/hls/${stream}/stream.m3u8`);
    return { status: response.status, cache: response.headers.get('x-cache'), text: await response.text() };
}

const grownOld = () => new Promise((resolve) => setTimeout(resolve, 2100)); // nginx counts whole seconds

test('the first viewer for a while of a stream that was not there has it, and not that it was not there', async () => {
    assert.equal((await playlist('anna')).status, 404);
    assert.equal((await playlist('anna')).cache, 'HIT', 'that it is not there is kept for a moment');
    hub.lists.set('anna', '#EXTM3U\n');
    await grownOld();
    assert.deepEqual(await playlist('anna'), { status: 200, cache: 'EXPIRED', text: '#EXTM3U\n' });
});

test('the first viewer for a while has the new playlist; who comes while it is fetched has the last one at once', async () => {
    hub.lists.set('berta', 'the last one');
    await playlist('berta');
    hub.lists.set('berta', 'a new one');
    await grownOld();
    let release;
    hub.wait = new Promise((resolve) => (release = resolve));
    const before = hub.asked.length;
    const first = playlist('berta');
    while (hub.asked.length === before) await new Promise((resolve) => setTimeout(resolve, 10));
    assert.deepEqual(await playlist('berta'), { status: 200, cache: 'UPDATING', text: 'the last one' });
    release();
    hub.wait = null;
    assert.deepEqual(await first, { status: 200, cache: 'EXPIRED', text: 'a new one' });
    assert.equal(hub.asked.length, before + 1);
});

test('a hub that is back before its publishers takes no playlist away', async () => {
    hub.lists.set('clara', 'the last one');
    await playlist('clara');
    hub.lists.delete('clara');
    await grownOld();
    assert.deepEqual(await playlist('clara'), { status: 200, cache: 'STALE', text: 'the last one' });
});

test('playlists are compressed, and pages of other sites may know it', async () => {
    hub.lists.set('dora', '#EXTM3U\n'.padEnd(4000, '#EXT-X-PART\n'));
    const response = await fetch(`http://127.0.0.1:${edgePort}/hls/dora/stream.m3u8`, { headers: { 'Accept-Encoding': 'gzip' } });
    assert.equal(response.headers.get('content-encoding'), 'gzip');
    assert.match(response.headers.get('access-control-expose-headers'), /Content-Encoding/);
    assert.equal((await response.text()).length, 4000);
});
