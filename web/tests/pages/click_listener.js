// Tells the context's time of each click in what goes through: a loud sample after a tenth of a second of quiet ones.
class ClickListener extends AudioWorkletProcessor {
    #lastLoud = -1;

    process([input]) {
        const samples = input[0] ?? [];
        for (let i = 0; i < samples.length; ++i) {
            if (Math.abs(samples[i]) < 0.25) continue;
            const time = (currentFrame + i) / sampleRate;
            if (time - this.#lastLoud > 0.1) this.port.postMessage(time);
            this.#lastLoud = time;
        }
        return true;
    }
}
registerProcessor('click-listener', ClickListener);
