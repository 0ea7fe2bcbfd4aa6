// One capture as an htvm stream in <htvm-player> and, as is done without it, as a Draco file a frame in three.js:
//
//   ?side=htvm or draco      only one of them, to be measured
//
// Beside this page lie person.htvm, draco.json (the number of frames a second, and the names of the Draco files) and three.js's
// decoder of Draco in draco/. ./dev draco-beside makes all that of a capture, and measures both.
import '@htvm/player';
import { Mesh, MeshBasicMaterial, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';

const ahead = 12; // frames fetched and decoded before they are due, as <htvm-player> does

/** Shows Draco files in a loop. Reports each frame: how long it took to decode, and Mbit/s at its size. */
export async function playDraco(canvas, { framesPerSecond, files }, shown) {
    const renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const camera = new PerspectiveCamera(32, 1, 0.01, 100);
    const scene = new Scene();
    const mesh = new Mesh(undefined, new MeshBasicMaterial({ vertexColors: true }));
    mesh.scale.setScalar(0.001);
    scene.add(mesh);
    const loader = new DRACOLoader().setDecoderPath('draco/').setWorkerLimit(1).preload();
    const load = async (number) => {
        const bytes = await (await fetch(files[number % files.length])).arrayBuffer();
        const size = bytes.byteLength;
        const begin = performance.now();
        const geometry = await new Promise((resolve, reject) => loader.parse(bytes, resolve, reject));
        return { geometry, size, decodeMs: performance.now() - begin };
    };
    const waiting = [];
    let next = 0;
    let tail = Promise.resolve(); // one after the other: each is measured by itself
    const more = () => {
        const number = next++;
        const frame = tail.then(() => load(number));
        tail = frame.catch(() => undefined);
        waiting.push(frame);
    };
    while (next < ahead) more();
    let begin = null;
    let number = 0;
    let ready = null;
    let fetching = false;
    renderer.setAnimationLoop(() => {
        const { clientWidth, clientHeight } = canvas;
        renderer.setSize(clientWidth, clientHeight, false);
        if (!ready && !fetching) {
            fetching = true;
            waiting.shift().then((frame) => {
                ready = frame;
                fetching = false;
                more();
            });
        }
        const due = begin === null || performance.now() - begin >= (1000 * number) / framesPerSecond;
        if (ready && due) {
            const { geometry, size, decodeMs } = ready;
            ready = null;
            mesh.geometry.dispose();
            mesh.geometry = geometry;
            mesh.material.vertexColors = geometry.hasAttribute('color');
            if (begin === null) {
                begin = performance.now();
                geometry.computeBoundingSphere();
                const { center, radius } = geometry.boundingSphere;
                const distance = (1.1 * radius * 0.001) / Math.sin((camera.fov * Math.PI) / 360);
                camera.position.set(center.x * 0.001, center.y * 0.001, center.z * 0.001 + distance);
            }
            ++number;
            shown({ decodeMs, megabitsPerSecond: (8e-6 * size * framesPerSecond) });
        }
        camera.aspect = clientWidth / Math.max(clientHeight, 1);
        camera.updateProjectionMatrix();
        renderer.render(scene, camera);
    });
}

// Measured over the last two seconds or so.
const mean = (frames, name) => frames.reduce((sum, frame) => sum + frame[name], 0) / frames.length;

const side = new URLSearchParams(location.search).get('side');
const start = performance.now();
const results = { htvm: [], draco: [] };
window.results = results;
window.firstFrame = {};
const note = (name, frame) => {
    if (results[name].length === 0) window.firstFrame[name] = performance.now() - start;
    results[name].push(frame);
    const last = results[name].slice(-60);
    document.getElementById(name).textContent =
        `${name}: ${mean(last, 'megabitsPerSecond').toFixed(1)} Mbit/s, decoding ${mean(last, 'decodeMs').toFixed(1)} ms a frame`;
};

if (side !== 'draco') {
    const player = document.querySelector('htvm-player');
    player.addEventListener('framepresented', () => {
        const { decodeMs, megabitsPerSecond } = player.statistics;
        note('htvm', { decodeMs, megabitsPerSecond });
    });
    player.src = 'person.htvm';
}
if (side !== 'htvm') {
    const canvas = document.querySelector('canvas');
    void playDraco(canvas, await (await fetch('draco.json')).json(), (frame) => note('draco', frame));
}
