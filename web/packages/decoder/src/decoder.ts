// The decoder: a WebAssembly module (the C interface of include/htvm/htvm.h) behind a typed interface.
import { constants, layouts, type Functions } from './layouts.js';

export type FrameKind = 'intra' | 'enhanced' | 'predicted' | 'tracked' | 'patched' | 'unknown';

/** What a failed call is about. `internal` and `trap` are faults of the decoder: please report them. */
export type ErrorCode = 'input' | 'corrupt' | 'unsupported' | 'limit' | 'memory' | 'internal' | 'trap';

export class DecoderError extends Error {
    override name = 'DecoderError';
    readonly code: ErrorCode;
    constructor(code: ErrorCode, message: string) {
        super(message);
        this.code = code;
    }
}

export interface DecoderOptions {
    /** Frames of more vertices or triangles are refused with `limit`, before memory is taken for them. */
    maxVertices?: number;
    maxTriangles?: number;
    /** Likewise packets of more bytes. */
    maxPacketBytes?: number;
    /** Bytes that one decoder may work with, 384 MB unless given, by a bound well above what frames take. The module's memory ends at 512 MB. */
    maxMemory?: number;
}

export type Axis = 'x' | '-x' | 'y' | '-y' | 'z' | '-z';
const axes: readonly (Axis | null)[] = [null, 'x', '-x', 'y', '-y', 'z', '-z']; // HTVM_UP_...

/** What a stream's header says. */
export interface SequenceInfo {
    joints: number;
    bones: number;
    /** False: one bone stands in for a skeleton that the capture does not have. */
    skeletonTracked: boolean;
    /** Frames a second; timestamps are what counts. */
    framesPerSecond: number;
    /** The unit that the capture came in. Decoded positions are in millimetres whatever it is. */
    unitMicrometres: number;
    /** Millimetres. */
    latticeStep: number;
    /** Where the subject's head is; null if the stream does not say. */
    up: Axis | null;
    /** The floor's coordinate on that axis, millimetres; null if the stream does not say. */
    floor: number | null;
    /** Texts by their keys: title, rights, front and others, if the stream has them. */
    metadata: Record<string, string>;
    /** Version of the stream. */
    streamVersion: number;
}

/**
 * A decoded frame. Its arrays are lent: they lie in the decoder's memory, and are valid until the next call on any
 * decoder of the module. Copy what must stay.
 */
export interface Frame {
    kind: FrameKind;
    /** As people write it: I, EP, P, T. */
    letter: string;
    /** Why an I- or TP-frame was sent, such as `due` or `region`; null where none is told. */
    reason: string | null;
    frame: number;
    reference: number;
    timestampUs: number;
    sourceVertices: number;
    sourceTriangles: number;
    vertices: number;
    triangles: number;
    /** Size of its packet. */
    bytes: number;
    /** Frames of one decoder with the same number have the same triangles and, but for `movingTexcoords`, texture coordinates. */
    topology: number;
    /**
     * Frames of one decoder with the same number have the same vertices at the same places, and, but for `movingTexcoords`,
     * the same texture coordinates.
     * Those that show a part of that mesh have topologies of their own: their triangles are those whose three vertices are there.
     */
    referenceTopology: number;
    concealed: boolean;
    /** Millimetres, 3 a vertex. */
    positions: Float32Array;
    /** 3 a triangle, counter-clockwise seen from outside. */
    indices: Uint32Array;
    /** Red, green, blue in sRGB, 3 a vertex. */
    colours: Uint8Array | null;
    /** 3 a vertex, unit length. */
    normals: Float32Array | null;
    /** 2 a vertex. */
    texcoords: Float32Array | null;
    /** Whether these are a camera's projection of the positions, and so others in each frame, whatever the topology. */
    movingTexcoords: boolean;
    /**
     * 1 a vertex: 1, or 0 where it is not there. No triangle names such a vertex, and its position is a guess at what nobody saw.
     * Null: all are there.
     */
    presence: Uint8Array | null;
}

/**
 * A place in a stream where decoding can start, once the sequence header is known, and the packets of the entries that
 * this one refers to.
 */
export interface IndexEntry {
    frame: number;
    timestampUs: number;
    /** Bytes from the start of the stream. */
    offset: number;
    /** How many entries before this one is the frame that it refers to; 0: it refers to nothing. */
    back: number;
    /** Those of its packet, as in `PacketHeader`; 0 where the index does not tell them. */
    flags: number;
}

type Layout = { readonly size: number; readonly fields: Readonly<Record<string, readonly [number, string]>> };
type Values<L extends Layout> = { [Field in keyof L['fields']]: number };

const errorCodes: Record<number, ErrorCode> = {
    [constants.HTVM_BAD_INPUT]: 'input',
    [constants.HTVM_CORRUPT_STREAM]: 'corrupt',
    [constants.HTVM_UNSUPPORTED]: 'unsupported',
    [constants.HTVM_LIMIT]: 'limit',
    [constants.HTVM_OUT_OF_MEMORY]: 'memory',
};

/** A compiled module with its memory. Decoders of one module share it. */
export class DecoderModule {
    /** The library's version, as text. */
    readonly version: string;
    /** Names of the layers of frames, as `Decoder.layerBytes` counts them. */
    readonly layerNames: readonly string[];
    #functions: Functions;
    #input = 0; // what is sent lies here
    #inputSize = 0;
    #stopped = false;

    private constructor(functions: Functions) {
        this.#functions = functions;
        functions._initialize();
        this.version = this.text(functions.htvm_version_string());
        const names: string[] = [];
        for (let layer = 0; layer < constants.HTVM_LAYERS; ++layer) names.push(this.text(functions.htvm_layer_name(layer)));
        this.layerNames = names;
    }

    /** From the bytes of htvm_decoder.wasm, a compiled module, or a response with them. */
    static async load(source: BufferSource | WebAssembly.Module | Response): Promise<DecoderModule> {
        let bytes: BufferSource | WebAssembly.Module;
        if (typeof Response !== 'undefined' && source instanceof Response) {
            if (!source.ok) throw new Error(`the decoder could not be loaded: ${source.status} ${source.url}`);
            const typed = source.headers.get('Content-Type') === 'application/wasm'; // else it is no stream of code
            bytes = typed ? await WebAssembly.compileStreaming(source) : await source.arrayBuffer();
        } else {
            bytes = source as BufferSource | WebAssembly.Module;
        }
        const module = bytes instanceof WebAssembly.Module ? bytes : await WebAssembly.compile(bytes);
        const instance = await WebAssembly.instantiate(module, {});
        return new DecoderModule(instance.exports as unknown as Functions);
    }

    /** How large the module's memory is; it only grows, up to 512 MB. */
    get memoryBytes(): number {
        return this.#functions.memory.buffer.byteLength;
    }

    createDecoder(options: DecoderOptions = {}): Decoder {
        return new Decoder(this, options);
    }

    /** What an index packet says. */
    readIndex(packet: Uint8Array): IndexEntry[] {
        const count = this.malloc(4);
        const address = this.place(packet);
        let entries = 0;
        try {
            let status = this.call('htvm_index_read', address, packet.length, 0, 0, count);
            if (status === constants.HTVM_OK) return [];
            if (status !== constants.HTVM_BUFFER_TOO_SMALL) throw this.error(status, 'the index is damaged');
            const number = this.view().getUint32(count, true);
            const layout = layouts.htvm_index_entry;
            entries = this.malloc(number * layout.size);
            status = this.call('htvm_index_read', address, packet.length, entries, number, count);
            if (status !== constants.HTVM_OK) throw this.error(status, 'the index is damaged');
            return Array.from({ length: number }, (_, i) => {
                const entry = this.read(entries + i * layout.size, layout);
                const { frame, timestamp_us: timestampUs, offset, back, flags } = entry;
                return { frame, timestampUs, offset, back, flags };
            });
        } finally {
            this.free(entries);
            this.free(count);
        }
    }

    // What follows is for Decoder.

    /** @internal */
    call<Name extends keyof Functions>(name: Name, ...values: (number | bigint)[]): number {
        if (this.#stopped) throw new DecoderError('trap', 'the decoder has stopped: load it anew');
        try {
            return (this.#functions[name] as (...values: (number | bigint)[]) => number)(...values);
        } catch (error) {
            this.#stopped = true;
            throw new DecoderError('trap', `the decoder has stopped, most likely for want of memory (${error})`);
        }
    }

    /** @internal Made anew for every use: memory may have grown. */
    view(): DataView {
        return new DataView(this.#functions.memory.buffer);
    }

    /** @internal */
    get buffer(): ArrayBuffer {
        return this.#functions.memory.buffer as ArrayBuffer;
    }

    /** @internal */
    malloc(bytes: number): number {
        const address = this.call('malloc', bytes);
        if (address === 0) throw new DecoderError('memory', 'the decoder has no memory left');
        return address;
    }

    /** @internal */
    free(address: number): void {
        if (address !== 0 && !this.#stopped) this.call('free', address);
    }

    /** @internal Copies bytes into the module; they stay until the next call. */
    place(bytes: Uint8Array): number {
        if (bytes.length > this.#inputSize) {
            this.free(this.#input);
            this.#input = 0;
            this.#inputSize = 0;
            const size = Math.max(bytes.length + (bytes.length >> 1), 1 << 16);
            this.#input = this.malloc(size);
            this.#inputSize = size;
        }
        new Uint8Array(this.buffer, this.#input, bytes.length).set(bytes);
        return this.#input;
    }

    /** @internal */
    read<L extends Layout>(address: number, layout: L): Values<L> {
        const view = this.view();
        const out: Record<string, number> = {};
        for (const [field, [offset, type]] of Object.entries(layout.fields)) out[field] = number(view, address + offset, type);
        return out as Values<L>;
    }

    /** @internal The text at an address, up to its closing 0. */
    text(address: number): string {
        if (address === 0) return '';
        const bytes = new Uint8Array(this.buffer, address);
        return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
    }

    /** @internal */
    error(status: number, message: string): DecoderError {
        return new DecoderError(errorCodes[status] ?? 'internal', message);
    }
}

function number(view: DataView, at: number, type: string): number {
    switch (type) {
        case 'int64_t':
            return Number(view.getBigInt64(at, true));
        case 'uint64_t':
            return Number(view.getBigUint64(at, true));
        case 'double':
            return view.getFloat64(at, true);
        case 'int32_t':
            return view.getInt32(at, true);
        default: // uint32_t, size_t, addresses
            return view.getUint32(at, true);
    }
}

// So much of metadata at most.
const mostKeyBytes = 255, mostValueBytes = 4095;

/** Takes packets or bytes, gives frames. Errors cost the packet that they are about: go on receiving. */
export class Decoder {
    #module: DecoderModule;
    #handle = 0;
    #scratch = 0; // room for any struct that the decoder fills

    /** @internal Use DecoderModule.createDecoder(). */
    constructor(module: DecoderModule, options: DecoderOptions) {
        this.#module = module;
        const layout = layouts.htvm_decoder_options;
        const { fields } = layout;
        const sizes = Object.values(layouts).map(({ size }) => size);
        this.#scratch = module.malloc(Math.max(...sizes, 8 * constants.HTVM_LAYERS));
        const place = module.malloc(layout.size + 8);
        module.call('htvm_decoder_options_init', place, layout.size);
        const view = module.view();
        if (options.maxVertices !== undefined) view.setUint32(place + fields.max_vertices[0], options.maxVertices, true);
        if (options.maxTriangles !== undefined) view.setUint32(place + fields.max_triangles[0], options.maxTriangles, true);
        view.setBigUint64(place + fields.max_packet_bytes[0], BigInt(options.maxPacketBytes ?? 1 << 26), true);
        view.setBigUint64(place + fields.max_memory[0], BigInt(options.maxMemory ?? 384 << 20), true);
        const handle = place + layout.size;
        const status = module.call('htvm_decoder_create', place, handle);
        this.#handle = module.view().getUint32(handle, true);
        module.free(place);
        if (status !== constants.HTVM_OK) throw module.error(status, 'the decoder could not be made');
    }

    /** Frees what it holds. It must not be used afterwards. */
    close(): void {
        if (this.#handle === 0) return;
        this.#module.free(this.#scratch);
        try {
            this.#module.call('htvm_decoder_destroy', this.#handle);
        } catch {
            // A module that has stopped is thrown away whole.
        }
        this.#handle = 0;
    }

    /** Sends one whole packet. Receive before the next. A decoder takes packets or bytes, not both. */
    sendPacket(packet: Uint8Array): void {
        this.#check(this.#module.call('htvm_decoder_send_packet', this.#handle, this.#module.place(packet), packet.length));
    }

    /** Sends the next piece, of any size, of a stream. Receive all frames after each call. */
    sendBytes(bytes: Uint8Array): void {
        this.#check(this.#module.call('htvm_decoder_send_bytes', this.#handle, this.#module.place(bytes), bytes.length));
    }

    /** The next frame, or null until more is sent. */
    receive(): Frame | null {
        const layout = layouts.htvm_frame_info;
        const status = this.#module.call('htvm_decoder_receive_frame', this.#handle, this.#scratch, layout.size);
        if (status === constants.HTVM_AGAIN) return null;
        this.#check(status);
        return this.#frame();
    }

    /** A stand-in for a frame that is missing: what is known, moved as it last moved. Null before any I-frame. */
    conceal(frame: number, timestampUs: number): Frame | null {
        const layout = layouts.htvm_frame_info;
        const status = this.#module.call(
            'htvm_decoder_conceal', this.#handle, frame, BigInt(timestampUs), this.#scratch, layout.size);
        if (status === constants.HTVM_AGAIN) return null;
        this.#check(status);
        return this.#frame();
    }

    /** Derives now what the next frame will need of the last one: for who has time between two frames. What was lent of
     *  the last frame ends. */
    prepare(): void {
        this.#check(this.#module.call('htvm_decoder_prepare', this.#handle));
    }

    /** How many levels of detail are shown of the frames to come, where a stream has any: fewer take less time. Frames then
     *  have another topology. */
    setDetailLevels(levels: number): void {
        this.#check(this.#module.call('htvm_decoder_set_detail_levels', this.#handle, levels));
    }

    /** Forgets what was sent and not received, as for a seek. */
    discard(): void {
        this.#check(this.#module.call('htvm_decoder_discard', this.#handle));
    }

    /** What the stream's header says; null until it was received. */
    sequence(): SequenceInfo | null {
        const layout = layouts.htvm_sequence_info;
        const status = this.#module.call('htvm_decoder_sequence', this.#handle, this.#scratch, layout.size);
        if (status === constants.HTVM_AGAIN) return null;
        this.#check(status);
        const info = this.#module.read(this.#scratch, layout);
        return {
            joints: info.joints,
            bones: info.bones,
            skeletonTracked: info.skeleton_tracked !== 0,
            framesPerSecond: info.fps_numerator / info.fps_denominator,
            unitMicrometres: info.unit_micrometres,
            latticeStep: info.lattice_step,
            up: axes[info.up] ?? null,
            floor: info.floor_known ? info.floor : null,
            metadata: this.#metadata(info.metadata),
            streamVersion: info.stream_version,
        };
    }

    /** Where the current frame's bytes went, in the order of `DecoderModule.layerNames`. */
    layerBytes(): number[] {
        this.#check(
            this.#module.call('htvm_decoder_layer_bytes', this.#handle, this.#scratch, constants.HTVM_LAYERS));
        const view = this.#module.view();
        return Array.from({ length: constants.HTVM_LAYERS }, (_, i) => Number(view.getBigUint64(this.#scratch + 8 * i, true)));
    }

    // The first of keys that are there twice.
    #metadata(entries: number): Record<string, string> {
        const out: Record<string, string> = Object.create(null);
        if (entries === 0) return out;
        const key = this.#module.malloc(mostKeyBytes + 1 + mostValueBytes + 1);
        const value = key + mostKeyBytes + 1;
        for (let entry = 0; entry < entries; ++entry) {
            this.#check(
                this.#module.call(
                    'htvm_decoder_metadata', this.#handle, entry, key, mostKeyBytes + 1, value, mostValueBytes + 1));
            out[this.#module.text(key)] ??= this.#module.text(value);
        }
        this.#module.free(key);
        return out;
    }

    #frame(): Frame {
        const module = this.#module;
        const info = module.read(this.#scratch, layouts.htvm_frame_info);
        const kind = module.text(module.call('htvm_frame_kind_name', info.type)) as FrameKind;
        const letter = module.text(module.call('htvm_frame_kind_letter', info.type));
        const reason =
            info.reason === constants.HTVM_REASON_NONE ? null : module.text(module.call('htvm_frame_reason_name', info.reason));
        this.#check(module.call('htvm_decoder_view', this.#handle, this.#scratch, layouts.htvm_mesh_view.size));
        const view = module.read(this.#scratch, layouts.htvm_mesh_view);
        const floats = (address: number, each: number): Float32Array =>
            address === 0 ? new Float32Array(0) : new Float32Array(module.buffer, address, each * view.vertices);
        return {
            kind,
            letter,
            reason,
            frame: info.frame,
            reference: info.reference,
            timestampUs: info.timestamp_us,
            sourceVertices: info.source_vertices,
            sourceTriangles: info.source_triangles,
            vertices: view.vertices,
            triangles: view.triangles,
            bytes: info.bytes,
            topology: view.topology,
            referenceTopology: info.reference_topology,
            concealed: info.concealed !== 0,
            positions: floats(view.positions, 3),
            indices:
                view.indices === 0 ? new Uint32Array(0) : new Uint32Array(module.buffer, view.indices, 3 * view.triangles),
            colours: view.colours === 0 ? null : new Uint8Array(module.buffer, view.colours, 3 * view.vertices),
            normals: view.normals === 0 ? null : floats(view.normals, 3),
            texcoords: view.texcoords === 0 ? null : floats(view.texcoords, 2),
            movingTexcoords: (info.attributes & constants.HTVM_MOVING_TEXCOORDS) !== 0,
            presence: view.presence === 0 ? null : new Uint8Array(module.buffer, view.presence, view.vertices),
        };
    }

    #check(status: number): void {
        if (status === constants.HTVM_OK) return;
        const said = this.#module.text(this.#module.call('htvm_decoder_last_error', this.#handle));
        throw this.#module.error(status, said || 'the decoder refused the call');
    }
}
