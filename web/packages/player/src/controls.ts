// The bar with the controls, and the keys that do the same.

export interface ControlActions {
    togglePlay(): void;
    seek(fraction: number): void;
    toBeginning(): void;
    step(frames: 1 | -1): void;
    setRate(rate: number): void;
    toggleMuted(): void;
    toggleLoop(): void;
    toggleLit(): void;
    toggleStatistics(): void;
    screenshot(): void;
    toggleFullscreen(): void;
    enterVr(): void;
}

export interface ControlState {
    playing: boolean;
    waiting: boolean;
    timeUs: number;
    durationUs: number | null;
    loop: boolean;
    lit: boolean;
    statistics: boolean;
    rate: number;
    /** Whether there are other places, and other rates, to go to. */
    canSeek: boolean;
    canChangeRate: boolean;
    fullscreen: boolean;
    sound: 'none' | 'off' | 'on';
}

export const rates = [0.25, 0.5, 0.75, 1, 1.25, 1.5, 2];

const icons = {
    play: 'M8 5.5v13l10.5-6.5z',
    pause: 'M7 5h3.5v14H7zM13.5 5H17v14h-3.5z',
    back: 'M6 5h2.5v14H6zM18 5.5v13L9.5 12z',
    forward: 'M15.5 5H18v14h-2.5zM6 5.5v13l8.5-6.5z',
    loop: 'M7 7h9V4l5 4.5-5 4.5v-3H9v4H6V8a1 1 0 0 1 1-1zm10 10H8v3l-5-4.5L8 11v3h7v-4h3v6a1 1 0 0 1-1 1z',
    light: 'M12 3a6 6 0 0 0-3.5 10.9V17h7v-3.1A6 6 0 0 0 12 3zM9 18.5h6V20H9zM10.5 21h3v1h-3z',
    statistics: 'M4 20V11h4v9zM10 20V4h4v16zM16 20v-6h4v6z',
    screenshot: 'M9 5 7.5 7H4v12h16V7h-3.5L15 5zm3 4a4 4 0 1 1 0 8 4 4 0 0 1 0-8z',
    fullscreen: 'M4 4h6v2H6v4H4zM14 4h6v6h-2V6h-4zM4 14h2v4h4v2H4zM18 14h2v6h-6v-2h4z',
    loud: 'M4 9h4l5-4v14l-5-4H4zM15 8.5a4.5 4.5 0 0 1 0 7v-2a2.6 2.6 0 0 0 0-3zM15 5a8 8 0 0 1 0 14v-2a6 6 0 0 0 0-10z',
    silent: 'M4 9h4l5-4v14l-5-4H4zM15.4 9 17.5 11.1 19.6 9 21 10.4 18.9 12.5 21 14.6 19.6 16 17.5 13.9 15.4 16 14 14.6 16.1 12.5 14 10.4z',
    vr: 'M3 7h18v10h-6l-2-3h-2l-2 3H3zm4.5 3a2 2 0 1 0 0 4 2 2 0 0 0 0-4zm9 0a2 2 0 1 0 0 4 2 2 0 0 0 0-4z',
};

/** Minutes and seconds: 1:02.5. */
export function timeText(us: number): string {
    const tenths = Math.floor(us / 1e5);
    const minutes = Math.floor(tenths / 600);
    const rest = tenths % 600;
    return `${minutes}:${String(Math.floor(rest / 10)).padStart(2, '0')}.${rest % 10}`;
}

function icon(path: string): SVGSVGElement {
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    svg.setAttribute('viewBox', '0 0 24 24');
    svg.setAttribute('aria-hidden', 'true');
    const shape = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    shape.setAttribute('d', path);
    svg.append(shape);
    return svg;
}

function setIcon(button: HTMLButtonElement, path: string): void {
    const shape = button.querySelector('path')!;
    if (shape.getAttribute('d') !== path) shape.setAttribute('d', path);
}

function setText(element: Element, text: string): void {
    if (element.textContent !== text) element.textContent = text;
}

export function make<Name extends keyof HTMLElementTagNameMap>(
    name: Name, part: string, attributes: Record<string, string> = {}): HTMLElementTagNameMap[Name] {
    const element = document.createElement(name);
    element.className = part;
    element.setAttribute('part', part);
    for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
    return element;
}

/** Does what a key is for; false where it is for nothing. `leave` leaves the whole window. */
export function actOnKey({ key }: KeyboardEvent, actions: ControlActions, leave: () => void): boolean {
    const keys: Record<string, () => void> = {
        ' ': actions.togglePlay,
        k: actions.togglePlay,
        ',': () => actions.step(-1),
        '.': () => actions.step(1),
        m: actions.toggleMuted,
        l: actions.toggleLoop,
        s: actions.toggleStatistics,
        f: actions.toggleFullscreen,
        Escape: leave,
        Home: actions.toBeginning,
    };
    const act = keys[key];
    act?.();
    return act !== undefined;
}

export class Controls {
    readonly bar = make('div', 'bar', { role: 'group', 'aria-label': 'Player controls' });
    #play: HTMLButtonElement;
    #back: HTMLButtonElement;
    #forward: HTMLButtonElement;
    #loud: HTMLButtonElement;
    #loop: HTMLButtonElement;
    #light: HTMLButtonElement;
    #statistics: HTMLButtonElement;
    #fullscreen: HTMLButtonElement;
    #vr: HTMLButtonElement;
    #time = make('span', 'time');
    #scrub = make('input', 'scrub', { type: 'range', min: '0', max: '1000', step: '1', 'aria-label': 'Position' });
    #rate = make('select', 'rate', { 'aria-label': 'Speed', title: 'Speed' });
    #scrubbing = false;

    constructor(actions: ControlActions) {
        const button = (name: keyof typeof icons, label: string, action: () => void): HTMLButtonElement => {
            const element = make('button', name, { type: 'button', 'aria-label': label, title: label });
            element.append(icon(icons[name]));
            element.addEventListener('click', action);
            return element;
        };
        this.#play = button('play', 'Play (Space)', actions.togglePlay);
        this.#back = button('back', 'One frame back (,)', () => actions.step(-1));
        this.#forward = button('forward', 'One frame on (.)', () => actions.step(1));
        this.#loud = button('loud', 'Sound (M)', actions.toggleMuted);
        this.#loud.hidden = true;
        this.#loop = button('loop', 'Play again and again (L)', actions.toggleLoop);
        this.#light = button('light', 'Light', actions.toggleLit);
        this.#statistics = button('statistics', 'Statistics (S)', actions.toggleStatistics);
        const screenshot = button('screenshot', 'Save a picture', actions.screenshot);
        this.#vr = button('vr', 'Enter VR', actions.enterVr);
        this.#fullscreen = button('fullscreen', 'Full screen (F)', actions.toggleFullscreen);
        this.#vr.hidden = true;
        for (const rate of rates) {
            const option = document.createElement('option');
            option.value = String(rate);
            option.textContent = `${rate}×`;
            this.#rate.append(option);
        }
        this.#rate.value = '1';
        this.#rate.addEventListener('change', () => actions.setRate(Number(this.#rate.value)));
        this.#scrub.addEventListener('input', () => actions.seek(Number(this.#scrub.value) / 1000));
        this.#scrub.addEventListener('pointerdown', () => (this.#scrubbing = true));
        for (const type of ['pointerup', 'pointercancel', 'change'])
            this.#scrub.addEventListener(type, () => (this.#scrubbing = false));
        this.bar.append(
            this.#play, this.#back, this.#forward, this.#time, this.#scrub, this.#loud, this.#rate, this.#loop,
            this.#light, this.#statistics, screenshot, this.#vr, this.#fullscreen);
    }

    offerVr(): void {
        this.#vr.hidden = false;
    }

    show(state: ControlState): void {
        const label = state.playing ? 'Pause (Space)' : 'Play (Space)';
        setIcon(this.#play, state.playing ? icons.pause : icons.play);
        if (this.#play.title !== label) {
            this.#play.title = label;
            this.#play.setAttribute('aria-label', label);
        }
        const known = state.durationUs !== null;
        setText(this.#time, known ? `${timeText(state.timeUs)} / ${timeText(state.durationUs!)}` : timeText(state.timeUs));
        this.#scrub.disabled = !known;
        if (known && !this.#scrubbing) {
            const value = String(Math.round((1000 * state.timeUs) / Math.max(state.durationUs!, 1)));
            if (this.#scrub.value !== value) {
                this.#scrub.value = value;
                this.#scrub.setAttribute('aria-valuetext', `${(state.timeUs / 1e6).toFixed(1)} of ${(state.durationUs! / 1e6).toFixed(1)} seconds`);
                this.#scrub.style.setProperty('--done', `${Number(value) / 10}%`);
            }
        }
        this.bar.classList.toggle('one-place', !state.canSeek);
        this.bar.classList.toggle('one-rate', !state.canChangeRate);
        const press = (button: HTMLButtonElement, on: boolean): void => {
            if (button.getAttribute('aria-pressed') !== String(on)) button.setAttribute('aria-pressed', String(on));
        };
        press(this.#loop, state.loop);
        press(this.#light, state.lit);
        press(this.#statistics, state.statistics);
        press(this.#fullscreen, state.fullscreen);
        press(this.#loud, state.sound === 'on');
        this.#loud.hidden = state.sound === 'none';
        setIcon(this.#loud, state.sound === 'on' ? icons.loud : icons.silent);
        const rate = String(state.rate);
        if (this.#rate.value !== rate && rates.includes(state.rate)) this.#rate.value = rate;
    }
}
