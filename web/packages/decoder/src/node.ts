// The same as index.ts for Node, whose fetch() reads no files.
import { readFile } from 'node:fs/promises';
import { DecoderModule } from './decoder.js';

export * from './index.js';

export async function loadDecoder(url: URL | string = new URL('./htvm_decoder.wasm', import.meta.url)): Promise<DecoderModule> {
    return DecoderModule.load(await readFile(url));
}
