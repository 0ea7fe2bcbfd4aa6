// <htvm-player src="person.htvm" autoplay loop controls>: the element that pages use. docs/player.md is its manual.
import type { Axis, SequenceInfo } from '@htvm/decoder';
import type { Clock } from './clock.js';
import { actOnKey, Controls, type ControlActions } from './controls.js';
import type { FramePresentedDetail, PlayerErrorDetail, PlayerStatistics, PlayerView } from './details.js';
import { Display } from './display.js';
import { DrawingLoop } from './drawing_loop.js';
import { frontOf } from './facing.js';
import { StampBook, type FrameStamps } from './frame_stamps.js';
import { FullScreen } from './full_screen.js';
import { ladderNumbers } from './ladder_numbers.js';
import type { FrameReport } from './messages.js';
import { Overlay } from './overlay.js';
import { Playback, type PlaybackListener } from './playback.js';
import { Sound } from './sound.js';
import { Statistics } from './statistics.js';
import { styles } from './styles.js';
import { vrIsPossible } from './vr.js';
import { startWorker } from './worker_start.js';

const restAfterMs = 2500;
const timeUpdateMs = 250;
const axes: readonly string[] = ['x', 'y', 'z', '-x', '-y', '-z'];

/**
 * Events: loadedmetadata, durationchange, play, pause, seeking, seeked, waiting, ended, timeupdate, ratechange, volumechange,
 * viewchange, error (its detail a PlayerErrorDetail), notice (its detail a sentence), framepresented (its detail a
 * FramePresentedDetail), livestate (its detail a LiveStateDetail). What the element contains is drawn over the picture, below the controls.
 */
export class HtvmPlayerElement extends HTMLElement {
    static readonly observedAttributes = [
        'src', 'live', 'audio', 'muted', 'loop', 'controls', 'poster', 'lit', 'up', 'theme', 'floor', 'statistics', 'label', 'orbit',
        'fixed',
    ];
    /** Where the worker and the decoder lie; beside this file unless told, before the first element has a src. */
    static workerUrl: URL | string = new URL('./htvm-worker.js', import.meta.url);
    static decoderUrl: URL | string = new URL('./htvm_decoder.wasm', import.meta.url);

    // As attributes: see the end of this file.
    declare autoplay: boolean;
    declare loop: boolean;
    declare lit: boolean;
    /** The view stays where it is when the mesh leaves its middle. */
    declare fixed: boolean;
    /** The stream is a live one: src is a hub's /watch/NAME. */
    declare live: boolean;

    #display = new Display(this, { changed: () => this.#drawing.invalidate(), moved: () => this.#viewChanged() });
    #overlay = new Overlay();
    #controls: Controls;
    #playback: Playback;
    #sound: Sound;
    #drawing: DrawingLoop;
    #fullScreen = new FullScreen(this, () => this.#drawing.invalidate());
    #statistics = new Statistics();
    #stamps = new StampBook();
    #undrawn: FrameReport | null = null;
    #sequence: SequenceInfo | null = null;
    #error: PlayerErrorDetail | null = null;
    #shownFrames = 0;
    #restAt = 0;
    #lastTimeUpdate = 0;
    #wantsPlay = false;
    #connected = false;
    #dark = matchMedia('(prefers-color-scheme: dark)');

    constructor() {
        super();
        const root = this.attachShadow({ mode: 'open', delegatesFocus: true });
        const sheet = new CSSStyleSheet();
        sheet.replaceSync(styles);
        root.adoptedStyleSheets = [sheet];
        this.#controls = new Controls(this.#actions);
        this.#overlay.layOver(root, this.#display.canvas, this.#controls.bar);
        this.#sound = new Sound({ changed: () => this.#drawing.invalidate(), notice: (text) => this.#notice(text) });
        this.#playback = new Playback(
            () => startWorker(new URL(HtvmPlayerElement.workerUrl, location.href)),
            new URL(HtvmPlayerElement.decoderUrl, location.href).href, () => this.#sound.now(), this.#listener());
        this.#drawing = new DrawingLoop({
            draw: (now) => this.#draw(now),
            changes: () => this.#playback.needsTicks,
            suspended: () => !this.#connected || this.#display.inVr,
        });
        this.addEventListener('keydown', (event) => this.#key(event));
        this.addEventListener('pointermove', () => this.#stir());
        this.addEventListener('focusin', () => this.#stir());
        this.#overlay.unmute.addEventListener('click', () => this.#sound.allow());
        this.#display.onRestored(() => {
            if (this.#playback.hasPicture) this.#playback.showAgain();
        });
    }

    #listener(): PlaybackListener {
        return {
            opened: (sequence, layerNames) => {
                this.#sequence = sequence;
                this.#statistics.reset(layerNames);
                this.#setUp();
                this.#send('loadedmetadata');
            },
            extent: () => {
                this.#send('durationchange');
                this.#drawing.schedule();
            },
            arrived: (frame) => {
                if (frame) this.#stamps.decoded(frame);
                this.#drawing.schedule();
            },
            sound: (report) => this.#sound.add(report),
            jumped: () => this.#sound.jumped(),
            sought: () => this.#send('seeked'),
            waiting: () => this.#send('waiting'),
            ended: () => {
                this.#wantsPlay = false;
                this.#send('pause');
                this.#send('ended');
                this.#drawing.invalidate();
            },
            notice: (text) => this.#notice(text),
            failed: (code, message) => this.#fail({ code, message }),
            restarted: () => this.#display.forgetTopology(),
            live: (report) => {
                if (report.type === 'stamp') this.#stamps.message(report);
                else this.#drawing.invalidate();
            },
        };
    }

    // ---- for pages ------------------------------------------------------------------------------------------------

    get src(): string {
        return this.getAttribute('src') ?? '';
    }
    set src(value: string) {
        this.setAttribute('src', value);
    }

    /** The sound alone; true by the attribute of that name from the beginning on. */
    get muted(): boolean {
        return this.#sound.muted;
    }
    set muted(muted: boolean) {
        this.#sound.muted = muted;
        this.#send('volumechange');
    }

    /** 0 to 1. */
    get volume(): number {
        return this.#sound.volume;
    }
    set volume(volume: number) {
        this.#sound.volume = volume;
        this.#send('volumechange');
    }

    get paused(): boolean {
        return !this.#wantsPlay;
    }

    /** Seconds; 0 is the first frame. Setting it seeks. In a live stream it is the publisher's stream time, which cannot be set. */
    get currentTime(): number {
        return this.#playback.timeUs / 1e6;
    }
    set currentTime(seconds: number) {
        if (!Number.isFinite(seconds) || !this.#playback.canSeek) return;
        this.#send('seeking');
        this.#playback.seek(seconds * 1e6);
        this.#drawing.schedule();
    }

    /** Seconds; NaN while it is not known. */
    get duration(): number {
        return this.#playback.durationUs === null ? NaN : this.#playback.durationUs / 1e6;
    }

    /** 0.25 to 2. */
    get playbackRate(): number {
        return this.#playback.rate;
    }
    set playbackRate(rate: number) {
        if (!this.#playback.canChangeRate) return;
        this.#playback.setRate(Math.min(2, Math.max(0.25, rate)));
        this.#send('ratechange');
        this.#drawing.invalidate();
    }

    /** How long playback goes on with the frames that are decoded; Infinity if they are the last. */
    get secondsAhead(): number {
        return this.#error ? Infinity : this.#playback.usAhead / 1e6;
    }

    /** Null before the first frame is shown. */
    get view(): PlayerView | null {
        return this.#display.view;
    }
    set view(view: PlayerView) {
        this.#display.view = view;
    }

    /** What the stream's header says; null before loadedmetadata. */
    get sequence(): SequenceInfo | null {
        return this.#sequence;
    }

    get error(): PlayerErrorDetail | null {
        return this.#error;
    }

    /** Frames/s, Mbit/s and decoding times of the last 60 frames shown. */
    get statistics(): PlayerStatistics {
        const { wasmBytes, heldBytes } = this.#playback;
        return {
            ...this.#statistics.summary(), ...this.#display.held, framesShown: this.#shownFrames, wasmBytes, heldBytes,
            live: this.#playback.live, picturesAhead: this.#playback.picturesAhead, ladder: ladderNumbers(this.#playback),
        };
    }

    /**
     * For measuring: when the frames since the last call passed each stage. The hub tells what it knows of it where the address
     * ends in `?stamps`, and the publisher too.
     */
    stamps(): FrameStamps[] {
        return this.#stamps.collect();
    }

    play(): void {
        if (this.#wantsPlay || this.#error) return;
        this.#wantsPlay = true;
        this.#sound.allow();
        this.#playback.play();
        this.#send('play');
        this.#drawing.invalidate();
    }

    pause(): void {
        if (!this.#wantsPlay) return;
        this.#wantsPlay = false;
        this.#playback.pause();
        this.#send('pause');
        this.#drawing.invalidate();
    }

    /** To the next frame, or the one before (-1). Pauses. Resolves when it is shown. */
    async step(frames: 1 | -1 = 1): Promise<void> {
        this.pause();
        this.#playback.step(frames);
        this.#drawing.schedule();
        await this.#playback.idle();
        await this.#drawing.idle();
    }

    /** Resolves once nothing more happens until the clock advances: due frames are drawn, and the buffer is full. */
    async idle(): Promise<void> {
        for (;;) {
            await this.#playback.idle();
            await this.#drawing.idle();
            if (!this.#drawing.dirty && this.#playback.settled) return;
        }
    }

    /** The picture as it is, without the controls. */
    async screenshot(type = 'image/png'): Promise<Blob> {
        return this.#display.screenshot(type);
    }

    /** The view as at the beginning. */
    resetView(): void {
        this.#display.resetView();
    }

    /** The source of time. For tests; set it before `src`. */
    get clock(): Clock {
        return this.#drawing.clock;
    }
    set clock(clock: Clock) {
        this.#sound.clock = clock;
        this.#drawing.clock = clock;
    }

    // ---- the element's life ---------------------------------------------------------------------------------------

    connectedCallback(): void {
        this.#connected = true;
        if (!this.hasAttribute('role')) this.setAttribute('role', 'region');
        this.#describe();
        this.#applyTheme();
        this.#dark.addEventListener('change', this.#applyTheme);
        document.addEventListener('visibilitychange', this.#visibility);
        this.#display.follow(true);
        this.#controls.bar.hidden = !this.hasAttribute('controls');
        void vrIsPossible().then((possible) => possible && this.#controls.offerVr());
        if (this.src) this.#load();
    }

    disconnectedCallback(): void {
        this.#connected = false;
        this.#playback.close();
        this.#sound.close();
        this.#display.follow(false);
        this.#dark.removeEventListener('change', this.#applyTheme);
        document.removeEventListener('visibilitychange', this.#visibility);
        this.#drawing.cancel();
        this.#display.forget();
    }

    attributeChangedCallback(name: string, before: string | null, value: string | null): void {
        if (before === value) return;
        switch (name) {
            case 'src':
            case 'live':
            case 'audio':
                if (this.#connected) this.#load();
                break;
            case 'muted':
                this.muted = value !== null;
                break;
            case 'loop':
                this.#playback.setLoop(this.loop);
                this.#drawing.invalidate();
                break;
            case 'controls':
                this.#controls.bar.hidden = value === null;
                this.#display.look({ below: value === null ? 0 : 0.1 });
                break;
            case 'poster':
                if (value) this.#overlay.poster.src = value;
                this.#overlay.poster.hidden = !value || this.#shownFrames > 0;
                break;
            case 'lit':
                this.#display.look({ lit: this.lit });
                break;
            case 'up':
                this.#setUp();
                break;
            case 'theme':
                this.#applyTheme();
                break;
            case 'floor':
                this.#display.look({ floorVisible: value !== 'none' });
                break;
            case 'fixed':
                this.#display.look({ follows: !this.fixed });
                break;
            case 'orbit':
                this.#setFirstView();
                break;
            case 'statistics':
                this.#overlay.panel.hidden = value === null;
                this.#drawing.invalidate();
                break;
            case 'label':
                this.#describe();
                break;
        }
    }

    // The attribute says it, else the stream, else it is y.
    #setUp(): void {
        const given = this.getAttribute('up') ?? '';
        const { up = null, floor = null, metadata = {} } = this.#sequence ?? {};
        const axis = axes.includes(given) ? (given as Axis) : (up ?? 'y');
        this.#display.look({ up: { axis, floor: axis === up ? floor : null, front: frontOf(metadata) } });
    }

    #setFirstView(): void {
        const [yaw = 0, pitch = 7, distance] = (this.getAttribute('orbit') ?? '').split(/[\s,]+/).filter(Boolean).map(Number);
        this.#display.firstView = { yaw: yaw || 0, pitch: pitch || 0, distance: distance && distance > 0 ? distance : undefined };
        this.resetView();
    }

    #load(): void {
        this.#error = null;
        this.#overlay.clear();
        this.#overlay.poster.hidden = !this.hasAttribute('poster');
        this.#sequence = null;
        this.#shownFrames = 0;
        this.#display.forget();
        this.#sound.close();
        if (!this.src) {
            this.#playback.close();
            return;
        }
        this.#playback.setLoop(this.loop);
        const address = new URL(this.src, document.baseURI);
        this.#playback.open(address.href, (this.live && !address.pathname.endsWith('.m3u8')) || /^wss?:$/.test(address.protocol) ? 'live' : 'file');
        this.#sound.play((output) => this.#playback.makeSound(output));
        this.#stamps = new StampBook();
        this.#undrawn = null;
        const audio = this.getAttribute('audio');
        if (audio) void this.#sound.openFile(new URL(audio, document.baseURI).href);
        if (document.visibilityState === 'hidden') this.#playback.hide();
        const plays = this.autoplay || this.#wantsPlay;
        this.#wantsPlay = false;
        if (plays) this.play();
        this.#describe();
        this.#drawing.invalidate();
    }

    // ---- pictures -------------------------------------------------------------------------------------------------

    // What is due now.
    #tick(): FrameReport | null {
        const frame = document.visibilityState === 'hidden' ? null : this.#playback.tick();
        if (frame) this.#present(frame, this.clock.now());
        this.#sound.update(this.#playback.time);
        return frame;
    }

    #draw(now: number): void {
        const frame = this.#tick();
        const { spinner, unmute } = this.#overlay;
        this.#overlay.expire(now);
        unmute.hidden = !(this.#wantsPlay && this.#sound.blocked);
        spinner.hidden = this.#error !== null || this.src === '' || !this.#playback.stalled;
        this.classList.toggle('resting', this.#wantsPlay && now > this.#restAt && this.#shownFrames > 0);
        if (frame || this.#drawing.dirty) this.#display.render();
        if (this.#undrawn) this.#stamps.drawn(this.#undrawn);
        this.#undrawn = null;
        this.#tellState();
        if (!this.#controls.bar.hidden) this.#showControls();
    }

    #present(frame: FrameReport, now: number): void {
        const picture = this.#playback.takePicture();
        this.#display.setFrame(frame, picture, this.#playback.hasPicture);
        if (this.#shownFrames++ === 0) this.#overlay.poster.hidden = true;
        // By now the first ones were drawn, which takes longer than all later ones.
        if (this.#shownFrames === 3) this.#playback.joinAnew();
        this.#statistics.add(frame, now, picture);
        this.#undrawn = frame;
        const { panel } = this.#overlay;
        if (!panel.hidden) panel.textContent = this.#statistics.text(frame, this.#playback);
        const { frame: number, letter, timeUs, vertices, triangles, topology, preview } = frame;
        const digest = (): number => this.#display.digest(frame);
        const detail: FramePresentedDetail = {
            frame: number, letter, time: timeUs / 1e6, vertices, triangles, topology, preview, digest,
        };
        this.dispatchEvent(new CustomEvent('framepresented', { detail }));
        if (now - this.#lastTimeUpdate >= timeUpdateMs) {
            this.#lastTimeUpdate = now;
            this.#send('timeupdate');
        }
    }

    #showControls(): void {
        const { timeUs, durationUs, stalled, rate, canSeek, canChangeRate } = this.#playback;
        this.#controls.show({
            playing: this.#wantsPlay,
            waiting: stalled,
            timeUs,
            durationUs,
            loop: this.loop,
            lit: this.lit,
            statistics: !this.#overlay.panel.hidden,
            rate,
            canSeek,
            canChangeRate,
            fullscreen: this.#fullScreen.on,
            sound: !this.#sound.exists ? 'none' : this.muted || this.#sound.blocked ? 'off' : 'on',
        });
    }

    #viewChanged(): void {
        this.#drawing.invalidate();
        this.#send('viewchange');
    }

    #applyTheme = (): void => {
        const theme = this.getAttribute('theme');
        const dark = theme === 'dark' || (theme !== 'light' && this.#dark.matches);
        this.classList.toggle('dark', dark);
        this.#display.look({ dark });
    };

    #visibility = (): void => {
        if (document.visibilityState === 'hidden') this.#playback.hide();
        else this.#playback.show();
        this.#tick();
        this.#drawing.schedule();
    };

    // ---- words ----------------------------------------------------------------------------------------------------

    #describe(): void {
        const label = this.getAttribute('label') ?? 'Three-dimensional video of a person';
        if (!this.hasAttribute('aria-label')) this.setAttribute('aria-label', label);
        this.#display.canvas.setAttribute('aria-label', label);
    }

    // How the stream is, where there is something to say and that has changed.
    #tellState(): void {
        const detail = this.#error ? null : this.#playback.state;
        if (this.#overlay.state(detail)) this.dispatchEvent(new CustomEvent('livestate', { detail }));
    }

    #notice(text: string): void {
        this.#overlay.notice(text, this.clock.now());
        this.dispatchEvent(new CustomEvent('notice', { detail: text }));
        this.#drawing.invalidate();
    }

    #fail(detail: PlayerErrorDetail): void {
        this.#error = detail;
        this.#wantsPlay = false;
        this.#overlay.fail(detail.message);
        this.dispatchEvent(new CustomEvent('error', { detail }));
        this.#drawing.invalidate();
    }

    #send(name: string): void {
        this.dispatchEvent(new Event(name));
    }

    // ---- what people do -------------------------------------------------------------------------------------------

    #actions: ControlActions = {
        togglePlay: () => (this.paused ? this.play() : this.pause()),
        seek: (fraction) => {
            if (Number.isFinite(this.duration)) this.currentTime = fraction * this.duration;
        },
        toBeginning: () => (this.currentTime = 0),
        step: (frames) => void this.step(frames),
        setRate: (rate) => (this.playbackRate = rate),
        toggleMuted: () => {
            if (this.#sound.blocked) this.#sound.allow();
            else this.muted = !this.muted;
        },
        toggleLoop: () => (this.loop = !this.loop),
        toggleLit: () => (this.lit = !this.lit),
        toggleStatistics: () => this.toggleAttribute('statistics'),
        screenshot: () => void this.#savePicture(),
        toggleFullscreen: () => void this.#fullScreen.toggle(),
        enterVr: () => void this.#display.enterVr(() => this.#drawing.cancel(), () => this.#tick()),
    };

    #stir(): void {
        this.#restAt = this.clock.now() + restAfterMs;
        if (this.classList.contains('resting')) this.#drawing.invalidate();
    }

    #key(event: KeyboardEvent): void {
        if (event.altKey || event.ctrlKey || event.metaKey || !this.hasAttribute('controls')) return;
        const target = event.composedPath()[0];
        const inWidget = target instanceof HTMLButtonElement || target instanceof HTMLSelectElement;
        if (event.key === ' ' && inWidget) return;
        const acted = actOnKey(event, this.#actions, () => this.#fullScreen.leaveWindow());
        if (acted && event.key !== 'Escape') event.preventDefault();
    }

    async #savePicture(): Promise<void> {
        const address = URL.createObjectURL(await this.screenshot());
        const link = document.createElement('a');
        link.href = address;
        const name = new URL(this.src, document.baseURI).pathname.split('/').at(-1)?.replace(/\.\w+$/, '') || 'picture';
        link.download = `${name}-${this.currentTime.toFixed(2)}s.png`;
        link.click();
        setTimeout(() => URL.revokeObjectURL(address), 10000);
    }
}

for (const name of ['autoplay', 'loop', 'lit', 'live', 'fixed'])
    Object.defineProperty(HtvmPlayerElement.prototype, name, {
        get(this: HTMLElement): boolean {
            return this.hasAttribute(name);
        },
        set(this: HTMLElement, on: boolean) {
            this.toggleAttribute(name, on);
        },
        enumerable: true,
        configurable: true,
    });
