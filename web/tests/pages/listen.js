// Listens to what a player plays, by the sound card's clock: `listen`. To be imported before there is any sound.
const listen = {
    context: null,
    /** Context times at which clicks left the player; they are heard `latency` later. */
    clicks: [],
    get latency() {
        return listen.context.outputLatency || listen.context.baseLatency || 0;
    },
    /** Context time, media time, and the time of the frame shown, of each picture. */
    pictures: [],

    /** Notes the times of a player's pictures from now on. */
    watch(player) {
        let frame = NaN;
        player.addEventListener('framepresented', ({ detail }) => (frame = detail.time));
        const note = () => {
            if (listen.context) listen.pictures.push({ context: listen.context.currentTime, media: player.currentTime, frame });
            requestAnimationFrame(() => setTimeout(note)); // after the player has drawn
        };
        note();
    },

    /** Once the sound card's time has advanced by so many seconds. */
    async for(seconds) {
        const end = listen.context.currentTime + seconds;
        while (listen.context.currentTime < end) await new Promise(requestAnimationFrame);
    },
};

globalThis.AudioContext = class extends AudioContext {
    #out = null;
    constructor(options) {
        super(options);
        listen.context = this;
        this.#out = new GainNode(this);
        this.#out.connect(super.destination);
        listen.ready = this.audioWorklet.addModule('/click_listener.js').then(() => {
            const listener = new AudioWorkletNode(this, 'click-listener');
            listener.port.onmessage = ({ data }) => listen.clicks.push(data);
            this.#out.connect(listener).connect(super.destination);
        });
    }
    get destination() {
        return this.#out ?? super.destination;
    }
};
globalThis.listen = listen;
