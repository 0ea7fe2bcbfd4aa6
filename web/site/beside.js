// Two streams in one window, in step and seen from the same place: left of the slider the first, right of it the second.

// Advances only as far as all players have frames, so that none has to wait and gets behind.
class CommonClock {
    players = [];
    #now = 0;
    #before = 0;
    #idle = true;
    #next = 1;
    #callbacks = new Map();

    now() {
        return this.#now;
    }

    request(callback) {
        if (this.#idle) this.#before = performance.now();
        this.#idle = false;
        if (this.#callbacks.size === 0) requestAnimationFrame(() => this.#picture());
        this.#callbacks.set(this.#next, callback);
        return this.#next++;
    }

    cancel(request) {
        this.#callbacks.delete(request);
    }

    #picture() {
        const real = performance.now();
        const longest = 100; // a hidden tab stands still
        const ahead = Math.min(...this.players.map(({ secondsAhead }) => 1000 * secondsAhead));
        const spare = 1; // at the end of the last frame the next would be missing
        this.#now += Math.max(0, Math.min(real - this.#before, longest, ahead - spare));
        this.#before = real;
        const due = [...this.#callbacks.values()];
        this.#callbacks.clear();
        for (const callback of due) callback();
        this.#idle = this.#callbacks.size === 0;
    }
}

function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
    element.append(...children);
    return element;
}

// The second player does what the first does.
function follow(first, second) {
    // Once this picture is drawn: the second may end with it.
    const again = () => queueMicrotask(() => {
        first.currentTime = 0;
        first.play();
        second.play();
    });
    first.addEventListener('play', () => second.play());
    first.addEventListener('pause', () => second.pause());
    first.addEventListener('ended', again);
    first.addEventListener('ratechange', () => (second.playbackRate = first.playbackRate));
    first.addEventListener('viewchange', () => first.view && (second.view = first.view));
    second.addEventListener('framepresented', () => first.view && (second.view = first.view), { once: true });
    // The time to seek to is known once the element has taken it.
    first.addEventListener('seeking', () => queueMicrotask(() => (second.currentTime = first.currentTime)));
    first.addEventListener('framepresented', ({ detail }) => {
        const stepped = first.paused && !detail.preview && Math.abs(second.currentTime - first.currentTime) > 0.001;
        if (stepped) second.currentTime = first.currentTime;
    });
    new MutationObserver(() => (second.lit = first.lit)).observe(first, { attributeFilter: ['lit'] });
}

function slider(around) {
    const split = make('div', {
        class: 'split', role: 'slider', tabindex: '0', 'aria-label': 'Where the second begins', 'aria-valuemin': '0', 'aria-valuemax': '100',
    });
    const place = (percent) => {
        const value = Math.min(100, Math.max(0, percent));
        around.style.setProperty('--split', `${value}%`);
        split.setAttribute('aria-valuenow', String(Math.round(value)));
    };
    split.addEventListener('pointerdown', (event) => split.setPointerCapture(event.pointerId));
    split.addEventListener('pointermove', (event) => {
        if (!split.hasPointerCapture(event.pointerId)) return;
        const { left, width } = around.getBoundingClientRect();
        place((100 * (event.clientX - left)) / width);
    });
    const steps = { ArrowLeft: -2, ArrowRight: 2, Home: -100, End: 100 };
    split.addEventListener('keydown', (event) => {
        if (!(event.key in steps)) return;
        event.preventDefault();
        event.stopPropagation(); // they are the player's keys too
        place(Number(split.getAttribute('aria-valuenow')) + steps[event.key]);
    });
    place(50);
    return split;
}

/** streams: the two, each with a name and an address. view: attributes of both players. */
export function playBeside(streams, view) {
    const clock = new CommonClock();
    const [first, second] = streams.map(({ name, address }) => make('htvm-player', { ...view, src: address, label: `${name}, a three-dimensional capture` }));
    for (const player of [first, second]) player.clock = clock;
    clock.players = [first, second];
    first.className = 'whole';
    first.setAttribute('controls', '');
    second.className = 'over';
    const names = streams.map(({ name }, i) => make('span', { class: i === 0 ? 'name' : 'name right' }, name));
    first.append(second, ...names, slider(first));
    follow(first, second);
    first.play();
    return make('div', { class: 'beside' }, first);
}
