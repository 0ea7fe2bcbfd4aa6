// Frames that show a part of their mesh: what the worker sends of them, and what goes to the graphics card.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

/** A module of the packages' sources, with all that it imports. */
async function source(path) {
    const { outputFiles } = await build({
        entryPoints: [fileURLToPath(new URL(`../packages/${path}`, import.meta.url))],
        bundle: true, format: 'esm', write: false, logLevel: 'silent',
    });
    return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);
}

const { FrameSender } = await source('player/src/frame_sender.ts');
const { FrameQueue } = await source('player/src/frame_queue.ts');
const { HtvmMesh } = await source('three/src/htvm_mesh.ts');
const { facingOf, frontOf } = await source('player/src/facing.ts');

/** Four vertices, of which `presence` says what is there; the last is far away. */
function frame(topology, presence, referenceTopology = 1) {
    const triangles = [[0, 1, 2], [0, 2, 3]].filter((corners) => corners.every((v) => !presence || presence[v]));
    return {
        kind: 'tracked', letter: 'T', frame: 0, vertices: 4, triangles: triangles.length, bytes: 1, topology, referenceTopology,
        positions: Float32Array.from([0, 0, 0, 100, 0, 0, 0, 100, 0, 9000, 0, 5]),
        indices: Uint32Array.from(triangles.flat()), colours: null, normals: null,
        texcoords: Float32Array.from([0, 0, 1, 0, 0, 1, 1, 1]), presence: presence && Uint8Array.from(presence),
    };
}
const whole = () => frame(1, null), part = () => frame(2, [1, 1, 1, 0]);

function send(...frames) {
    const reports = [];
    const sender = new FrameSender((report) => reports.push(report));
    for (const one of frames) sender.send({ layerBytes: () => [] }, one, { serial: 1, preview: false });
    return reports;
}

test('the box is that of the vertices that are there', () => {
    const boxes = send(whole(), part()).map(({ bounds }) => bounds);
    assert.deepEqual(boxes, [[0, 0, 0, 9000, 100, 5], [0, 0, 0, 100, 100, 0]]);
});

test('normals are those of the triangles that are shown', () => {
    const [all, some] = send(whole(), part()).map(({ normals }) => [...normals]);
    assert.notDeepEqual(all.slice(0, 4), some.slice(0, 4)); // a vertex of both triangles
    assert.deepEqual(some.slice(0, 3), [0, 0, 127]);
});

test('triangles are sent for each topology, texture coordinates for each reference', () => {
    const reports = send(whole(), part(), part(), whole(), frame(3, null, 3));
    assert.deepEqual(reports.map(({ indices }) => indices?.length ?? null), [6, 3, null, 6, 6]);
    assert.deepEqual(reports.map(({ texcoords }) => texcoords !== null), [true, false, false, false, true]);
});

test('texture coordinates that move are sent and uploaded with each frame', () => {
    const moving = (at) => ({ ...part(), texcoords: Float32Array.from([0, 0, 1, 0, 0, 1, at, at]), movingTexcoords: true });
    const reports = send(moving(0.25), moving(0.5), moving(0.75));
    assert.deepEqual(reports.map(({ texcoords }) => texcoords?.[7]), [0.25, 0.5, 0.75]);
    assert.deepEqual(reports.map(({ indices }) => indices?.length ?? null), [3, null, null]);
    const mesh = new HtvmMesh();
    for (const report of reports) {
        mesh.setFrame(report);
        assert.equal(mesh.geometry.attributes.uv.array[7], report.texcoords[7]);
    }
    assert.equal(mesh.uploads.indices, 1);
});

test('a frame that is left out hands on the texture coordinates of the next, whose triangles are others', () => {
    const queue = new FrameQueue({ done() {}, pictureSettled() {}, notice() {} });
    for (const [at, report] of send(whole(), part()).entries()) {
        queue.arrived({ ...report, presentUs: at });
        queue.keep({ ...report, presentUs: at, picture: null });
    }
    const shown = queue.advance(1, { due() {}, passedOver() {}, isInTime: () => true });
    assert.equal(shown.topology, 2);
    assert.equal(shown.indices.length, 3);
    assert.equal(shown.texcoords.length, 8);
});

test('fewer triangles go into the buffers that are there, and texture coordinates stay', () => {
    const mesh = new HtvmMesh();
    mesh.setFrame(whole());
    const { index, attributes: { uv } } = mesh.geometry;
    const version = uv.version;
    let freed = 0;
    mesh.geometry.addEventListener('dispose', () => ++freed);
    mesh.setFrame({ ...part(), texcoords: null });
    assert.equal(mesh.geometry.index, index);
    assert.deepEqual(mesh.geometry.drawRange, { start: 0, count: 3 });
    assert.deepEqual([...index.array.subarray(0, 3)], [0, 1, 2]);
    assert.equal(mesh.geometry.attributes.uv, uv);
    assert.equal(uv.version, version);
    mesh.setFrame({ ...whole(), texcoords: null });
    assert.equal(mesh.geometry.drawRange.count, 6);
    assert.equal(freed, 0);
    assert.equal(mesh.uploads.indices, 3);
});

test('what is seen from one side faces there, and a closed surface nowhere', () => {
    const corners = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1];
    assert.deepEqual(facingOf(corners, [0, 1, 2]), [0, 0, 1]);
    assert.deepEqual(facingOf(corners, [0, 2, 1]), [0, 0, -1]);
    assert.equal(facingOf(corners, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]), null);
    assert.equal(facingOf(corners, []), null);
});

test('the front is three numbers of the metadata, and nothing else', () => {
    assert.deepEqual(frontOf({ front: '0 0 -2' }), [0, 0, -1]);
    assert.deepEqual(frontOf({ title: 'A walk', front: ' 0.6 0 0.8 ' }), [0.6, 0, 0.8]);
    for (const front of ['', '0 0', '0 0 0', '1 2 3 4', 'a b c', 'Infinity 0 0', '1,0,0'])
        assert.equal(frontOf({ front }), null, front);
    assert.equal(frontOf({}), null);
});
