// <htvm-player src="person.htvm" autoplay loop controls>: the element that pages use. docs/player.md is its manual.
import { crc32, type Axis, type SequenceInfo } from '@htvm/decoder';
import { browserClock, type Clock } from './clock.js';
import { Controls, make, styles, type ControlActions } from './controls.js';
import { StampBook, type FrameStamps } from './frame_stamps.js';
import type { FailureCode, FrameReport } from './messages.js';
import { Orbit } from './orbit.js';
import { Playback, type LiveNumbers } from './playback.js';
import { StageScene } from './scene.js';
import { Sound } from './sound.js';
import { Statistics, type StatisticsSummary } from './statistics.js';
import { startWorker } from './worker_start.js';

export interface FramePresentedDetail {
    frame: number;
    /** I, EP, P, T. */
    letter: string;
    /** Seconds; 0 is the stream's first frame. */
    time: number;
    vertices: number;
    triangles: number;
    topology: number;
    /** True while the frame that was sought is still being decoded, and one before it is shown. */
    preview: boolean;
    /** CRC-32 of what is shown: positions, triangles, colours, and the stream's own normals and texture coordinates. */
    digest(): number;
}

export interface PlayerStatistics extends StatisticsSummary {
    framesShown: number;
    /** Of the decoder's memory, which only grows, up to 512 MB. */
    wasmBytes: number;
    /** Of the file, kept for seeks and loops; at most 64 MB. */
    heldBytes: number;
    /** On the graphics card. */
    geometries: number;
    textures: number;
    /** How often triangles were sent to the graphics card: once for each topology. */
    indexUploads: number;
    /** Null for files. */
    live: LiveNumbers | null;
    /** Texture pictures decoded and not shown yet. */
    picturesAhead: number;
}

/** Where the camera is: turned about a point. Degrees to the right and up, metres. */
export interface PlayerView {
    yaw: number;
    pitch: number;
    distance: number;
    target: [number, number, number];
}

export interface PlayerErrorDetail {
    code: FailureCode;
    /** In words. */
    message: string;
}

const keepNoticeMs = 6000;
const restAfterMs = 2500;
const radians = Math.PI / 180; // in a degree
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

    #canvas = make('canvas', 'canvas', { tabindex: '0', role: 'img' });
    #poster = make('img', 'poster', { alt: '' });
    #spinner = make('div', 'spinner', { 'aria-hidden': 'true' });
    #notice = make('div', 'notice', { role: 'status' });
    #failure = make('div', 'failure', { role: 'alert' });
    #livestate = make('div', 'livestate', { role: 'status' });
    #description = make('div', 'description', { id: 'description' });
    #panel = make('pre', 'panel', { 'aria-hidden': 'true' });
    #unmute = make('button', 'unmute', { type: 'button' });
    #controls: Controls;
    #scene: StageScene | null = null;
    #orbit: Orbit | null = null;
    #playback: Playback;
    #sound: Sound;
    #statistics = new Statistics();
    #stamps = new StampBook();
    #undrawn: FrameReport | null = null;
    #liveText = '';
    #clock: Clock = browserClock;
    #request: number | null = null;
    #dirty = false;
    #sequence: SequenceInfo | null = null;
    #error: PlayerErrorDetail | null = null;
    #shownFrames = 0;
    #noticeUntil = 0;
    #restAt = 0;
    #lastTimeUpdate = 0;
    #texcoords: Float32Array | null = null; // of the topology that is shown
    #wantsPlay = false;
    #contextLost = false;
    #wholeWindow = false;
    #connected = false;
    #idleWaiting: (() => void)[] = [];
    #resized: ResizeObserver;
    #dark = matchMedia('(prefers-color-scheme: dark)');

    constructor() {
        super();
        const root = this.attachShadow({ mode: 'open', delegatesFocus: true });
        const sheet = new CSSStyleSheet();
        sheet.replaceSync(styles);
        root.adoptedStyleSheets = [sheet];
        this.#controls = new Controls(this.#actions);
        for (const part of [this.#notice, this.#failure, this.#panel, this.#spinner, this.#poster, this.#unmute, this.#livestate]) part.hidden = true;
        this.#unmute.textContent = 'Turn the sound on';
        this.#unmute.addEventListener('click', () => this.#sound.allow());
        this.#canvas.setAttribute('aria-describedby', 'description');
        root.append(this.#canvas, this.#poster, document.createElement('slot'), this.#panel, this.#spinner, this.#livestate, this.#notice, this.#failure, this.#unmute, this.#controls.bar, this.#description);
        this.#sound = new Sound({
            changed: () => this.#invalidate(),
            notice: (text) => this.#say(text),
        });
        this.#playback = new Playback(
            () => startWorker(new URL(HtvmPlayerElement.workerUrl, location.href)),
            new URL(HtvmPlayerElement.decoderUrl, location.href).href,
            () => this.#sound.now(),
            {
                opened: (sequence, layerNames) => {
                    this.#sequence = sequence;
                    this.#statistics.reset(layerNames);
                    this.#setUp();
                    this.#send('loadedmetadata');
                },
                extent: () => {
                    this.#send('durationchange');
                    this.#schedule();
                },
                arrived: (frame) => {
                    if (frame) this.#stamps.decoded(frame);
                    this.#schedule();
                },
                sound: (report) => this.#sound.take(report),
                jumped: () => this.#sound.jumped(),
                sought: () => this.#send('seeked'),
                waiting: () => this.#send('waiting'),
                ended: () => {
                    this.#wantsPlay = false;
                    this.#send('pause');
                    this.#send('ended');
                    this.#invalidate();
                },
                notice: (text) => this.#say(text),
                failed: (code, message) => this.#fail({ code, message }),
                restarted: () => this.#scene?.mesh.forgetTopology(),
                live: (report) => {
                    if (report.type === 'stamp') this.#stamps.message(report);
                    else this.#invalidate();
                },
            },
        );
        this.#resized = new ResizeObserver(() => this.#resize());
        this.addEventListener('keydown', (event) => this.#key(event));
        this.addEventListener('pointermove', () => this.#stir());
        this.addEventListener('focusin', () => this.#stir());
        this.#canvas.addEventListener('webglcontextlost', (event) => {
            event.preventDefault();
            this.#contextLost = true;
        });
        this.#canvas.addEventListener('webglcontextrestored', () => {
            this.#contextLost = false;
            this.#scene?.restore();
            if (this.#playback.hasPicture) this.#playback.showAgain();
            this.#invalidate();
        });
        this.addEventListener('fullscreenchange', () => this.#invalidate());
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

    /** Seconds; 0 is the first frame. Setting it seeks. Of a live stream the publisher's stream time, which cannot be set. */
    get currentTime(): number {
        return this.#playback.timeUs / 1e6;
    }
    set currentTime(seconds: number) {
        if (!Number.isFinite(seconds) || this.#playback.liveState) return;
        this.#send('seeking');
        this.#playback.seek(seconds * 1e6);
        this.#schedule();
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
        if (this.#playback.liveState) return;
        this.#playback.setRate(Math.min(2, Math.max(0.25, rate)));
        this.#send('ratechange');
        this.#invalidate();
    }

    /** How long playback goes on with the frames that are decoded; Infinity if they are the last. */
    get secondsAhead(): number {
        return this.#error ? Infinity : this.#playback.usAhead / 1e6;
    }

    /** Null before the first frame is shown. */
    get view(): PlayerView | null {
        if (!this.#scene) return null;
        const { yaw, pitch, distance, target } = this.#scene.view;
        return { yaw: yaw / radians, pitch: pitch / radians, distance, target: [target.x, target.y, target.z] };
    }
    set view(view: PlayerView) {
        if (!this.#scene) return;
        const { yaw, pitch, distance, target } = view;
        Object.assign(this.#scene.view, { yaw: yaw * radians, pitch: pitch * radians, distance });
        this.#scene.view.target.set(...target);
        this.#invalidate();
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
        const { geometries, textures } = this.#scene?.renderer.info.memory ?? { geometries: 0, textures: 0 };
        return {
            ...this.#statistics.summary(), framesShown: this.#shownFrames, wasmBytes, heldBytes, geometries, textures,
            indexUploads: this.#scene?.mesh.uploads.indices ?? 0, live: this.#playback.live,
            picturesAhead: this.#playback.picturesAhead,
        };
    }

    /**
     * For measuring: when the frames since the last call passed each stage. The hub tells what it knows of it where the address
     * ends in `?stamps`, and the publisher too.
     */
    stamps(): FrameStamps[] {
        return this.#stamps.take();
    }

    play(): void {
        if (this.#wantsPlay || this.#error) return;
        this.#wantsPlay = true;
        this.#sound.allow();
        this.#playback.play();
        this.#send('play');
        this.#invalidate();
    }

    pause(): void {
        if (!this.#wantsPlay) return;
        this.#wantsPlay = false;
        this.#playback.pause();
        this.#send('pause');
        this.#invalidate();
    }

    /** To the next frame, or the one before (-1). Pauses. Resolves when it is shown. */
    async step(frames: 1 | -1 = 1): Promise<void> {
        this.pause();
        this.#playback.step(frames);
        this.#schedule();
        await this.#playback.idle();
        await this.#drawn();
    }

    /** Resolves once nothing more happens until the clock advances: due frames are drawn, and the buffer is full. */
    async idle(): Promise<void> {
        for (;;) {
            await this.#playback.idle();
            await this.#drawn();
            if (!this.#dirty && this.#playback.settled) return;
        }
    }

    /** The picture as it is, without the controls. */
    async screenshot(type = 'image/png'): Promise<Blob> {
        if (!this.#scene) throw new Error('there is no picture yet');
        this.#scene.render();
        return new Promise((resolve, reject) => {
            this.#canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('there is no picture'))), type);
        });
    }

    /** The view as at the beginning. */
    resetView(): void {
        const [yaw = 0, pitch = 7, distance] = (this.getAttribute('orbit') ?? '').split(/[\s,]+/).filter(Boolean).map(Number);
        this.#scene?.resetView((yaw || 0) * radians, (pitch || 0) * radians, distance && distance > 0 ? distance : undefined);
        this.#viewChanged();
    }

    /** The source of time. For tests; set it before `src`. */
    get clock(): Clock {
        return this.#clock;
    }
    set clock(clock: Clock) {
        this.#cancelPicture();
        this.#clock = this.#sound.clock = clock;
        this.#schedule();
    }

    // ---- the element's life ---------------------------------------------------------------------------------------

    connectedCallback(): void {
        this.#connected = true;
        if (!this.hasAttribute('role')) this.setAttribute('role', 'region');
        this.#describe();
        this.#applyTheme();
        this.#dark.addEventListener('change', this.#applyTheme);
        document.addEventListener('visibilitychange', this.#visibility);
        this.#resized.observe(this);
        this.#controls.bar.hidden = !this.hasAttribute('controls');
        void this.#offerVr();
        if (this.src) this.#load();
    }

    disconnectedCallback(): void {
        this.#connected = false;
        this.#playback.close();
        this.#sound.close();
        this.#resized.disconnect();
        this.#dark.removeEventListener('change', this.#applyTheme);
        document.removeEventListener('visibilitychange', this.#visibility);
        this.#cancelPicture();
        this.#scene?.forget();
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
                this.#invalidate();
                break;
            case 'controls':
                this.#controls.bar.hidden = value === null;
                break;
            case 'poster':
                if (value) this.#poster.src = value;
                this.#poster.hidden = !value || this.#shownFrames > 0;
                break;
            case 'lit':
                this.#scene?.setLit(this.lit);
                this.#invalidate();
                break;
            case 'up':
                this.#setUp();
                break;
            case 'theme':
                this.#applyTheme();
                break;
            case 'floor':
                if (this.#scene) this.#scene.floorVisible = value !== 'none';
                this.#invalidate();
                break;
            case 'fixed':
                if (this.#scene) this.#scene.follows = !this.fixed;
                break;
            case 'orbit':
                this.resetView();
                break;
            case 'statistics':
                this.#panel.hidden = value === null;
                this.#invalidate();
                break;
            case 'label':
                this.#describe();
                break;
        }
    }

    // The attribute says it, else the stream, else it is y.
    #setUp(): void {
        const given = this.getAttribute('up') ?? '';
        const { up = null, floor = null } = this.#sequence ?? {};
        const axis = axes.includes(given) ? (given as Axis) : (up ?? 'y');
        this.#scene?.setUp(axis, axis === up ? floor : null);
    }

    #load(): void {
        this.#error = null;
        this.#failure.hidden = true;
        this.#notice.hidden = true;
        this.#livestate.hidden = true;
        this.#liveText = '';
        this.#sequence = null;
        this.#shownFrames = 0;
        this.#texcoords = null;
        this.#poster.hidden = !this.hasAttribute('poster');
        this.#scene?.forget();
        this.#sound.close();
        if (!this.src) {
            this.#playback.close();
            return;
        }
        this.#playback.setLoop(this.loop);
        const address = new URL(this.src, document.baseURI);
        const live = this.live || /^wss?:$/.test(address.protocol);
        this.#playback.open(address.href, live);
        const playback = this.#playback;
        this.#sound.live = live
            ? { presentUs: () => playback.presentUs, speed: () => playback.speed, ready: (ms, presentUs) => playback.soundReady(ms, presentUs) }
            : null;
        this.#stamps = new StampBook();
        this.#undrawn = null;
        const audio = this.getAttribute('audio');
        if (audio) void this.#sound.openFile(new URL(audio, document.baseURI).href);
        if (document.visibilityState === 'hidden') this.#playback.hide();
        const plays = this.autoplay || this.#wantsPlay;
        this.#wantsPlay = false;
        if (plays) this.play();
        this.#describe();
        this.#invalidate();
    }

    // Created once there is something to draw: a page may have more players than a browser allows graphics contexts.
    #stage(): StageScene {
        if (this.#scene) return this.#scene;
        const scene = new StageScene(this.#canvas);
        scene.setLit(this.lit);
        scene.follows = !this.fixed;
        scene.floorVisible = this.getAttribute('floor') !== 'none';
        scene.below = this.hasAttribute('controls') ? 0.1 : 0;
        this.#orbit = new Orbit(this.#canvas, scene.view, () => this.#viewChanged(), () => this.resetView());
        this.#scene = scene;
        this.#setUp();
        this.#applyTheme();
        this.#resize();
        return scene;
    }

    // ---- pictures -------------------------------------------------------------------------------------------------

    #invalidate(): void {
        this.#dirty = true;
        this.#schedule();
    }

    #schedule(): void {
        if (this.#request !== null || !this.#connected || this.#scene?.renderer.xr.isPresenting) return;
        if (!this.#dirty && !this.#playback.needsTicks) return;
        this.#request = this.#clock.request(() => {
            this.#request = null;
            this.#picture();
        });
    }

    #cancelPicture(): void {
        if (this.#request !== null) this.#clock.cancel(this.#request);
        this.#request = null;
    }

    // What is due now.
    #tick(): FrameReport | null {
        const now = this.#clock.now();
        const playback = this.#playback;
        const frame = document.visibilityState === 'hidden' ? null : playback.tick();
        if (frame) this.#present(frame, now);
        const { advances, presentUs, loopUs, durationUs, rate } = playback;
        this.#sound.update({ advances, presentUs, loopUs, durationUs, loop: this.loop, rate });
        return frame;
    }

    #picture(): void {
        const now = this.#clock.now();
        const frame = this.#tick();
        if (this.#noticeUntil > 0 && now > this.#noticeUntil) {
            this.#notice.hidden = true;
            this.#noticeUntil = 0;
        }
        this.#unmute.hidden = !(this.#wantsPlay && this.#sound.blocked);
        const loading = !this.#error && this.src !== '' && this.#playback.stalled;
        this.#spinner.hidden = !loading;
        const resting = this.#wantsPlay && now > this.#restAt;
        this.classList.toggle('resting', resting && this.#shownFrames > 0);
        if (this.#scene && !this.#contextLost && (frame || this.#dirty)) this.#scene.render();
        if (this.#undrawn) this.#stamps.drawn(this.#undrawn);
        this.#undrawn = null;
        this.#sayLive();
        if (!this.#controls.bar.hidden) this.#showControls();
        this.#dirty = false;
        for (const resolve of this.#idleWaiting.splice(0)) resolve();
        this.#schedule();
    }

    #drawn(): Promise<void> {
        if (!this.#dirty && !this.#playback.needsTicks) return Promise.resolve();
        return new Promise((resolve) => {
            this.#idleWaiting.push(resolve);
            this.#invalidate();
            // A manual clock draws only when it advances; what is due now is drawn now.
            if (this.#clock !== browserClock && this.#request !== null) {
                this.#cancelPicture();
                this.#picture();
            }
        });
    }

    #present(frame: FrameReport, now: number): void {
        const scene = this.#stage();
        const picture = this.#playback.takePicture();
        scene.setFrame(frame, picture, this.#playback.hasPicture);
        if (frame.indices) this.#texcoords = frame.texcoords;
        if (this.#shownFrames++ === 0) {
            this.#poster.hidden = true;
            this.resetView();
            this.#orbit?.setReach(scene.view.distance);
        }
        this.#statistics.add(frame, now, picture);
        if (frame.live) this.#undrawn = frame;
        if (!this.#panel.hidden) this.#panel.textContent = this.#statistics.text(frame, this.#playback.buffered, this.#playback.live);
        const { frame: number, letter, timeUs, vertices, triangles, topology, preview } = frame;
        const digest = (): number => this.#digest(frame);
        const detail: FramePresentedDetail = {
            frame: number, letter, time: timeUs / 1e6, vertices, triangles, topology, preview, digest,
        };
        this.dispatchEvent(new CustomEvent('framepresented', { detail }));
        if (now - this.#lastTimeUpdate >= 250) {
            this.#lastTimeUpdate = now;
            this.#send('timeupdate');
        }
    }

    // Of what the graphics card was given.
    #digest(frame: FrameReport): number {
        if (frame.buffer.byteLength === 0) throw new Error('this frame is not shown any more');
        const geometry = this.#scene!.mesh.geometry;
        const part = (array: ArrayBufferView, bytes: number): Uint8Array => new Uint8Array(array.buffer, array.byteOffset, bytes);
        const array = (name: string): ArrayBufferView => geometry.getAttribute(name).array as unknown as ArrayBufferView;
        let crc = crc32(part(array('position'), 12 * frame.vertices));
        if (geometry.index) crc = crc32(part(geometry.index.array as unknown as ArrayBufferView, 12 * frame.triangles), crc);
        if (frame.colours) {
            const padded = array('color') as Uint8Array;
            crc = crc32(Uint8Array.from({ length: 3 * frame.vertices }, (_, i) => padded[4 * Math.floor(i / 3) + (i % 3)]!), crc);
        }
        if (frame.streamNormals) crc = crc32(part(array('normal'), 12 * frame.vertices), crc);
        if (this.#texcoords) crc = crc32(part(this.#texcoords, this.#texcoords.byteLength), crc);
        return crc;
    }

    #showControls(): void {
        const { timeUs, durationUs, stalled, rate } = this.#playback;
        this.#controls.show({
            playing: this.#wantsPlay,
            waiting: stalled,
            timeUs,
            durationUs,
            loop: this.loop,
            lit: this.lit,
            statistics: !this.#panel.hidden,
            rate,
            fullscreen: this.#isFullscreen(),
            sound: !this.#sound.exists ? 'none' : this.muted || this.#sound.blocked ? 'off' : 'on',
        });
    }

    #viewChanged(): void {
        this.#invalidate();
        this.#send('viewchange');
    }

    #resize(): void {
        const { clientWidth, clientHeight } = this;
        if (clientWidth === 0 || clientHeight === 0) return;
        this.#scene?.resize(clientWidth, clientHeight, devicePixelRatio);
        // At once: to change its size empties the canvas.
        if (this.#scene && !this.#contextLost && this.#shownFrames > 0) this.#scene.render();
        this.#invalidate();
    }

    #applyTheme = (): void => {
        const theme = this.getAttribute('theme');
        const dark = theme === 'dark' || (theme !== 'light' && this.#dark.matches);
        this.classList.toggle('dark', dark);
        this.#scene?.setTheme(dark);
        this.#invalidate();
    };

    #visibility = (): void => {
        if (document.visibilityState === 'hidden') this.#playback.hide();
        else this.#playback.show();
        this.#tick();
        this.#schedule();
    };

    // ---- words ----------------------------------------------------------------------------------------------------

    #describe(): void {
        const label = this.getAttribute('label') ?? 'Three-dimensional video of a person';
        if (!this.hasAttribute('aria-label')) this.setAttribute('aria-label', label);
        this.#canvas.setAttribute('aria-label', label);
        this.#description.textContent =
            'Drag or use the arrow keys to turn the view, shift to move it, plus and minus to come nearer or go away, 0 to ' +
            'go back. Space plays and pauses, comma and full stop go by one frame.';
    }

    // How the live stream is, where that has changed.
    #sayLive(): void {
        const detail = this.#error ? null : this.#playback.liveState;
        this.#livestate.hidden = detail === null;
        if (!detail || detail.text === this.#liveText) return;
        this.#liveText = this.#livestate.textContent = detail.text;
        this.#livestate.className = `livestate ${detail.state}`;
        this.dispatchEvent(new CustomEvent('livestate', { detail }));
    }

    #say(text: string): void {
        this.#notice.textContent = text;
        this.#notice.hidden = false;
        this.#noticeUntil = this.#clock.now() + keepNoticeMs;
        this.dispatchEvent(new CustomEvent('notice', { detail: text }));
        this.#invalidate();
    }

    #fail(detail: PlayerErrorDetail): void {
        this.#error = detail;
        this.#wantsPlay = false;
        const box = document.createElement('div');
        const title = document.createElement('strong');
        title.textContent = 'This cannot be played';
        box.append(title, detail.message);
        this.#failure.replaceChildren(box);
        this.#failure.hidden = false;
        this.#poster.hidden = true;
        this.dispatchEvent(new CustomEvent('error', { detail }));
        this.#invalidate();
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
        toggleFullscreen: () => void this.#toggleFullscreen(),
        enterVr: () => void this.#enterVr(),
    };

    #stir(): void {
        this.#restAt = this.#clock.now() + restAfterMs;
        if (this.classList.contains('resting')) this.#invalidate();
    }

    #key(event: KeyboardEvent): void {
        if (event.altKey || event.ctrlKey || event.metaKey || !this.hasAttribute('controls')) return;
        const target = event.composedPath()[0];
        const inWidget = target instanceof HTMLButtonElement || target instanceof HTMLSelectElement;
        if (event.key === ' ' && inWidget) return;
        const { togglePlay, step, toggleMuted, toggleLoop, toggleStatistics, toggleFullscreen } = this.#actions;
        const keys: Record<string, () => void> = {
            ' ': togglePlay,
            k: togglePlay,
            ',': () => step(-1),
            '.': () => step(1),
            m: toggleMuted,
            l: toggleLoop,
            s: toggleStatistics,
            f: toggleFullscreen,
            Escape: () => this.#setWholeWindow(false),
            Home: () => (this.currentTime = 0),
        };
        const action = keys[event.key];
        if (!action) return;
        if (event.key !== 'Escape') event.preventDefault();
        action();
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

    #isFullscreen(): boolean {
        return document.fullscreenElement === this || this.#wholeWindow;
    }

    async #toggleFullscreen(): Promise<void> {
        if (document.fullscreenElement === this) return document.exitFullscreen();
        if (this.#wholeWindow) return this.#setWholeWindow(false);
        try {
            await this.requestFullscreen();
        } catch {
            this.#setWholeWindow(true);
        }
    }

    // For browsers without full screen for elements, as on some phones: covers the window.
    #setWholeWindow(on: boolean): void {
        this.#wholeWindow = on;
        this.classList.toggle('whole-window', on);
        this.#invalidate();
    }

    async #offerVr(): Promise<void> {
        try {
            if (await navigator.xr?.isSessionSupported('immersive-vr')) this.#controls.offerVr();
        } catch {
            // A page that may not ask has no VR.
        }
    }

    async #enterVr(): Promise<void> {
        const scene = this.#stage();
        const { xr } = scene.renderer;
        const session = await navigator.xr!.requestSession('immersive-vr', { optionalFeatures: ['local-floor'] });
        this.#cancelPicture();
        xr.enabled = true;
        await xr.setSession(session);
        scene.standBack(1.8);
        scene.renderer.setAnimationLoop(() => {
            this.#tick();
            scene.render();
        });
        session.addEventListener('end', () => {
            scene.renderer.setAnimationLoop(null);
            xr.enabled = false;
            scene.standBack(0);
            this.#resize();
        });
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
