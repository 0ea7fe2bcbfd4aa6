// The same capture as an htvm stream and as a Draco file a frame, in Chromium, which draws in software here:
//
//   node measure.mjs HTVM CAPTURE_FOLDER OUTPUT_FOLDER
//
// Makes OUTPUT_FOLDER, which any web server shows, and prints a table. HTVM: the program; draco_encoder is Debian's. With
// positions of 9 bits, Draco's surface error is about that of htvm's default quality; its colours are better.
import { execFileSync } from 'node:child_process';
import { cp, mkdir, readdir, readFile, stat, writeFile } from 'node:fs/promises';
import { basename, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { launch } from '../../tests/browser.mjs';
import { TestServer } from '../../tests/server.mjs';

const here = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const [program, capture, out] = process.argv.slice(2);
const seconds = 8;

async function makeSite() {
    await mkdir(join(out, 'frames'), { recursive: true });
    execFileSync(program, ['encode', capture, '-o', join(out, 'person.htvm')], { stdio: 'inherit' });
    const meshes = (await readdir(capture)).filter((name) => /\.(ply|obj)$/.test(name)).sort();
    const files = [];
    for (const name of meshes) {
        files.push(`frames/${name.replace(/\.\w+$/, '.drc')}`);
        execFileSync('draco_encoder', ['-i', join(capture, name), '-o', join(out, files.at(-1)), '-cl', '7', '-qp', '9'], { stdio: 'pipe' });
    }
    await writeFile(join(out, 'draco.json'), JSON.stringify({ framesPerSecond: 30, files }));
    await build({
        entryPoints: [here('draco_beside.js')], outfile: join(out, 'draco_beside.js'), bundle: true, minify: true, format: 'esm',
        target: 'es2022', logLevel: 'error', nodePaths: [here('../../node_modules')],
    });
    for (const name of ['htvm-worker.js', 'htvm_decoder.wasm']) await cp(here(`../../packages/player/dist/${name}`), join(out, name));
    await cp(here('../../node_modules/three/examples/jsm/libs/draco/gltf'), join(out, 'draco'), { recursive: true });
    await cp(here('index.html'), join(out, 'index.html'));
    let dracoBytes = 0;
    for (const file of files) dracoBytes += (await stat(join(out, file))).size;
    return { frames: files.length, bytes: { htvm: (await stat(join(out, 'person.htvm'))).size, draco: dracoBytes } };
}

// M2 of `htvm compare` for the first frames, millimetres.
function surfaceError(coded) {
    const words = ['compare', capture, join(out, coded), '--only', 'm2', '--frames', '5', '--json'];
    const { frames } = JSON.parse(execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] }));
    return frames.reduce((sum, { m2 }) => sum + m2.rms_mm, 0) / frames.length;
}

// Resident memory of the processes that browsers have for pages, MB.
function pageMemory() {
    const processes = execFileSync('ps', ['-eo', 'rss,args'], { encoding: 'utf8' }).split('\n').filter((line) => line.includes('--type=renderer'));
    return Math.max(...processes.map((line) => Number.parseInt(line, 10) / 1000));
}

async function measure(server, side) {
    const browser = await launch();
    try {
        const page = await browser.newPage({ viewport: { width: 1280, height: 560 } });
        await page.goto(`${server.origin}/index.html?side=${side}`);
        await page.waitForFunction((name) => results[name].length > 60, side, { timeout: 60000 });
        const result = await page.evaluate(async ({ name, seconds }) => {
            const before = results[name].length;
            const begin = performance.now();
            await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
            const shown = results[name].slice(before);
            const rate = (1000 * shown.length) / (performance.now() - begin);
            return { rate, decodeMs: shown.reduce((sum, { decodeMs }) => sum + decodeMs, 0) / shown.length, first: firstFrame[name] };
        }, { name: side, seconds });
        return { ...result, memory: pageMemory() };
    } finally {
        await browser.close();
    }
}

const { frames, bytes } = await makeSite();
const server = await new TestServer({ '': out }).start();
console.log(`${basename(capture)}, ${frames} frames; Chromium, drawing in software\n`);
console.log('| | surface error, mm | bytes a frame | Mbit/s at 30 frames/s | first frame, ms | decoding, ms a frame | frames/s shown | memory of the page, MB |');
console.log('|---|---|---|---|---|---|---|---|');
for (const [side, name, coded] of [
    ['htvm', 'htvm, `<htvm-player>`', 'person.htvm'], ['draco', 'Draco, three.js\'s `DRACOLoader`', 'frames'],
]) {
    const { rate, decodeMs, first, memory } = await measure(server, side);
    const each = bytes[side] / frames;
    console.log(`| ${name} | ${surfaceError(coded).toFixed(2)} | ${each.toFixed(0)} | ${(8e-6 * each * 30).toFixed(2)} | ${first.toFixed(0)} | ${decodeMs.toFixed(1)} | ${rate.toFixed(1)} | ${memory.toFixed(0)} |`);
}
server.stop();
