// examples/nginx/htvm.conf with Debian's nginx and a certificate of its own: what the server says, and the player behind it.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
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
let work, nginx, port, stream, expected;

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
    const places = ['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((kind) => `${kind}_temp_path ${work}/${kind};`).join(' ');
    await writeFile(join(work, 'nginx.conf'),
        `${process.getuid() === 0 ? 'user root; ' : ''}pid ${work}/pid; error_log ${work}/error.log; events {} http { include /etc/nginx/mime.types; access_log ${work}/access.log; ${places}\n${configuration}\n}\n`);
    nginx = spawn('nginx', ['-c', join(work, 'nginx.conf'), '-g', 'daemon off;'], { stdio: 'inherit' });
    for (let tries = 0; tries < 100; ++tries) {
        try {
            return void (await get('/'));
        } catch {
            await new Promise((resolve) => setTimeout(resolve, 50));
        }
    }
    throw new Error(`nginx does not answer: ${await readFile(join(work, 'error.log'), 'utf8')}`);
});

after(async () => {
    if (nginx) {
        const ended = new Promise((resolve) => nginx.on('exit', resolve));
        nginx.kill('SIGTERM');
        await ended;
    }
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
