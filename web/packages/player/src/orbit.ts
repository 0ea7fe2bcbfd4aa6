// Turns, moves and zooms the view by mouse, touch and keys.
import { Vector3 } from 'three';
import type { View } from './scene.js';

const mostPitch = Math.PI / 2 - 0.02;

export class Orbit {
    #element: HTMLElement;
    #view: View;
    #changed: () => void;
    #reset: () => void;
    #pointers = new Map<number, { x: number; y: number }>();
    #panning = false;
    #farthest = 100;
    #nearest = 0.01;

    constructor(element: HTMLElement, view: View, changed: () => void, reset: () => void) {
        this.#element = element;
        this.#view = view;
        this.#changed = changed;
        this.#reset = reset;
        element.addEventListener('pointerdown', this.#down);
        element.addEventListener('pointermove', this.#move);
        for (const type of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) element.addEventListener(type, this.#up);
        element.addEventListener('wheel', this.#wheel, { passive: false });
        element.addEventListener('dblclick', () => this.#reset());
        element.addEventListener('contextmenu', (event) => event.preventDefault());
        element.addEventListener('keydown', this.#key);
    }

    /** Around a distance from which the whole is seen. */
    setReach(distance: number): void {
        this.#nearest = distance / 30;
        this.#farthest = distance * 8;
    }

    turn(right: number, up: number): void {
        this.#view.yaw -= right;
        this.#view.pitch = Math.min(mostPitch, Math.max(-mostPitch, this.#view.pitch + up));
        this.#changed();
    }

    zoom(factor: number): void {
        this.#view.distance = Math.min(this.#farthest, Math.max(this.#nearest, this.#view.distance * factor));
        this.#changed();
    }

    /** By fractions of the picture's height. */
    pan(right: number, up: number): void {
        const { yaw, pitch, distance, target } = this.#view;
        const height = distance * 0.573; // of what is seen there, at a field of view of 32 degrees
        target.addScaledVector(new Vector3(Math.cos(yaw), 0, -Math.sin(yaw)), -right * height);
        const upwards = new Vector3(-Math.sin(yaw) * Math.sin(pitch), Math.cos(pitch), -Math.cos(yaw) * Math.sin(pitch));
        target.addScaledVector(upwards, up * height);
        this.#changed();
    }

    #down = (event: PointerEvent): void => {
        this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        this.#panning = event.button !== 0 || event.shiftKey || event.ctrlKey;
        try {
            this.#element.setPointerCapture(event.pointerId);
        } catch {
            // A pointer that is gone already.
        }
    };

    #up = (event: PointerEvent): void => {
        this.#pointers.delete(event.pointerId);
    };

    #move = (event: PointerEvent): void => {
        const last = this.#pointers.get(event.pointerId);
        if (!last) return;
        const height = this.#element.clientHeight || 1;
        const across = event.clientX - last.x;
        const down = event.clientY - last.y;
        if (this.#pointers.size === 2) {
            const other = [...this.#pointers].find(([id]) => id !== event.pointerId)![1];
            const before = Math.hypot(last.x - other.x, last.y - other.y);
            const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
            if (before > 0 && after > 0) this.zoom(before / after);
            this.pan(across / height / 2, down / height / 2);
        } else if (this.#panning) {
            this.pan(across / height, down / height);
        } else {
            this.turn((across / height) * Math.PI, (down / height) * Math.PI);
        }
        last.x = event.clientX;
        last.y = event.clientY;
    };

    #wheel = (event: WheelEvent): void => {
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 16 : 1;
        this.zoom(Math.exp(Math.min(100, Math.max(-100, event.deltaY * lines)) * 0.0016));
    };

    #key = (event: KeyboardEvent): void => {
        if (event.altKey || event.ctrlKey || event.metaKey) return;
        const amount = event.shiftKey ? 0.05 : 0.12;
        const actions: Record<string, () => void> = event.shiftKey
            ? {
                  ArrowLeft: () => this.pan(amount, 0),
                  ArrowRight: () => this.pan(-amount, 0),
                  ArrowUp: () => this.pan(0, amount),
                  ArrowDown: () => this.pan(0, -amount),
              }
            : {
                  ArrowLeft: () => this.turn(-amount, 0),
                  ArrowRight: () => this.turn(amount, 0),
                  ArrowUp: () => this.turn(0, amount),
                  ArrowDown: () => this.turn(0, -amount),
              };
        actions['+'] = actions['='] = () => this.zoom(0.9);
        actions['-'] = () => this.zoom(1 / 0.9);
        actions['0'] = () => this.#reset();
        const action = actions[event.key];
        if (!action) return;
        event.preventDefault();
        action();
    };
}
