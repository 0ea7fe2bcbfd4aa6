// How many levels of detail the player asks for, by how long frames take.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const source = fileURLToPath(new URL('../packages/player/src/detail_choice.ts', import.meta.url));
const { outputFiles } = await build({ entryPoints: [source], bundle: true, format: 'esm', write: false });
const { DetailChoice } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString('base64')}`);

const interval = 40;
/** The levels after so many frames that take so long. */
function after(choice, frames, decodeMs) {
    for (let i = 0; i < frames; ++i) choice.add(decodeMs, interval);
    return choice.levels;
}

test('frames that come in time keep all levels', () => {
    assert.equal(after(new DetailChoice(), 1000, 20), 3);
});

test('a level is left out each half second for as long as frames take more than 0.7 of their time', () => {
    const choice = new DetailChoice();
    assert.equal(after(choice, 14, 30), 3);
    assert.equal(after(choice, 1, 30), 2);
    assert.equal(after(choice, 15, 30), 1);
    assert.equal(after(choice, 150, 30), 0);
});

test('one slow frame is none too many', () => {
    const choice = new DetailChoice();
    choice.add(300, interval);
    assert.equal(after(choice, 14, 5), 3);
});

test('a level comes back where frames take less than a quarter of their time for long, and later each time', () => {
    const choice = new DetailChoice();
    assert.equal(after(choice, 15, 30), 2);
    assert.equal(after(choice, 299, 5), 2);
    assert.equal(after(choice, 1, 5), 3);
    assert.equal(after(choice, 15, 30), 2);
    assert.equal(after(choice, 599, 5), 2);
    assert.equal(after(choice, 1, 5), 3);
});

test('it says when the number changes, and only then', () => {
    const choice = new DetailChoice();
    const changes = [];
    for (let i = 0; i < 30; ++i) if (choice.add(30, interval)) changes.push(i);
    assert.deepEqual(changes, [14, 29]);
});
