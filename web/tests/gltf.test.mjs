// What `htvm decode -o NAME.glb` writes, in three.js's own importer: HTVM names the program.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, readFile, readdir, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { AnimationMixer, Color, SRGBColorSpace, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';

const folder = fileURLToPath(new URL('../../tests/data/conformance/', import.meta.url));
const program = process.env.HTVM;
const options = { skip: program ? false : 'HTVM names no program', timeout: 60000 };

let work;

before(async () => {
    work = await mkdtemp(join(tmpdir(), 'htvm-gltf-'));
});

after(() => rm(work, { recursive: true }));

const run = (...words) => execFileSync(program, [...words, '--quiet'], { encoding: 'utf8' });

async function load(path) {
    const bytes = await readFile(path);
    return new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');
}

/** The rows of a PLY text's vertices that htvm decodes: positions in mm and, where it has them, levels of colours. */
async function readPly(path) {
    const bytes = await readFile(path);
    const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
    const header = bytes.subarray(0, end).toString();
    const properties = header.split('element face')[0].split('\n').filter((line) => line.startsWith('property'));
    const sizes = properties.map((line) => (line.includes('float') ? 4 : 1));
    const stride = sizes.reduce((sum, size) => sum + size);
    const colour = properties.findIndex((line) => line.endsWith(' red'));
    const colourAt = sizes.slice(0, colour).reduce((sum, size) => sum + size, 0);
    const count = Number(header.match(/element vertex (\d+)/)[1]);
    return Array.from({ length: count }, (_, vertex) => {
        const row = end + vertex * stride;
        return {
            position: [0, 4, 8].map((at) => bytes.readFloatLE(row + at)),
            colour: colour < 0 ? null : [...bytes.subarray(row + colourAt, row + colourAt + 3)],
        };
    });
}

/** The one mesh that is not shrunk to nothing. */
function shownMesh(scene) {
    scene.updateMatrixWorld(true);
    const shown = [];
    scene.traverse((object) => object.isMesh && object.matrixWorld.determinant() !== 0 && shown.push(object));
    assert.equal(shown.length, 1);
    return shown[0];
}

for (const stream of ['person', 'tracked']) {
    test(`three.js plays ${stream}.htvm as .glb: each frame at its time, with its vertices and colours`, options, async () => {
        const input = join(folder, `${stream}.htvm`), decoded = join(work, stream), file = join(work, `${stream}.glb`);
        run('decode', input, '-o', file);
        run('decode', input, '-o', `${decoded}/`, '--unit', 'mm');
        const { frames } = JSON.parse(run('info', input, '--json'));
        const plys = (await readdir(decoded)).sort();
        const { scene, animations } = await load(file);
        assert.equal(animations.length, 1);
        assert.equal(plys.length, frames.length);
        const mixer = new AnimationMixer(scene);
        mixer.clipAction(animations[0]).play();
        for (const [number, ply] of plys.entries()) {
            mixer.setTime((frames[number].timestamp_us - frames[0].timestamp_us) / 1e6 + 0.001);
            const mesh = shownMesh(scene);
            const expected = await readPly(join(decoded, ply));
            const { position, color } = mesh.geometry.attributes;
            assert.equal(position.count, expected.length);
            for (let vertex = 0; vertex < expected.length; ++vertex) {
                const place = new Vector3().fromBufferAttribute(position, vertex).applyMatrix4(mesh.matrixWorld);
                for (const [axis, mm] of expected[vertex].position.entries())
                    assert.ok(Math.abs(place.getComponent(axis) * 1000 - mm) < 0.001, `${ply}, vertex ${vertex}`);
                if (!expected[vertex].colour) continue;
                const shade = new Color().fromBufferAttribute(color, vertex).getHex(SRGBColorSpace);
                const [r, g, b] = expected[vertex].colour;
                assert.equal(shade, (r << 16) | (g << 8) | b, `${ply}, the colour of vertex ${vertex}`);
            }
        }
        assert.ok(animations[0].duration > frames.at(-1).timestamp_us / 1e6, 'the last frame is shown for a while too');
    });
}

test('a .glb of one frame has its mesh alone', options, async () => {
    run('decode', join(folder, 'person.htvm'), '-o', join(work, 'frames', '%d.glb'));
    const { scene, animations } = await load(join(work, 'frames', '0.glb'));
    assert.deepEqual(animations, []);
    assert.ok(shownMesh(scene).geometry.index.count > 0);
});
