// Runs tests/digests/digests.cpp, compiled for WASI, under Node: node digests.mjs digests.wasm FOLDER STREAM ...
// The streams are named relative to the folder. Exits as the program does.
import { readFile } from 'node:fs/promises';
import { WASI } from 'node:wasi';

const [module, folder, ...streams] = process.argv.slice(2);
const wasi = new WASI({
    version: 'preview1',
    args: ['digests', '1', ...streams.map((name) => `/streams/${name}`)],
    preopens: { '/streams': folder },
    returnOnExit: true,
});
const compiled = await WebAssembly.compile(await readFile(module));
const instance = await WebAssembly.instantiate(compiled, { wasi_snapshot_preview1: wasi.wasiImport });
process.exitCode = wasi.start(instance);
