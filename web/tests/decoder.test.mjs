// @htvm/decoder under Node.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { readdir } from 'node:fs/promises';
import { DecoderError, loadDecoder, packetKind, PacketSplitter, streamVersion } from '../packages/decoder/dist/node.js';
import { conformance, digests, folder, framesOf, frontIndexPacket, indexPacket, lineOf, packet, packetsOf } from './streams.mjs';

let module;
before(async () => {
    module = await loadDecoder();
});

const names = (await readdir(folder)).filter((file) => file.endsWith('.htvm')).map((file) => file.slice(0, -5));
for (const name of names)
    test(`${name}: every frame is the native decoder's`, async () => {
        const decoder = module.createDecoder();
        assert.deepEqual(framesOf(decoder, packetsOf(await conformance(name))), await digests(name));
        decoder.close();
    });

test('bytes in pieces of any size give the same frames as packets', async () => {
    const stream = await conformance('tracked');
    const decoder = module.createDecoder();
    const lines = [];
    for (let at = 0; at < stream.length; at += 777) {
        decoder.sendBytes(stream.subarray(at, at + 777));
        for (let frame = decoder.receive(); frame; frame = decoder.receive()) lines.push(lineOf(frame));
    }
    assert.deepEqual(lines, await digests('tracked'));
    decoder.close();
});

test('a frame says why it was sent', async () => {
    const decoder = module.createDecoder();
    decoder.sendBytes(await conformance('reasons_4'));
    const told = [];
    for (let frame = decoder.receive(); frame; frame = decoder.receive()) if (frame.letter !== 'T') told.push([frame.frame, frame.reason]);
    assert.deepEqual(told, [[0, null], [2, 'region'], [4, 'due'], [8, null]]);
    decoder.close();
});

test('the header, the layers and the index are told', async () => {
    const packets = packetsOf(await conformance('tracked'));
    const decoder = module.createDecoder();
    assert.equal(decoder.sequence(), null);
    decoder.sendPacket(packets[0].bytes);
    assert.equal(decoder.receive(), null);
    assert.equal(decoder.sequence().framesPerSecond, 30);
    decoder.sendPacket(packets[1].bytes);
    const { bytes, kind, letter } = decoder.receive();
    assert.deepEqual([kind, letter], ['intra', 'I']);
    const layers = decoder.layerBytes();
    assert.equal(layers.length, module.layerNames.length);
    assert.equal(layers.reduce((sum, size) => sum + size), bytes);
    assert.ok(layers[module.layerNames.indexOf('geometry')] > 100);
    decoder.close();
    const intra = packets.filter(({ kind }) => kind === packetKind.intra);
    const index = module.readIndex(packets.find(({ kind }) => kind === packetKind.index).bytes);
    assert.deepEqual(index, intra.map(({ frame, timestampUs, offset }) => ({ frame, timestampUs, offset, back: 0, flags: 0 })));
    assert.deepEqual(module.readIndex(indexPacket(7, index)), index);
    // Offsets in front count from the end of the index.
    const front = frontIndexPacket(7, index, 1e6);
    const shifted = (entries, by) => entries.map((entry) => ({ ...entry, offset: entry.offset + by, flags: 131 }));
    assert.deepEqual(module.readIndex(front), shifted(index, front.length));
    // They may refer to each other.
    const chain = index.map((entry, i) => ({ ...entry, back: i > 0 ? 1 : 0 }));
    const chained = frontIndexPacket(7, chain, 1e6);
    assert.deepEqual(module.readIndex(chained), shifted(chain, chained.length));
});

test('errors are told in words, by code, and cost one packet', async () => {
    const packets = packetsOf(await conformance('tracked'));
    const decoder = module.createDecoder();
    const codes = [];
    for (const bytes of [packets[1].bytes, new Uint8Array(5), packets[0].bytes, packets[1].bytes])
        try {
            decoder.sendPacket(bytes);
            codes.push(decoder.receive() ? 'frame' : 'none');
        } catch (error) {
            assert.ok(error instanceof DecoderError && error.message.length > 10);
            codes.push(error.code);
        }
    assert.deepEqual(codes, ['corrupt', 'corrupt', 'none', 'frame']);
    decoder.close();
    assert.throws(() => module.readIndex(packets[0].bytes), DecoderError);
});

test('limits are kept', async () => {
    const packets = packetsOf(await conformance('tracked'));
    const decoder = module.createDecoder({ maxVertices: 100 });
    decoder.sendPacket(packets[0].bytes);
    decoder.receive();
    decoder.sendPacket(packets[1].bytes);
    assert.throws(() => decoder.receive(), { code: 'limit' });
    decoder.close();
});

test('a decoder that is closed leaves its memory to the next', async () => {
    const packets = packetsOf(await conformance('person'));
    const sizes = [];
    for (let i = 0; i < 40; ++i) {
        const decoder = module.createDecoder();
        framesOf(decoder, packets);
        decoder.close();
        sizes.push(module.memoryBytes);
    }
    assert.equal(sizes.at(-1), sizes[9]);
});

test('the stream version is that of the sequence headers', async () => {
    const { bytes } = packetsOf(await conformance('tracked'))[0];
    assert.ok(streamVersion >= new DataView(bytes.buffer).getUint16(36, true));
});

test('packets are found again behind damage', async () => {
    const stream = new Uint8Array(await conformance('tracked'));
    const whole = packetsOf(stream);
    const damaged = stream.slice();
    damaged[whole[2].offset + 6] ^= 1; // a header
    damaged[whole[4].offset + 40] ^= 1; // a payload
    const splitter = new PacketSplitter();
    const found = [];
    for (let at = 0; at < damaged.length; at += 100) {
        splitter.push(damaged.subarray(at, at + 100));
        for (let next = splitter.next(); next; next = splitter.next()) found.push(next.offset);
    }
    assert.deepEqual(found, whole.filter((_, i) => i !== 2 && i !== 4).map(({ offset }) => offset));
    assert.equal(splitter.damagedBytes, whole[2].size + whole[4].size);
    assert.equal(splitter.pendingBytes, 0);
});

test('a packet that claims more than is allowed is damage, and takes no memory', () => {
    const splitter = new PacketSplitter(0, 1000);
    splitter.push(packet(2, new Uint8Array(2000)));
    splitter.push(packet(2, new Uint8Array(100)));
    assert.equal(splitter.next().size, 136);
    assert.equal(splitter.damagedBytes, 2036);
});
