// What is seen: the canvas, and the scene drawn on it, with the camera that people move.
import type { Axis } from '@htvm/decoder';
import { make } from './controls.js';
import type { PlayerView } from './details.js';
import type { Direction } from './facing.js';
import { digestOf } from './frame_digest.js';
import type { FrameReport } from './messages.js';
import { Orbit } from './orbit.js';
import type { DecodedPicture } from './pictures.js';
import { StageScene } from './scene.js';
import { enterVr } from './vr.js';

/** How it is to look. */
export interface Look {
    lit: boolean;
    dark: boolean;
    floorVisible: boolean;
    /** Whether the view goes with a mesh that leaves its middle. */
    follows: boolean;
    /** Share of the picture's height that controls cover at the bottom. */
    below: number;
    /**
     * The stream's up axis, the floor's coordinate on it, millimetres, and the direction from which the subject is seen from
     * the front; null where nobody knows.
     */
    up: { axis: Axis; floor: number | null; front: Direction | null };
}

/** Degrees to the right and up, metres; undefined: as far away as shows the whole. */
export interface FirstView {
    yaw: number;
    pitch: number;
    distance: number | undefined;
}

export interface DisplayListener {
    /** It must be drawn again. */
    changed(): void;
    /** Somebody has moved the view. */
    moved(): void;
}

const radians = Math.PI / 180; // in a degree

export class Display {
    readonly canvas = make('canvas', 'canvas', { tabindex: '0', role: 'img' });
    firstView: FirstView = { yaw: 0, pitch: 7, distance: undefined };
    #host: HTMLElement;
    #listener: DisplayListener;
    #scene: StageScene | null = null;
    #orbit: Orbit | null = null;
    #look: Look = { lit: false, dark: false, floorVisible: true, follows: true, below: 0, up: { axis: 'y', floor: null, front: null } };
    #shows = false; // a frame of this stream
    #texcoords: Float32Array | null = null; // of the reference that is shown
    #reference = -1; // its topology
    #contextLost = false;
    #resized = new ResizeObserver(() => this.#resize());

    /** host: the element that it fills. */
    constructor(host: HTMLElement, listener: DisplayListener) {
        this.#host = host;
        this.#listener = listener;
        this.canvas.addEventListener('webglcontextlost', (event) => {
            event.preventDefault();
            this.#contextLost = true;
        });
    }

    /** restored: once the graphics card has lost all that it had, and takes it again. */
    onRestored(restored: () => void): void {
        this.canvas.addEventListener('webglcontextrestored', () => {
            this.#contextLost = false;
            this.#scene?.restore();
            restored();
            this.#listener.changed();
        });
    }

    /** Whether it keeps to its host's size. */
    follow(on: boolean): void {
        if (on) this.#resized.observe(this.#host);
        else this.#resized.disconnect();
    }

    /** Changes how it looks; what is not named stays. */
    look(change: Partial<Look>): void {
        Object.assign(this.#look, change);
        if (this.#scene) apply(change, this.#scene);
        this.#listener.changed();
    }

    // ---- frames -------------------------------------------------------------------------------------------------------

    /** Takes a frame, to be drawn by the next render(), and its picture, as StageScene.setFrame() does. */
    setFrame(frame: FrameReport, picture: DecodedPicture | null, hasPicture: boolean): void {
        const scene = this.#stage();
        scene.setFrame(frame, picture, hasPicture);
        if (frame.texcoords || frame.referenceTopology !== this.#reference) this.#texcoords = frame.texcoords;
        this.#reference = frame.referenceTopology;
        if (this.#shows) return;
        this.#shows = true;
        this.resetView();
        this.#orbit!.setReach(scene.view.distance);
    }

    render(): void {
        if (!this.#contextLost) this.#scene?.render();
    }

    /** For another stream. */
    forget(): void {
        this.#shows = false;
        this.#texcoords = null;
        this.#scene?.forget();
    }

    /** The next frame has its triangles with it. */
    forgetTopology(): void {
        this.#reference = -1;
        this.#scene?.mesh.forgetTopology();
    }

    digest(frame: FrameReport): number {
        return digestOf(frame, this.#stage().mesh.geometry, this.#texcoords);
    }

    async screenshot(type: string): Promise<Blob> {
        if (!this.#scene) throw new Error('there is no picture yet');
        this.#scene.render();
        return new Promise((resolve, reject) => {
            this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('there is no picture'))), type);
        });
    }

    /** What the graphics card holds, and how often triangles were sent to it. */
    get held(): { geometries: number; textures: number; indexUploads: number } {
        const { geometries, textures } = this.#scene?.renderer.info.memory ?? { geometries: 0, textures: 0 };
        return { geometries, textures, indexUploads: this.#scene?.mesh.uploads.indices ?? 0 };
    }

    // ---- the view -----------------------------------------------------------------------------------------------------

    /** Null before the first frame is shown. */
    get view(): PlayerView | null {
        if (!this.#scene) return null;
        const { yaw, pitch, distance, target } = this.#scene.view;
        return { yaw: yaw / radians, pitch: pitch / radians, distance, target: [target.x, target.y, target.z] };
    }
    set view({ yaw, pitch, distance, target }: PlayerView) {
        if (!this.#scene) return;
        Object.assign(this.#scene.view, { yaw: yaw * radians, pitch: pitch * radians, distance });
        this.#scene.view.target.set(...target);
        this.#listener.changed();
    }

    resetView(): void {
        const { yaw, pitch, distance } = this.firstView;
        this.#scene?.resetView(yaw * radians, pitch * radians, distance);
        this.#listener.moved();
    }

    /** Whether a headset calls for pictures. */
    get inVr(): boolean {
        return this.#scene?.renderer.xr.isPresenting === true;
    }

    async enterVr(begins: () => void, tick: () => void): Promise<void> {
        await enterVr(this.#stage(), { begins, tick, ends: () => this.#resize() });
    }

    // Created once there is something to draw: a page may have more players than a browser allows graphics contexts.
    #stage(): StageScene {
        if (this.#scene) return this.#scene;
        const scene = new StageScene(this.canvas);
        this.#orbit = new Orbit(this.canvas, scene.view, () => this.#listener.moved(), () => this.resetView());
        this.#scene = scene;
        apply(this.#look, scene);
        this.#resize();
        return scene;
    }

    #resize(): void {
        const { clientWidth, clientHeight } = this.#host;
        if (clientWidth === 0 || clientHeight === 0) return;
        this.#scene?.resize(clientWidth, clientHeight, devicePixelRatio);
        // At once: to change its size empties the canvas.
        if (this.#shows) this.render();
        this.#listener.changed();
    }
}

function apply({ lit, dark, floorVisible, follows, below, up }: Partial<Look>, scene: StageScene): void {
    if (lit !== undefined) scene.setLit(lit);
    if (dark !== undefined) scene.setTheme(dark);
    if (floorVisible !== undefined) scene.floorVisible = floorVisible;
    if (follows !== undefined) scene.follows = follows;
    if (below !== undefined) scene.below = below;
    if (up !== undefined) scene.setUp(up.axis, up.floor, up.front);
}
