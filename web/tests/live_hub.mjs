// A hub for the tests: the viewers' side of docs/live.md over real WebSockets (RFC 6455) and endless bodies.
import { createHash } from 'node:crypto';
import { createServer } from 'node:http';
import { isFrame, isStart, packetKind } from '../packages/decoder/dist/node.js';
import { packet, packetsOf } from './streams.mjs';

const magic = '258EAFA5-E914-47DA-95CA-C5AB0DC85B11';
const opcode = { text: 1, binary: 2, close: 8 };

function frame(code, payload) {
    const { length } = payload;
    const head = length < 126 ? [length] : length < 65536 ? [126, length >> 8, length & 255] : [127, 0, 0, 0, 0, length >>> 24, (length >> 16) & 255, (length >> 8) & 255, length & 255];
    return Buffer.concat([Buffer.from([128 | code, ...head]), payload]);
}

/** A viewer by WebSocket. */
class Viewer {
    /** Text messages that came, parsed. */
    heard = [];
    #socket;
    #bytes = Buffer.alloc(0);

    constructor(socket, url) {
        this.url = url;
        this.#socket = socket;
        socket.on('data', (bytes) => this.#take(bytes));
        socket.on('error', () => undefined);
        this.closed = new Promise((resolve) => socket.on('close', resolve));
    }

    say(message) {
        this.#socket.write(frame(opcode.text, Buffer.from(JSON.stringify(message))));
    }
    send(packet) {
        this.#socket.write(frame(opcode.binary, Buffer.from(packet)));
    }
    close(code, reason = '') {
        this.#socket.end(frame(opcode.close, Buffer.concat([Buffer.from([code >> 8, code & 255]), Buffer.from(reason)])));
    }
    /** As when a cable is pulled. */
    destroy() {
        this.#socket.destroy();
    }

    #take(bytes) {
        this.#bytes = Buffer.concat([this.#bytes, bytes]);
        while (this.#bytes.length >= 6) {
            const length = this.#bytes[1] & 127; // viewers' messages are short
            if (this.#bytes.length < 6 + length) return;
            const payload = this.#bytes.subarray(6, 6 + length).map((byte, i) => byte ^ this.#bytes[2 + (i % 4)]);
            const code = this.#bytes[0] & 15;
            if (code === opcode.text) this.heard.push(JSON.parse(Buffer.from(payload).toString()));
            if (code === opcode.close) this.#socket.end(frame(opcode.close, payload));
            this.#bytes = this.#bytes.subarray(6 + length);
        }
    }
}

/** A viewer by an endless body. */
class BodyViewer {
    #response;
    constructor(response) {
        this.#response = response;
        response.writeHead(200, { 'Content-Type': 'application/octet-stream', 'Access-Control-Allow-Origin': '*' });
        response.flushHeaders();
        this.closed = new Promise((resolve) => response.on('close', resolve));
    }
    say() {}
    send(packet) {
        this.#response.write(packet);
    }
    destroy() {
        this.#response.destroy();
    }
}

export class LiveHub {
    /** Those who are connected. */
    viewers = [];
    /** Whether upgrades are refused, as by a proxy that knows no WebSockets. */
    socketsBlocked = false;
    /** Called with each viewer that comes. */
    onViewer = () => undefined;
    #server = null;
    #port = 0;

    async start() {
        this.#server = createServer((request, response) => {
            if (!request.url.startsWith('/watch/')) return response.writeHead(404, { 'Access-Control-Allow-Origin': '*' }).end();
            this.#welcome(new BodyViewer(response));
        });
        this.#server.on('upgrade', (request, socket) => {
            if (this.socketsBlocked || !request.url.startsWith('/watch/')) return socket.end('HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n');
            const key = createHash('sha1').update(request.headers['sec-websocket-key'] + magic).digest('base64');
            socket.setNoDelay(true);
            socket.write(
                'HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n' +
                    `Sec-WebSocket-Accept: ${key}\r\nSec-WebSocket-Protocol: htvm.1\r\n\r\n`);
            const viewer = new Viewer(socket, request.url);
            viewer.say({ type: 'hello', version: 1, stream: 'test', hubs: [] });
            this.#welcome(viewer);
        });
        await new Promise((resolve) => this.#server.listen(this.#port, '127.0.0.1', resolve));
        this.#port = this.#server.address().port;
        return this;
    }

    address(scheme) {
        return `${scheme}://127.0.0.1:${this.#port}/watch/test`;
    }

    /** At the same address it can be started again. */
    async stop() {
        for (const viewer of this.viewers) viewer.destroy();
        this.#server.closeAllConnections();
        await new Promise((resolve) => this.#server.close(resolve));
        this.viewers = [];
    }

    #welcome(viewer) {
        viewer.since = Date.now();
        this.viewers.push(viewer);
        void viewer.closed.then(() => (this.viewers = this.viewers.filter((other) => other !== viewer)));
        this.onViewer(viewer);
    }
}

/**
 * Publishes a stream of one sequence to a hub's viewers, at its timestamps, again and again as one session: numbers and
 * timestamps go on. Who comes late is sent the header, and what the newest frame needs.
 */
export class Publishing {
    published = true;
    /** Called with each frame's packet before it is sent. */
    onFrame = () => undefined;
    #hub;
    #header;
    #packets;
    #frames;
    #timers;
    #began = performance.now();
    #next = 0;
    #closure = [];

    constructor(hub, stream) {
        this.#hub = hub;
        const [header, ...packets] = packetsOf(stream).filter(({ kind }) => kind !== packetKind.index && kind !== packetKind.frontIndex);
        this.#header = header.bytes;
        this.#packets = packets;
        this.#frames = packets.filter(({ kind }) => isFrame(kind)).length;
        hub.onViewer = (viewer) => {
            viewer.send(this.#header);
            for (const bytes of this.#closure) viewer.send(bytes);
        };
        this.#timers = [setInterval(() => this.#publish(), 4), setInterval(() => this.#beat(), 1000)];
    }

    /** Stream time now, microseconds. */
    get clock() {
        return Math.round((performance.now() - this.#began) * 1000);
    }

    stop() {
        for (const timer of this.#timers) clearInterval(timer);
    }

    /** From the beginning again, with a header that differs. */
    beginSession() {
        const payload = this.#header.slice(32, -4);
        payload[7] ^= 1; // the lattice's origin
        this.#header = packet(packetKind.sequence, payload);
        this.#closure = [];
        this.#next = 0;
        this.#began = performance.now();
        for (const viewer of this.#hub.viewers) viewer.send(this.#header);
    }

    #beat() {
        for (const viewer of this.#hub.viewers)
            viewer.say({ type: 'heartbeat', published: this.published, clock: this.clock, viewers: 1, dropped: 0 });
    }

    #publish() {
        for (;;) {
            const { kind, flags, frame, reference, timestampUs, bytes } = this.#packets[this.#next % this.#packets.length];
            const by = this.#frames * Math.floor(this.#next / this.#packets.length);
            const time = timestampUs + Math.round((by * 1e6) / 30);
            if (time > this.clock) return;
            ++this.#next;
            const made = packet(kind, bytes.subarray(32, -4), { frame: frame + by, reference: reference + by, timestampUs: time, flags });
            if (isStart({ kind, flags })) this.#closure = [];
            if (kind !== packetKind.audio) this.#closure.push(made);
            if (isFrame(kind)) this.onFrame(frame + by);
            for (const viewer of this.#hub.viewers) viewer.send(made);
        }
    }
}
