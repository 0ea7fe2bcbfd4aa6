// An element on the full screen, or where browsers have none for elements, as on some phones, over the whole window.

export class FullScreen {
    #element: HTMLElement;
    #changed: () => void;
    #wholeWindow = false;

    constructor(element: HTMLElement, changed: () => void) {
        this.#element = element;
        this.#changed = changed;
        element.addEventListener('fullscreenchange', changed);
    }

    get on(): boolean {
        return document.fullscreenElement === this.#element || this.#wholeWindow;
    }

    async toggle(): Promise<void> {
        if (document.fullscreenElement === this.#element) return document.exitFullscreen();
        if (this.#wholeWindow) return this.leaveWindow();
        try {
            await this.#element.requestFullscreen();
        } catch {
            this.#coverWindow(true);
        }
    }

    leaveWindow(): void {
        this.#coverWindow(false);
    }

    #coverWindow(on: boolean): void {
        this.#wholeWindow = on;
        this.#element.classList.toggle('whole-window', on);
        this.#changed();
    }
}
