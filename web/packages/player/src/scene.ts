// Draws the mesh, upright and in metres, on a floor with a grid and a contact shadow.
import { HtvmMesh, pictured, srgbVertexColours } from '@htvm/three';
import {
    Box3, Color, DirectionalLight, Group, HemisphereLight, LinearFilter, Mesh, MeshBasicMaterial, MeshLambertMaterial,
    NoBlending, OrthographicCamera, PerspectiveCamera, PlaneGeometry, Quaternion, Scene, ShaderMaterial, Vector3,
    WebGLRenderer, WebGLRenderTarget,
} from 'three';
import type { Material } from 'three';
import type { Axis } from '@htvm/decoder';
import { type Direction, facingOf } from './facing.js';
import type { FrameReport } from './messages.js';
import type { DecodedPicture } from './pictures.js';

const axes: Record<Axis, [number, number, number]> = {
    x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1], '-x': [-1, 0, 0], '-y': [0, -1, 0], '-z': [0, 0, -1],
};

/** Where the camera is: turned about a point. Angles in radians, lengths in metres. */
export interface View {
    yaw: number;
    pitch: number;
    distance: number;
    target: Vector3;
}

// How far from the middle of the view the mesh may go before the view goes with it: of the radius of what is seen.
const leash = 0.3;
const gridCells = 24;

const shadowPixels = 128; // it is blurred anyway, and weak graphics cards have to draw it too
const blurReach = 6; // pixels

export class StageScene {
    readonly renderer: WebGLRenderer;
    readonly mesh = new HtvmMesh();
    readonly camera = new PerspectiveCamera(32, 1, 0.01, 100);
    readonly view: View = { yaw: 0, pitch: 0.12, distance: 3, target: new Vector3(0, 0.9, 0) };
    /** Whether the grid and the shadow are drawn. */
    floorVisible = true;
    /** Share of the picture's height that controls cover at the bottom. */
    below = 0;
    lit = false;
    /** Whether the view goes with a mesh that leaves its middle. */
    follows = true;
    #scene = new Scene();
    #stage = new Group(); // stands on the floor, its middle above the origin
    #upright = new Group(); // turns the stream's up axis to y
    #grid: Mesh<PlaneGeometry, ShaderMaterial>;
    #shadow: ContactShadow;
    #unlitMaterial = this.mesh.material;
    #litMaterial: Material = srgbVertexColours(new MeshLambertMaterial({ vertexColors: true }));
    #unlitPicture: Material = pictured(new MeshBasicMaterial(), this.mesh.map);
    #litPicture: Material = pictured(new MeshLambertMaterial(), this.mesh.map);
    #hasPicture = false; // on the graphics card
    #pictureReference = -1; // reference topology of the mesh that it was shown on
    #pictured = false; // whether the frame shows it
    #coloured = true;
    #clayMaterial: Material = new MeshLambertMaterial({ color: 0xb9b2a8 });
    #bounds: Box3 | null = null; // of the first frame, upright, metres, not yet moved onto the floor
    #floor: number | null = null; // height of the floor in the upright mesh, metres
    #home: { distance: number; target: Vector3 } | null = null;
    #front: Direction | null = null; // from where the subject is seen from the front, as the stream says it
    #facing = 0; // radians, from there, or from where the first frame's surface is seen, if it faces one way
    #followed = new Vector3(); // how far the view has gone with the mesh, along the floor
    #leash = 0; // metres
    #shadowIsOld = true;

    constructor(canvas: HTMLCanvasElement) {
        this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: 'high-performance' });
        this.renderer.setClearColor(0, 0);
        this.#upright.add(this.mesh);
        this.#stage.add(this.#upright);
        this.#grid = gridPlane();
        this.#shadow = new ContactShadow(this.mesh);
        const sun = new DirectionalLight(0xffffff, 2.2);
        sun.position.set(1.2, 2.5, 2);
        this.#scene.add(this.#stage, this.#grid, this.#shadow.plane, new HemisphereLight(0xffffff, 0x8a8178, 1.6), sun);
        this.#grid.visible = this.#shadow.plane.visible = false;
    }

    dispose(): void {
        this.mesh.dispose();
        for (const material of [this.#unlitMaterial, this.#litMaterial, this.#clayMaterial, this.#unlitPicture, this.#litPicture])
            material.dispose();
        this.#grid.geometry.dispose();
        this.#grid.material.dispose();
        this.#shadow.dispose();
        this.renderer.dispose();
    }

    /**
     * floor: its coordinate on the axis of the stream that `axis` names, millimetres; null: below the first frame. front: the
     * direction in the stream from which the subject is seen from the front; null: as the first frame faces.
     */
    setUp(axis: Axis, floor: number | null = null, front: Direction | null = null): void {
        this.#front = front;
        this.#floor = floor === null ? null : ((axis.startsWith('-') ? -1 : 1) * floor) / 1000;
        const up = new Vector3(...axes[axis]);
        this.#upright.quaternion.copy(new Quaternion().setFromUnitVectors(up, new Vector3(0, 1, 0)));
        this.#bounds = null;
    }

    setTheme(dark: boolean): void {
        this.#grid.material.uniforms['colour']!.value = new Color(dark ? 0xaab4c4 : 0x55606e);
        this.#shadow.setStrength(dark ? 0.8 : 0.62);
    }

    /** For another stream: shows nothing, and places its first frame anew. */
    forget(): void {
        this.#bounds = null;
        this.#home = null;
        this.#hasPicture = this.#pictured = false;
        this.mesh.forgetTopology();
        this.mesh.geometry.setDrawRange(0, 0);
        this.#grid.visible = this.#shadow.plane.visible = false;
    }

    /**
     * picture: that of the frame, which is closed here; null where it is the one before. hasPicture: whether it has one; where it
     * is missing, the last one stays on its mesh.
     */
    setFrame(frame: FrameReport, picture: DecodedPicture | null = null, hasPicture = false): void {
        this.mesh.setFrame(frame);
        if (picture) {
            this.mesh.map.setPicture(picture.image, picture.gains);
            this.renderer.initTexture(this.mesh.map);
            picture.image.close();
        }
        if (picture) this.#hasPicture = true;
        if (hasPicture) this.#pictureReference = frame.referenceTopology;
        const stays = hasPicture || (frame.picture != null && frame.referenceTopology === this.#pictureReference);
        this.#pictured = this.#hasPicture && stays && this.mesh.geometry.hasAttribute('uv');
        this.#coloured = frame.colours !== null;
        this.#chooseMaterial();
        if (frame.bounds[0] <= frame.bounds[3]) {
            const box = this.#uprightBox(frame.bounds);
            if (!this.#bounds) {
                this.#findFacing(frame);
                this.#standOnFloor(box);
            }
            this.#shadow.moveOver(box.translate(this.#stage.position), this.#upright.quaternion, this.#stage.position);
            this.#follow(box.getCenter(new Vector3()));
        }
        this.#shadowIsOld = true;
    }

    setLit(lit: boolean): void {
        this.lit = lit;
        this.#chooseMaterial();
    }

    #chooseMaterial(): void {
        if (this.#pictured) this.mesh.material = this.lit ? this.#litPicture : this.#unlitPicture;
        else if (this.#coloured) this.mesh.material = this.lit ? this.#litMaterial : this.#unlitMaterial;
        else this.mesh.material = this.#clayMaterial;
    }

    /** Back to where the whole is seen, turned as given from its front. */
    resetView(yaw = 0, pitch = 0.12, distance?: number): void {
        this.view.yaw = this.#facing + yaw;
        this.view.pitch = pitch;
        if (this.#home) {
            this.view.distance = distance ?? this.#home.distance;
            this.view.target.copy(this.#home.target);
        }
    }

    /** Size of the picture, CSS pixels. */
    resize(width: number, height: number, pixelRatio: number): void {
        this.renderer.setPixelRatio(Math.min(pixelRatio, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / Math.max(height, 1);
        this.camera.updateProjectionMatrix();
    }

    render(): void {
        const { yaw, pitch, distance, target } = this.view;
        if (!this.renderer.xr.isPresenting) {
            const across = Math.cos(pitch) * distance;
            this.camera.position.set(Math.sin(yaw) * across, Math.sin(pitch) * distance, Math.cos(yaw) * across).add(target);
            this.camera.lookAt(target);
            this.camera.near = distance / 100;
            this.camera.far = distance * 20 + 10;
            this.camera.updateProjectionMatrix();
        }
        const visible = this.floorVisible && this.#bounds !== null;
        this.#grid.visible = this.#shadow.plane.visible = visible;
        if (visible && this.#shadowIsOld) this.#shadow.render(this.renderer);
        this.#shadowIsOld = false;
        this.renderer.render(this.#scene, this.camera);
    }

    /** In virtual reality: how far from the viewer the mesh stands, metres; 0 otherwise. */
    standBack(distance: number): void {
        this.#scene.position.set(0, 0, -distance);
    }

    /** For a graphics context that was lost and restored. */
    restore(): void {
        this.#shadowIsOld = true;
    }

    // Only as far as it must: what moves on the spot is not followed.
    #follow(middle: Vector3): void {
        const away = middle.sub(this.#followed).setY(0);
        const distance = away.length();
        if (!this.follows || distance <= this.#leash) return;
        away.multiplyScalar(1 - this.#leash / distance);
        this.#followed.add(away);
        this.view.target.add(away);
        this.#home?.target.add(away);
        // By whole cells, so that its lines stay where they are.
        const cell = this.#grid.scale.x / gridCells;
        this.#grid.position.set(Math.round(this.#followed.x / cell) * cell, 0, Math.round(this.#followed.z / cell) * cell);
    }

    #uprightBox(bounds: FrameReport['bounds']): Box3 {
        const corner = new Vector3(bounds[0], bounds[1], bounds[2]).multiplyScalar(0.001);
        const other = new Vector3(bounds[3], bounds[4], bounds[5]).multiplyScalar(0.001);
        corner.applyQuaternion(this.#upright.quaternion);
        other.applyQuaternion(this.#upright.quaternion);
        return new Box3().setFromPoints([corner, other]);
    }

    #findFacing({ positions, indices }: FrameReport): void {
        this.#facing = 0;
        const facing = this.#front ?? (indices && facingOf(positions, indices));
        if (!facing) return;
        const { x, z } = new Vector3(...facing).applyQuaternion(this.#upright.quaternion);
        if (Math.hypot(x, z) > 0.1) this.#facing = Math.atan2(x, z);
    }

    #standOnFloor(box: Box3): void {
        this.#bounds = box.clone();
        const middle = box.getCenter(new Vector3());
        const size = box.getSize(new Vector3());
        const floor = this.#floor ?? box.min.y;
        this.#stage.position.set(-middle.x, -floor, -middle.z);
        // Whatever way it is turned, with some room to move in.
        const radius = (Math.max(0.5 * Math.hypot(size.x, size.z), 0.5 * size.y) * 1.22) / (1 - this.below);
        const distance = radius / Math.sin((this.camera.fov * Math.PI) / 360);
        this.#home = { distance, target: new Vector3(0, middle.y - floor - this.below * radius, 0) };
        this.#leash = leash * radius;
        this.#followed.set(0, 0, 0);
        this.#grid.position.set(0, 0, 0);
        this.view.distance = distance;
        this.view.target.copy(this.#home.target);
        // Lines half a metre apart for what is as large as a person, and so on by tens.
        const cell = 10 ** Math.round(Math.log10(Math.max(size.x, size.y, size.z, 1e-3) / 1.8)) * 0.5;
        this.#grid.scale.setScalar(cell * gridCells);
    }
}

function gridPlane(): Mesh<PlaneGeometry, ShaderMaterial> {
    const material = new ShaderMaterial({
        transparent: true,
        depthWrite: false,
        uniforms: { colour: { value: new Color(0x55606e) } },
        vertexShader: `
            varying vec2 place;
            void main() {
                place = position.xz;
                gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
            }`,
        fragmentShader: `
            uniform vec3 colour;
            varying vec2 place;
            void main() {
                vec2 cell = place * ${gridCells.toFixed(1)};
                vec2 width = fwidth(cell);
                vec2 line = 1.0 - min(abs(fract(cell - 0.5) - 0.5) / max(width, 1e-4), 1.0);
                float fade = 1.0 - smoothstep(0.1, 0.5, length(place));
                float alpha = max(line.x, line.y) * fade * 0.4;
                gl_FragColor = vec4(colour, alpha);
            }`,
    });
    const plane = new Mesh(new PlaneGeometry(1, 1).rotateX(-Math.PI / 2), material);
    plane.renderOrder = -2;
    return plane;
}

// The weighted sum of the pixels along a line, as GLSL.
function blurSum(): string {
    const offsets = Array.from({ length: 2 * blurReach + 1 }, (_, i) => i - blurReach);
    const weights = offsets.map((offset) => Math.exp(-0.08 * offset * offset));
    const total = weights.reduce((sum, weight) => sum + weight);
    return offsets
        .map((offset, i) => `${(weights[i]! / total).toFixed(6)} * texture2D(picture, place + step.xy * ${offset.toFixed(1)}).r`)
        .join(' + ');
}

// The mesh seen from below, the nearer to the floor the darker, blurred.
class ContactShadow {
    readonly plane: Mesh<PlaneGeometry, MeshBasicMaterial>;
    #scene = new Scene();
    #caster: Mesh;
    #casterMaterial: ShaderMaterial;
    #camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
    #targets = [0, 1].map(() => new WebGLRenderTarget(shadowPixels, shadowPixels, { minFilter: LinearFilter, magFilter: LinearFilter, depthBuffer: true }));
    #blur: Mesh<PlaneGeometry, ShaderMaterial>;
    #blurCamera = new OrthographicCamera(-0.5, 0.5, 0.5, -0.5, 0, 1);
    #blurScene = new Scene();
    #source: HtvmMesh;

    constructor(source: HtvmMesh) {
        this.#source = source;
        this.#casterMaterial = new ShaderMaterial({
            blending: NoBlending,
            side: 2,
            uniforms: { reach: { value: 1 } },
            vertexShader: `
                varying float height;
                void main() {
                    vec4 world = modelMatrix * vec4(position, 1.0);
                    height = world.y;
                    gl_Position = projectionMatrix * viewMatrix * world;
                }`,
            fragmentShader: `
                uniform float reach;
                varying float height;
                void main() {
                    float near = clamp(1.0 - height / reach, 0.0, 1.0);
                    gl_FragColor = vec4(near * near);
                }`,
        });
        this.#caster = new Mesh(source.geometry, this.#casterMaterial);
        this.#caster.frustumCulled = false;
        this.#caster.matrixAutoUpdate = false;
        this.#scene.add(this.#caster);
        const blurMaterial = new ShaderMaterial({
            blending: NoBlending,
            depthTest: false,
            uniforms: { picture: { value: null }, step: { value: new Vector3() } },
            vertexShader: `
                varying vec2 place;
                void main() {
                    place = uv;
                    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
                }`,
            fragmentShader: `
                uniform sampler2D picture;
                uniform vec3 step;
                varying vec2 place;
                void main() {
                    gl_FragColor = vec4(${blurSum()});
                }`,
        });
        this.#blur = new Mesh(new PlaneGeometry(1, 1), blurMaterial);
        this.#blurScene.add(this.#blur);
        // Black where the picture is white.
        const material = new MeshBasicMaterial({
            color: 0x000000, alphaMap: this.#targets[0]!.texture, transparent: true, opacity: 0.5, depthWrite: false,
        });
        this.plane = new Mesh(new PlaneGeometry(1, 1).rotateX(-Math.PI / 2), material);
        this.plane.renderOrder = -1;
    }

    setStrength(opacity: number): void {
        this.plane.material.opacity = opacity;
    }

    dispose(): void {
        for (const target of this.#targets) target.dispose();
        this.plane.geometry.dispose();
        this.plane.material.dispose();
        this.#casterMaterial.dispose();
        this.#blur.geometry.dispose();
        this.#blur.material.dispose();
    }

    /** box: of the mesh as it stands on the floor. */
    moveOver(box: Box3, turn: Quaternion, place: Vector3): void {
        const middle = box.getCenter(new Vector3());
        const size = box.getSize(new Vector3());
        const side = Math.max(size.x, size.z) * 1.5;
        const half = side / 2;
        Object.assign(this.#camera, { left: -half, right: half, top: half, bottom: -half, near: 0, far: size.y * 2 });
        // From below, so that what is lower wins by depth.
        this.#camera.position.set(middle.x, -0.25 * size.y, middle.z);
        this.#camera.up.set(0, 0, 1);
        this.#camera.lookAt(middle.x, 1, middle.z);
        this.#camera.updateProjectionMatrix();
        this.#casterMaterial.uniforms['reach']!.value = 0.6 * size.y;
        this.#caster.matrix.compose(place, turn, this.#source.scale);
        // A picture from below is a mirror image of one from above.
        this.plane.scale.set(side, 1, -side);
        this.plane.position.set(middle.x, 0.001 * size.y, middle.z);
    }

    render(renderer: WebGLRenderer): void {
        const xr = renderer.xr.enabled;
        renderer.xr.enabled = false;
        const [first, second] = this.#targets as [WebGLRenderTarget, WebGLRenderTarget];
        renderer.setRenderTarget(first);
        renderer.clear();
        renderer.render(this.#scene, this.#camera);
        const { uniforms } = this.#blur.material;
        for (const [from, to, x, y] of [[first, second, 1, 0], [second, first, 0, 1]] as const) {
            uniforms['picture']!.value = from.texture;
            uniforms['step']!.value.set(x / shadowPixels, y / shadowPixels, 0);
            renderer.setRenderTarget(to);
            renderer.render(this.#blurScene, this.#blurCamera);
        }
        renderer.setRenderTarget(null);
        renderer.xr.enabled = xr;
    }
}
