// Texture pictures for tests, coded by the browser itself: each of four quarters, of one colour each.
const side = 128;

// Planes by BT.709.
function planes(colours, size, fullRange) {
    const half = size / 2;
    const luma = new Uint8Array(size * size);
    const blue = new Uint8Array(half * half);
    const red = new Uint8Array(half * half);
    const fill = (plane, width, value) => {
        for (let y = 0; y < width; ++y) for (let x = 0; x < width; ++x) plane[y * width + x] = value[(y < width / 2 ? 0 : 2) + (x < width / 2 ? 0 : 1)];
    };
    const of = (weights, least) => colours.map((colour) => Math.round(least + weights.reduce((sum, weight, i) => sum + weight * colour[i], 0) / 255));
    const [lumaSteps, chromaSteps] = fullRange ? [255, 255] : [219, 224];
    fill(luma, size, of([0.2126, 0.7152, 0.0722].map((weight) => weight * lumaSteps), fullRange ? 0 : 16));
    fill(blue, half, of([-0.2126 / 1.8556, -0.7152 / 1.8556, 0.5].map((weight) => weight * chromaSteps), 128));
    fill(red, half, of([0.5, -0.7152 / 1.5748, -0.0722 / 1.5748].map((weight) => weight * chromaSteps), 128));
    return new Uint8Array([...luma, ...blue, ...red]);
}

async function video(codec, pictures, { keys, size, bitrate, fullRange }) {
    const out = [];
    const encoder = new VideoEncoder({
        output: (chunk) => {
            const bytes = new Uint8Array(chunk.byteLength);
            chunk.copyTo(bytes);
            out.push({ key: chunk.type === 'key', bytes: [...bytes] });
        },
        error: (error) => {
            throw error;
        },
    });
    encoder.configure({ codec, width: size, height: size, bitrate, framerate: 30, latencyMode: 'realtime' });
    for (const [i, colours] of pictures.entries()) {
        const frame = new VideoFrame(planes(colours, size, fullRange), {
            format: 'I420', codedWidth: size, codedHeight: size, timestamp: i * 33333,
            colorSpace: { matrix: 'bt709', primaries: 'bt709', transfer: 'iec61966-2-1', fullRange },
        });
        encoder.encode(frame, { keyFrame: keys.includes(i) });
        frame.close();
    }
    await encoder.flush();
    encoder.close();
    return out;
}

async function images(type, pictures, size) {
    const canvas = new OffscreenCanvas(size, size);
    const context = canvas.getContext('2d');
    const out = [];
    for (const colours of pictures) {
        colours.forEach((colour, i) => {
            context.fillStyle = `rgb(${colour.join()})`;
            context.fillRect((i % 2) * size / 2, i < 2 ? 0 : size / 2, size / 2, size / 2);
        });
        const blob = await canvas.convertToBlob({ type, quality: 0.95 });
        out.push({ key: true, bytes: [...new Uint8Array(await blob.arrayBuffer())] });
    }
    return out;
}

/** pictures: for each the colours of its quarters, from the upper left one on, row by row. keys: places of key pictures. */
export function makePictures(coder, pictures, given = {}) {
    const options = { keys: [0], size: side, bitrate: 2e6, fullRange: true, ...given };
    if (coder === 'VP9') return video('vp09.00.10.08', pictures, options);
    if (coder === 'AV1') return video('av01.0.04M.08', pictures, options);
    return images(`image/${coder.toLowerCase()}`, pictures, options.size);
}

/** What a player shows at places of its picture, shares of its width and height. */
export async function coloursAt(player, places) {
    const image = await createImageBitmap(await player.screenshot());
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    return places.map(([x, y]) => [...context.getImageData(Math.floor(x * image.width), Math.floor(y * image.height), 1, 1).data].slice(0, 3));
}

/** Counts the pictures that the browser's decoder has given out and nobody has closed. */
export const openPictures = new Set();
const Real = globalThis.VideoDecoder;
globalThis.VideoDecoder = class extends Real {
    constructor({ output, error }) {
        super({
            output: (frame) => {
                openPictures.add(frame);
                ++openPictures.all;
                output(frame);
            },
            error,
        });
    }
};
openPictures.all = 0;
const close = VideoFrame.prototype.close;
VideoFrame.prototype.close = function () {
    openPictures.delete(this);
    close.call(this);
};
window.pictures = { makePictures, coloursAt, openPictures };
