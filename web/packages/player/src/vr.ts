// The scene in a headset, life-size, in front of whoever wears it.
import type { StageScene } from './scene.js';

const standBackMetres = 1.8;

export async function vrIsPossible(): Promise<boolean> {
    try {
        return (await navigator.xr?.isSessionSupported('immersive-vr')) === true;
    } catch {
        return false; // a page that may not ask
    }
}

/** begins: the headset calls for pictures from then on; tick: before each of them; ends: nobody does any more. */
export async function enterVr(scene: StageScene, calls: { begins(): void; tick(): void; ends(): void }): Promise<void> {
    const { xr } = scene.renderer;
    const session = await navigator.xr!.requestSession('immersive-vr', { optionalFeatures: ['local-floor'] });
    calls.begins();
    xr.enabled = true;
    await xr.setSession(session);
    scene.standBack(standBackMetres);
    scene.renderer.setAnimationLoop(() => {
        calls.tick();
        scene.render();
    });
    session.addEventListener('end', () => {
        scene.renderer.setAnimationLoop(null);
        xr.enabled = false;
        scene.standBack(0);
        calls.ends();
    });
}
