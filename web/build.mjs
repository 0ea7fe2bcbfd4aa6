// Builds the packages into packages/*/dist: node build.mjs. The decoder's WebAssembly must be there: ./dev wasm.
import { execFileSync } from 'node:child_process';
import { copyFile, mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const folder = fileURLToPath(new URL('.', import.meta.url));
process.chdir(folder);
const wasm = '../build/wasm/htvm_decoder.wasm';
const packages = ['decoder', 'three', 'player'];

for (const name of packages) {
    await rm(`packages/${name}/dist`, { recursive: true, force: true });
    await mkdir(`packages/${name}/dist`, { recursive: true });
    await copyFile('../LICENSE', `packages/${name}/LICENSE`);
}
execFileSync('node', ['layouts.mjs', '../include/htvm/htvm.h', wasm, 'packages/decoder/src/layouts.ts'], { stdio: 'inherit' });
execFileSync('node', ['node_modules/typescript/bin/tsc', '-b'], { stdio: 'inherit' });
for (const name of packages) await rm(`packages/${name}/dist/.tsbuildinfo`);

const common = { absWorkingDir: folder, bundle: true, format: 'esm', target: 'es2022', sourcemap: true, logLevel: 'warning' };
const from = (name, file) => [`packages/${name}/src/${file}.ts`];
const to = (name, file) => `packages/${name}/dist/${file}.js`;
const needed = { external: ['three', '@htvm/*'] };
await build({ ...common, entryPoints: from('decoder', 'index'), outfile: to('decoder', 'index') });
await build({ ...common, entryPoints: from('decoder', 'node'), outfile: to('decoder', 'node'), platform: 'node' });
await build({ ...common, ...needed, entryPoints: from('three', 'index'), outfile: to('three', 'index') });
await build({ ...common, ...needed, entryPoints: from('player', 'index'), outfile: to('player', 'index') });

// For pages without a build step: everything in one file, beside the worker and the decoder.
const whole = { ...common, minify: true, sourcemap: false, legalComments: 'none' };
const notice = `/*! htvm player, Apache-2.0; with three.js, MIT: htvm-player.LICENSES.txt */`;
await build({ ...whole, entryPoints: from('player', 'index'), outfile: to('player', 'htvm-player'), banner: { js: notice } });
await build({
    ...whole, format: 'iife', entryPoints: from('player', 'worker'), outfile: to('player', 'htvm-worker'),
    banner: { js: '/*! htvm player, Apache-2.0 */' }, logOverride: { 'empty-import-meta': 'silent' },
});
// The same with worker and decoder inside, for pages that can have one file only.
const inside = `
    import { HtvmPlayerElement } from ${JSON.stringify(`${folder}packages/player/src/element.ts`)};
    const address = (part, type) => URL.createObjectURL(new Blob([part], { type }));
    HtvmPlayerElement.workerUrl = address(${JSON.stringify(await readFile('packages/player/dist/htvm-worker.js', 'utf8'))}, 'text/javascript');
    const decoder = atob('${(await readFile(wasm)).toString('base64')}');
    HtvmPlayerElement.decoderUrl = address(Uint8Array.from(decoder, (letter) => letter.charCodeAt(0)), 'application/wasm');
`;
await build({
    ...whole, outfile: to('player', 'htvm-player-single'), banner: { js: notice },
    // The element looks for its files once it is defined, by index.ts, which comes second.
    stdin: { contents: `import 'inside'; export * from './packages/player/src/index.ts';`, resolveDir: folder },
    plugins: [{
        name: 'inside',
        setup: (bundle) => {
            bundle.onResolve({ filter: /^inside$/ }, () => ({ path: 'inside', namespace: 'inside' }));
            bundle.onLoad({ filter: /.*/, namespace: 'inside' }, () => ({ contents: inside, loader: 'js', resolveDir: folder }));
        },
    }],
});
await copyFile(wasm, 'packages/decoder/dist/htvm_decoder.wasm');
await copyFile(wasm, 'packages/player/dist/htvm_decoder.wasm');
const licence = async (title, path) => `${title}\n${'='.repeat(title.length)}\n\n${(await readFile(path, 'utf8')).trim()}\n`;
await writeFile(
    'packages/player/dist/htvm-player.LICENSES.txt',
    `${await licence('three.js (in htvm-player.js)', 'node_modules/three/LICENSE')}\n${await licence('htvm', '../LICENSE')}`);

// What the program's own web server carries inside: cmake/live.cmake.
await rm('dist', { recursive: true, force: true });
await mkdir('dist');
for (const name of ['htvm-player.js', 'htvm-worker.js', 'htvm_decoder.wasm', 'htvm-player.LICENSES.txt'])
    await copyFile(`packages/player/dist/${name}`, `dist/${name}`);
for (const name of ['index.html', 'page.js', 'beside.js', 'page.css']) await copyFile(`site/${name}`, `dist/${name}`);
