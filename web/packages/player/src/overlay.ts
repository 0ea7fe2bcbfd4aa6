// What is drawn and said over the picture, but for the controls: the poster, that it is loading, notices, why it cannot be
// played, how a live stream is, the statistics, and a description for screen readers.
import { make } from './controls.js';
import type { LiveStateDetail } from './live_state.js';

const keepNoticeMs = 6000;

export class Overlay {
    readonly poster = make('img', 'poster', { alt: '' });
    readonly spinner = make('div', 'spinner', { 'aria-hidden': 'true' });
    readonly panel = make('pre', 'panel', { 'aria-hidden': 'true' });
    readonly unmute = make('button', 'unmute', { type: 'button' });
    #notice = make('div', 'notice', { role: 'status' });
    #failure = make('div', 'failure', { role: 'alert' });
    #livestate = make('div', 'livestate', { role: 'status' });
    #description = make('div', 'description', { id: 'description' });
    #noticeUntil = 0;
    #liveText = '';

    constructor() {
        for (const part of [this.poster, this.spinner, this.panel, this.unmute, this.#notice, this.#failure, this.#livestate]) part.hidden = true;
        this.unmute.textContent = 'Turn the sound on';
        this.#description.textContent =
            'Drag or use the arrow keys to turn the view, shift to move it, plus and minus to come nearer or go away, 0 to ' +
            'go back. Space plays and pauses, comma and full stop go by one frame.';
    }

    /** Lays its parts over a picture, below and above what pages lay over it, and the controls. */
    layOver(root: ShadowRoot, canvas: HTMLCanvasElement, bar: HTMLElement): void {
        canvas.setAttribute('aria-describedby', this.#description.id);
        root.append(
            canvas, this.poster, document.createElement('slot'), this.panel, this.spinner, this.#livestate, this.#notice,
            this.#failure, this.unmute, bar, this.#description);
    }

    /** For another stream. */
    clear(): void {
        for (const part of [this.#failure, this.#notice, this.#livestate]) part.hidden = true;
        this.#liveText = '';
    }

    notice(text: string, now: number): void {
        this.#notice.textContent = text;
        this.#notice.hidden = false;
        this.#noticeUntil = now + keepNoticeMs;
    }

    /** Takes a notice away that has been there for long enough. */
    expire(now: number): void {
        if (this.#noticeUntil === 0 || now <= this.#noticeUntil) return;
        this.#notice.hidden = true;
        this.#noticeUntil = 0;
    }

    fail(message: string): void {
        const box = document.createElement('div');
        const title = document.createElement('strong');
        title.textContent = 'This cannot be played';
        box.append(title, message);
        this.#failure.replaceChildren(box);
        this.#failure.hidden = false;
        this.poster.hidden = true;
    }

    /** How the stream is; true where that has changed. */
    state(detail: LiveStateDetail | null): boolean {
        this.#livestate.hidden = detail === null;
        if (!detail || detail.text === this.#liveText) return false;
        this.#liveText = this.#livestate.textContent = detail.text;
        this.#livestate.className = `livestate ${detail.state}`;
        return true;
    }
}
