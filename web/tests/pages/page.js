// What the tests call in the page: `test`. Players run on a clock that stands still until it is told.
import { HtvmPlayerElement, ManualClock } from '/player/htvm-player.js';

const clock = new ManualClock();
let player = null;

const test = {
    HtvmPlayerElement,
    clock,
    frames: [],
    events: [],
    notices: [],
    get player() {
        return player;
    },

    /** A new player with these attributes, in place of the one before. Its floor costs most of the drawing in software. */
    async open(given) {
        const attributes = { floor: 'none', ...given };
        player?.remove();
        player = document.createElement('htvm-player');
        player.clock = clock;
        test.frames = [];
        test.events = [];
        test.notices = [];
        player.addEventListener('framepresented', ({ detail }) => {
            const digest = detail.digest().toString(16).padStart(8, '0');
            const line = `${detail.frame} ${detail.letter[0]} ${detail.vertices} ${detail.triangles} ${digest}`;
            test.frames.push({ line, frame: detail.frame, time: detail.time, preview: detail.preview });
        });
        for (const name of ['loadedmetadata', 'play', 'pause', 'seeking', 'seeked', 'waiting', 'ended', 'error'])
            player.addEventListener(name, () => test.events.push(name));
        player.addEventListener('notice', ({ detail }) => test.notices.push(detail));
        for (const [name, value] of Object.entries(attributes)) player.setAttribute(name, value);
        document.body.append(player);
        await player.idle();
    },

    /** A new player that plays by the real time, in place of the one before: `window.player`. `window.shown` has its frames, `window.notices` what it says. */
    watch(src) {
        player?.remove();
        player = document.createElement('htvm-player');
        Object.assign(window, { player, shown: [], notices: [] });
        player.addEventListener('framepresented', ({ detail }) => window.shown.push({ frame: detail.frame, time: detail.time, preview: detail.preview }));
        player.addEventListener('notice', ({ detail }) => window.notices.push(detail));
        player.addEventListener('error', ({ detail }) => window.notices.push(detail.message));
        player.setAttribute('floor', 'none');
        player.src = src;
        player.muted = true;
        document.body.append(player);
        player.play();
    },

    /** Lets the clock run, a part of a frame at a time, until playback pauses or `milliseconds` are over. */
    async run(milliseconds = Infinity, step = 15) {
        for (let left = milliseconds; left > 0 && !player.paused; left -= step) {
            clock.advance(Math.min(step, left));
            await player.idle();
        }
    },

    /** The lines of all frames from the first to the last. */
    async playAll(attributes) {
        await test.open(attributes);
        player.play();
        await test.run();
        return test.frames.map(({ line }) => line);
    },

    async seek(seconds) {
        const before = test.frames.length;
        player.currentTime = seconds;
        await player.idle();
        return test.frames.slice(before);
    },

    setVisibility(state) {
        Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => state });
        document.dispatchEvent(new Event('visibilitychange'));
    },
};
window.test = test;
window.ready = true;
