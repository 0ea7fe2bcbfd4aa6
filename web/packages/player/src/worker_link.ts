// The page's end of its worker: starts it, sends it requests, and hears its reports, but none of one that was given up.
import type { Report, Request } from './messages.js';

export interface WorkerListener {
    report(report: Report): void;
    /** It cannot be started, or has stopped by itself. */
    notStarted(error: unknown): void;
    stopped(text: string): void;
}

export class WorkerLink {
    #make: () => Promise<Worker>;
    #listener: WorkerListener;
    #worker: Worker | null = null;
    #attempt = 0; // counts start() and stop(), so that what becomes of earlier ones is passed over

    constructor(make: () => Promise<Worker>, listener: WorkerListener) {
        this.#make = make;
        this.#listener = listener;
    }

    /** started: when requests can be sent. */
    async start(started: () => void): Promise<void> {
        const attempt = ++this.#attempt;
        let worker: Worker;
        try {
            worker = await this.#make();
        } catch (error) {
            if (attempt === this.#attempt) this.#listener.notStarted(error);
            return;
        }
        if (attempt !== this.#attempt) {
            worker.terminate();
            return;
        }
        this.#worker = worker;
        worker.onmessage = ({ data }: MessageEvent<Report>) => {
            if (worker === this.#worker) this.#listener.report(data);
        };
        worker.onerror = (event) => {
            event.preventDefault();
            if (worker === this.#worker) this.#listener.stopped(event.message || 'its worker stopped');
        };
        started();
    }

    /** Requests to no worker go nowhere. */
    send(request: Request, transfer: Transferable[] = []): void {
        this.#worker?.postMessage(request, transfer);
    }

    stop(): void {
        ++this.#attempt;
        this.#worker?.terminate();
        this.#worker = null;
    }
}
