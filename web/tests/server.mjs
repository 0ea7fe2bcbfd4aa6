// A web server for the tests, with the manners, good and bad, of those that people have:
//
//   /as-is/FILE       ranges, ETag                       /no-ranges/FILE   whole files only
//   /gzip/FILE        compressed where the browser asks  /cut/FILE         the first two thirds of the file
//   /slow/FILE        held back until release()          /changing/FILE    the file that replace() names, with its ETag
//   /endless/FILE     a body that never ends, of a size that is not told; its second half comes after release()
//
// Other addresses are pages and scripts. Every request is kept in `requests`.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { join, normalize } from 'node:path';
import { gzipSync } from 'node:zlib';

const types = {
    '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.htvm': 'application/octet-stream',
    '.png': 'image/png',
};

export class TestServer {
    requests = [];
    /** Sent with pages. */
    pageHeaders = {};
    /** Sent with streams, for pages of other sites. */
    streamHeaders = {};
    #server;
    #roots;
    #changing = null;
    #held = [];

    /** roots: folders by the first part of an address; '' for all others. */
    constructor(roots) {
        this.#roots = roots;
        this.#server = createServer((request, response) => {
            this.#answer(request, response).catch((error) => {
                response.writeHead(error.code === 'ENOENT' ? 404 : 500);
                response.end(String(error));
            });
        });
    }

    async start() {
        await new Promise((resolve) => this.#server.listen(0, '127.0.0.1', resolve));
        this.origin = `http://127.0.0.1:${this.#server.address().port}`;
        return this;
    }

    stop() {
        this.#server.closeAllConnections();
        this.#server.close();
    }

    replace(name) {
        this.#changing = name;
    }

    release() {
        for (const resolve of this.#held.splice(0)) resolve();
    }

    async #answer(request, response) {
        const path = normalize(decodeURIComponent(new URL(request.url, this.origin).pathname)).slice(1);
        this.requests.push({ method: request.method, path, range: request.headers.range ?? null });
        const [first, ...rest] = path.split('/');
        const manner = ['as-is', 'no-ranges', 'gzip', 'cut', 'slow', 'changing', 'endless'].includes(first) ? first : null;
        if (!manner) {
            const root = this.#roots[first];
            const file = root ? join(root, ...rest) : join(this.#roots[''], path);
            const body = await readFile(file);
            const type = types[/\.\w+$/.exec(file)?.[0]] ?? 'application/octet-stream';
            response.writeHead(200, { 'Content-Type': type, ...(type.startsWith('text/html') ? this.pageHeaders : {}) });
            response.end(body);
            return;
        }
        let name = rest.join('/');
        if (manner === 'changing' && this.#changing) name = this.#changing;
        if (manner === 'slow') await new Promise((resolve) => this.#held.push(resolve));
        let body = await this.#stream(name);
        if (manner === 'cut') body = body.subarray(0, Math.floor((2 * body.length) / 3));
        const headers = { 'Content-Type': 'application/octet-stream', ETag: `"${name}"`, ...this.streamHeaders };
        if (manner === 'endless') {
            const half = Math.floor(body.length / 2);
            response.writeHead(200, headers);
            response.write(body.subarray(0, half));
            await new Promise((resolve) => this.#held.push(resolve));
            response.write(body.subarray(half));
            return;
        }
        const range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
        if (manner === 'gzip' && /gzip/.test(request.headers['accept-encoding'] ?? '')) {
            response.writeHead(200, { ...headers, 'Content-Encoding': 'gzip' });
            response.end(gzipSync(body));
        } else if (range && manner !== 'no-ranges' && manner !== 'gzip') {
            const from = Number(range[1]);
            const to = Math.min(Number(range[2]), body.length - 1);
            if (from >= body.length) {
                response.writeHead(416, { ...headers, 'Content-Range': `bytes */${body.length}` });
                response.end();
                return;
            }
            response.writeHead(206, {
                ...headers, 'Content-Range': `bytes ${from}-${to}/${body.length}`, 'Content-Length': to - from + 1,
            });
            response.end(request.method === 'HEAD' ? undefined : body.subarray(from, to + 1));
        } else {
            response.writeHead(200, { ...headers, 'Content-Length': body.length });
            response.end(request.method === 'HEAD' ? undefined : body);
        }
    }

    /** Streams made by tests, by name. */
    made = new Map();

    async #stream(name) {
        return this.made.get(name) ?? readFile(join(this.#roots.streams, name));
    }
}
