// What is said about a live stream, from what the hub and the connection tell: in words on the player, and as an event.
import type { LiveReport } from './messages.js';

export type LiveStateName = 'connecting' | 'waiting' | 'live' | 'behind' | 'gone' | 'reconnecting' | 'ended';

export interface LiveStateDetail {
    state: LiveStateName;
    /** In words, as the player shows it. */
    text: string;
    /** Seconds that the picture is behind the publisher's clock; NaN while that is not known. */
    behind: number;
}

/** What the player measures of a live stream. */
export interface LiveNumbers extends LiveStateDetail {
    /** How long frames that come without delay wait before they are shown, and the 98th percentile of arrivals' jitter: ms. */
    bufferMs: number;
    jitterMs: number;
    /** 1 but while the clock follows the publisher's. */
    speed: number;
    /** Frames that the hub did not send, and, among those it sent, how many were not decoded, and decoded but not shown in time. */
    droppedByHub: number;
    leftOut: number;
    notShown: number;
    /** People who watch the stream; NaN while that is not known. */
    viewers: number;
}

const sayBehindMs = 1000;

export class LiveState {
    viewers = NaN;
    /** Frames that the hub did not send because this viewer is too slow. */
    droppedByHub = 0;
    #link: (LiveReport & { type: 'link' })['link'] = 'connecting';
    #reason = '';
    #published = true;

    report(report: LiveReport): void {
        switch (report.type) {
            case 'link':
                this.#link = report.link;
                this.#reason = report.reason;
                if (report.link === 'open') this.#published = true;
                break;
            case 'heartbeat':
                this.#published = report.published;
                this.viewers = report.viewers;
                this.droppedByHub = report.dropped;
                break;
            case 'gone':
                this.#published = false;
                break;
            case 'stamp':
                break;
        }
    }

    /** A frame came, so somebody publishes. */
    frame(): void {
        this.#published = true;
    }

    /** shown: whether there is a picture of this connection or one before. */
    describe(shown: boolean, behindMs: number): LiveStateDetail {
        const say = (state: LiveStateName, text: string): LiveStateDetail => ({ state, text, behind: behindMs / 1000 });
        if (this.#link === 'ended') return say('ended', this.#reason ? `Ended: ${this.#reason}` : 'The stream has ended');
        if (this.#link === 'reconnecting') return say('reconnecting', this.#reason ? `Reconnecting: ${this.#reason}` : 'Reconnecting');
        if (this.#link === 'connecting') return say('connecting', 'Connecting');
        if (!this.#published) return say('gone', 'Publisher gone');
        if (!shown) return say('waiting', 'Waiting for the first picture');
        if (behindMs > sayBehindMs) return say('behind', `${(behindMs / 1000).toFixed(1)} s behind`);
        return say('live', 'Live');
    }
}
