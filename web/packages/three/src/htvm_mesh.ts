// Decoded frames as one three.js object, in one draw call.
import {
    BufferAttribute, BufferGeometry, DynamicDrawUsage, LinearFilter, Mesh, MeshBasicMaterial, NoColorSpace, Texture, Vector3,
} from 'three';
import type { Material, TypedArray } from 'three';

/** A frame to show: a `Frame` of `@htvm/decoder`, or arrays prepared by a player. */
export interface MeshFrame {
    vertices: number;
    triangles: number;
    /** Frames with the same number have the same triangles and texture coordinates: those are uploaded once. */
    topology: number;
    /** Frames with the same number have the same texture coordinates, which are uploaded once. Not given: the topology. */
    referenceTopology?: number;
    /** Millimetres, 3 a vertex. */
    positions: Float32Array;
    /** 3 a triangle. Null where the last frame shown had the same topology. */
    indices: Uint32Array | null;
    /** sRGB, 3 or 4 a vertex. */
    colours: Uint8Array | null;
    /** 3 a vertex, or of bytes 4 a vertex with 127 for 1. */
    normals: Float32Array | Int8Array | null;
    /** 2 a vertex. Null where there are none, and where the last frame shown had the same reference topology. */
    texcoords: Float32Array | null;
    /** Whether texture coordinates are others in each frame, whatever its topology: then they are uploaded with each. */
    movingTexcoords?: boolean;
}

/**
 * A mesh that shows one frame after the other. Arrays are copied, so that a frame may be lent. Buffers grow and stay:
 * nothing is allocated from frame to frame. Its unit is the metre (frames' is the millimetre).
 */
export class HtvmMesh extends Mesh<BufferGeometry, Material> {
    /** How often each array went to the graphics card. */
    readonly uploads = { positions: 0, indices: 0 };
    /** The picture of a textured stream, for materials that `pictured()` made. */
    readonly map = new PictureMap();
    #topology = -1;
    #reference = -1;

    /** The default material shows vertex colours as they are, unlit. */
    constructor(material: Material = srgbVertexColours(new MeshBasicMaterial({ vertexColors: true }))) {
        super(new BufferGeometry(), material);
        this.frustumCulled = false; // bounds would have to be found for every frame
        this.scale.setScalar(0.001);
        this.geometry.setDrawRange(0, 0);
    }

    setFrame(frame: MeshFrame): void {
        this.#set('position', frame.positions, 3, frame.vertices, false);
        if (frame.colours) {
            // Four bytes a vertex, since graphics cards want each to begin at a multiple of four.
            const padded = frame.colours.length === 3 * frame.vertices && frame.vertices > 0 ? 3 : 4;
            this.#set('color', frame.colours, 4, frame.vertices, true, padded);
        } else {
            this.#remove('color');
        }
        if (frame.normals) {
            const bytes = frame.normals instanceof Int8Array;
            this.#set('normal', frame.normals, bytes ? 4 : 3, frame.vertices, bytes);
        } else {
            this.#remove('normal');
        }
        ++this.uploads.positions;
        if (frame.topology !== this.#topology) {
            if (!frame.indices) throw new Error('a frame of another topology needs its indices');
            this.#topology = frame.topology;
            this.#set('index', frame.indices, 1, 3 * frame.triangles, false);
            this.geometry.setDrawRange(0, 3 * frame.triangles);
            ++this.uploads.indices;
        }
        const reference = frame.referenceTopology ?? frame.topology;
        if (reference !== this.#reference || (frame.movingTexcoords && frame.texcoords)) {
            this.#reference = reference;
            if (frame.texcoords) this.#set('uv', frame.texcoords, 2, frame.vertices, false);
            else this.#remove('uv');
        }
    }

    /** Uploads the next frame's triangles whatever its topology number is: for another decoder. */
    forgetTopology(): void {
        this.#topology = this.#reference = -1;
    }

    /** Frees what it holds on the graphics card. */
    override dispose(): void {
        this.geometry.dispose();
        this.map.dispose();
        this.material.dispose();
    }

    // Copies `count` elements into an attribute that has room for them; `given`: numbers each has in `values`.
    #set(name: string, values: TypedArray, itemSize: number, count: number, normalized: boolean, given = itemSize): void {
        const geometry = this.geometry;
        const old = name === 'index' ? geometry.index : (geometry.getAttribute(name) as BufferAttribute | undefined);
        let attribute = old;
        if (!attribute || attribute.count < count || attribute.array.constructor !== values.constructor) {
            // The graphics card's buffers cannot grow; these go, and all are uploaded anew.
            if (old) geometry.dispose();
            const room = old && old.count < count ? count + (count >> 2) : count;
            const array = new (values.constructor as new (length: number) => TypedArray)(Math.max(room, 1) * itemSize);
            attribute = new BufferAttribute(array, itemSize, normalized);
            attribute.setUsage(DynamicDrawUsage);
            if (name === 'index') geometry.setIndex(attribute);
            else geometry.setAttribute(name, attribute);
        }
        const array = attribute.array;
        if (given === itemSize) {
            array.set(values.subarray(0, count * itemSize) as never);
        } else {
            for (let v = 0; v < count; ++v) {
                for (let c = 0; c < given; ++c) array[itemSize * v + c] = values[given * v + c]!;
                array[itemSize * v + given] = 255;
            }
        }
        attribute.clearUpdateRanges();
        attribute.addUpdateRange(0, count * itemSize);
        attribute.needsUpdate = true;
    }

    #remove(name: string): void {
        if (!this.geometry.hasAttribute(name)) return;
        this.geometry.dispose();
        this.geometry.deleteAttribute(name);
    }
}

/**
 * The picture that is drawn on a mesh by its texture coordinates, of which (0, 0) is the picture's lower left corner. It is sRGB, as
 * vertex colours are, and its red, green and blue are multiplied by `gains`.
 */
export class PictureMap extends Texture {
    readonly gains = new Vector3(1, 1, 1);
    #side = [0, 0];

    constructor() {
        super();
        this.colorSpace = NoColorSpace; // the material does it, behind the gains
        this.generateMipmaps = false; // the material takes means by itself, within the charts of the picture
        this.minFilter = this.magFilter = LinearFilter;
        // Pictures go to the graphics card as they are, the upper row first.
        this.flipY = false;
        this.repeat.set(1, -1);
        this.offset.set(0, 1);
    }

    /**
     * Shows this picture from the next rendering on. A frame of a video may be closed behind that, or behind
     * `renderer.initTexture(map)`.
     */
    setPicture(image: VideoFrame | ImageBitmap | HTMLCanvasElement | OffscreenCanvas, gains: readonly [number, number, number] = [1, 1, 1]): void {
        const side = 'displayWidth' in image ? [image.displayWidth, image.displayHeight] : [image.width, image.height];
        if (this.#side[0] !== side[0] || this.#side[1] !== side[1]) this.dispose(); // its memory cannot grow
        this.#side = side as [number, number];
        this.image = image;
        this.gains.set(...gains);
        this.needsUpdate = true;
    }
}

// Seen from afar a pixel shows many texels, whose mean it takes: of some across and down, each between its nearest four. Not of
// more than the gutters between charts allow, four texels each way (docs/textures.md): beyond lie other charts' colours. Levels of half the size,
// as graphics cards make them, would mix charts from the third one on, and have to be made anew with each picture.
const meanOfTexels = `
    vec2 side = vec2(textureSize(map, 0));
    vec2 across = dFdx(vMapUv);
    vec2 down = dFdy(vMapUv);
    vec2 texels = vec2(length(across * side), length(down * side));
    int taps = int(clamp(ceil(max(texels.x, texels.y)), 1.0, 4.0));
    across *= min(1.0, 8.0 / max(texels.x, 1e-6));
    down *= min(1.0, 8.0 / max(texels.y, 1e-6));
    vec3 picture = vec3(0.0);
    for (int j = 0; j < taps; ++j)
        for (int i = 0; i < taps; ++i) {
            vec2 from = (vec2(i, j) + 0.5) / float(taps) - 0.5;
            picture += texture2D(map, vMapUv + from.x * across + from.y * down).rgb;
        }
    picture /= float(taps * taps);
`;

/** Makes a material show the picture instead of vertex colours. Only of a frame with texture coordinates. */
export function pictured<M extends Material & { map: Texture | null; vertexColors: boolean }>(material: M, map: PictureMap): M {
    material.map = map;
    material.vertexColors = false;
    material.onBeforeCompile = (shader) => {
        shader.uniforms['pictureGains'] = { value: map.gains };
        shader.fragmentShader = `uniform vec3 pictureGains;\n${shader.fragmentShader}`.replace(
            '#include <map_fragment>',
            `${meanOfTexels}
            picture = min(picture * pictureGains, vec3(1.0));
            diffuseColor.rgb *= mix(pow((picture + 0.055) / 1.055, vec3(2.4)), picture / 12.92, vec3(lessThanEqual(picture, vec3(0.04045))));`,
        );
    };
    material.customProgramCacheKey = () => 'htvm-picture';
    return material;
}

/**
 * Makes a material take vertex colours as sRGB, as captures have them; three.js takes them as linear. Only of a frame
 * with colours: without them set `vertexColors` to false.
 */
export function srgbVertexColours<M extends Material>(material: M): M {
    material.onBeforeCompile = (shader) => {
        // Where they are interpolated already: between the values that were captured, as other programs do.
        shader.fragmentShader = shader.fragmentShader.replace(
            '#include <color_fragment>',
            `#ifdef USE_COLOR_ALPHA
                diffuseColor.rgb *= mix(pow((vColor.rgb + 0.055) / 1.055, vec3(2.4)), vColor.rgb / 12.92,
                                        vec3(lessThanEqual(vColor.rgb, vec3(0.04045))));
            #endif`,
        );
    };
    material.customProgramCacheKey = () => 'htvm-srgb-vertex-colours';
    return material;
}
