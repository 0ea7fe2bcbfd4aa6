// The player's worker: one stream, decoded by a session of its kind of source.
import { DecoderModule } from '@htvm/decoder';
import { FileSession } from './file_session.js';
import { LiveSession } from './live_session.js';
import type { Report, Request, SourceKind } from './messages.js';
import { StreamOpening } from './open_stream.js';
import type { OpenRequest, Post, Session } from './session.js';

const scope = globalThis as unknown as {
    postMessage(message: Report, transfer?: Transferable[]): void;
    onmessage: ((event: MessageEvent<Request>) => void) | null;
};
const post: Post = (report, transfer = []) => scope.postMessage(report, transfer);

/** Begins to fetch while the decoder is loaded, where the source can, and makes the session once it is. */
type Opening = (request: OpenRequest) => (module: DecoderModule) => Session;
const openings: Record<SourceKind, Opening> = {
    file: (request) => {
        const opening = new StreamOpening(request.url);
        return (module) => new FileSession(request, module, post, opening);
    },
    live: (request) => (module) => new LiveSession(request, module, post),
};

let session: Promise<Session> | null = null;

async function open(request: OpenRequest): Promise<Session> {
    const decoder = fetch(request.wasmUrl).then((response) => DecoderModule.load(response));
    let opened: Session;
    try {
        const make = openings[request.source](request);
        opened = make(await decoder);
    } catch (error) {
        const csp = error instanceof WebAssembly.CompileError && String(error).includes('Content Security Policy');
        const why = csp
            ? 'the page\'s Content-Security-Policy forbids it: add "wasm-unsafe-eval" to its script-src'
            : String(error instanceof Error ? error.message : error);
        post({ type: 'failed', code: 'decoder', text: `The decoder could not be started: ${why}.` });
        throw error;
    }
    void opened.run();
    return opened;
}

scope.onmessage = ({ data }) => {
    if (data.type === 'open') {
        session = open(data);
        session.catch(() => undefined); // it was told
    } else {
        void session?.then((opened) => opened.request(data), () => undefined);
    }
};
