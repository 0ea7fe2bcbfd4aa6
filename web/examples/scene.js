// A stream in a three.js scene of one's own, decoded on the main thread: for scenes that need one capture and no controls.
// With a bundler: esbuild scene.js --bundle --format=esm --outfile=out.js
import { loadDecoder, PacketSplitter } from '@htvm/decoder';
import { HtvmMesh } from '@htvm/three';
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';

/** Shows the stream at `url` again and again. `decoderUrl`: htvm_decoder.wasm. Gives the mesh. */
export async function showStream(canvas, url, decoderUrl) {
    const renderer = new WebGLRenderer({ canvas, antialias: true });
    const camera = new PerspectiveCamera(35, canvas.width / canvas.height, 0.1, 50);
    camera.position.set(0, 1.2, 4);
    const scene = new Scene();
    const mesh = new HtvmMesh();
    scene.add(mesh);

    const module = await loadDecoder(decoderUrl);
    const decoder = module.createDecoder();
    const splitter = new PacketSplitter();
    splitter.push(new Uint8Array(await (await fetch(url)).arrayBuffer()));
    const packets = [];
    for (let packet = splitter.next(); packet; packet = splitter.next()) packets.push(packet.bytes.slice());

    // Decodes up to the next frame; from the beginning again after the last.
    let next = 0;
    const nextFrame = () => {
        for (let tried = 0; tried < packets.length; ++tried) {
            decoder.sendPacket(packets[next]);
            next = (next + 1) % packets.length;
            const frame = decoder.receive();
            if (frame) return frame;
        }
        return null;
    };
    let frame = nextFrame();
    const begin = performance.now();
    let shown = -1;
    renderer.setAnimationLoop(() => {
        const due = Math.floor(((performance.now() - begin) / 1000) * (decoder.sequence()?.framesPerSecond ?? 30));
        for (; frame && shown < due; ++shown) {
            mesh.setFrame(frame);
            frame = nextFrame();
        }
        renderer.render(scene, camera);
    });
    return mesh;
}
