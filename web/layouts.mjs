// Writes packages/decoder/src/layouts.ts: how the structs of htvm.h lie in the WebAssembly module's memory, its
// constants and its functions, as clang tells them of the header itself; and the stream version that the module reads.
//
//   node layouts.mjs HEADER MODULE OUT
import { execFileSync } from 'node:child_process';
import { readFile, writeFile } from 'node:fs/promises';

const [header, modulePath, out] = process.argv.slice(2);
const compiler = process.env.CLANG ?? 'clang-14';

const clang = (...flags) =>
    execFileSync(compiler, ['--target=wasm32-wasi', '-x', 'c', '-fsyntax-only', ...flags, header], {
        encoding: 'utf8',
        maxBuffer: 1 << 28,
    });

function layouts() {
    const found = {};
    for (const record of clang('-Xclang', '-fdump-record-layouts-complete').split('*** Dumping AST Record Layout')) {
        const name = /0 \| struct (htvm_\w+)$/m.exec(record)?.[1];
        if (!name) continue;
        const fields = {};
        for (const [, offset, type, field] of record.matchAll(/^ *(\d+) \| {3}(\S.*?) (\w+)$/gm)) {
            const kind = type.includes('*') || type.startsWith('htvm_run_tasks') ? 'pointer' : type;
            fields[field] = [Number(offset), kind];
        }
        found[name] = { size: Number(/\[sizeof=(\d+)/.exec(record)[1]), fields };
    }
    return found;
}

// Constants and functions come from the header's syntax tree.
function declarations() {
    const constants = {};
    const functions = {};
    for (const node of JSON.parse(clang('-Xclang', '-ast-dump=json')).inner) {
        if (node.kind === 'EnumDecl')
            for (const constant of node.inner)
                if (constant.name?.startsWith('HTVM_')) constants[constant.name] = Number(constant.inner[0].value);
        if (node.kind === 'FunctionDecl' && node.name.startsWith('htvm_'))
            functions[node.name] = {
                parameters: (node.inner ?? []).filter((part) => part.kind === 'ParmVarDecl'),
                result: node.type.qualType.split('(')[0].trim(),
            };
    }
    return { constants, functions };
}

const typescript = (type) => {
    if (type === 'void') return 'void';
    if (type.includes('*') || type.startsWith('htvm_run_tasks')) return 'number';
    return /^u?int64_t$/.test(type) ? 'bigint' : 'number';
};

const module = await WebAssembly.compile(await readFile(modulePath));
const { exports } = await WebAssembly.instantiate(module, {});
const exported = new Set(WebAssembly.Module.exports(module).map(({ name }) => name));
const { constants, functions } = declarations();
const signatures = Object.entries(functions)
    .filter(([name]) => exported.has(name))
    .map(([name, { parameters, result }]) => {
        const list = parameters.map((part) => `${part.name}: ${typescript(part.type.qualType)}`).join(', ');
        return `    ${name}(${list}): ${typescript(result)};`;
    });
const struct = ([name, { size, fields }]) => {
    const lines = Object.entries(fields).map(([field, [offset, type]]) => `            ${field}: [${offset}, '${type}'],`);
    return `    ${name}: {\n        size: ${size},\n        fields: {\n${lines.join('\n')}\n        },\n    },`;
};

await writeFile(out, `// Made by web/layouts.mjs from include/htvm/htvm.h: do not edit.

/** The version of the stream (docs/bitstream.md) that the decoder reads. */
export const streamVersion = ${exports.htvm_stream_version()};

export const constants = {
${Object.entries(constants).map(([name, value]) => `    ${name}: ${value},`).join('\n')}
} as const;

/** Each struct's size, and each field's offset and type. */
export const layouts = {
${Object.entries(layouts()).map(struct).join('\n')}
} as const;

export interface Functions {
    memory: WebAssembly.Memory;
    _initialize(): void;
    malloc(bytes: number): number;
    free(address: number): void;
${signatures.join('\n')}
}
`);
