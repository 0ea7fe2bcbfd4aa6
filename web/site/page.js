// The page of `htvm play` and `htvm serve`: a stream in the whole window, or the list of streams with a still of each: the
// poster that lies beside it, or one drawn here.
import '/player/htvm-player.js';
import { playBeside } from '/player/beside.js';

const content = document.getElementById('content');
const address = (path) => `/files/${path.split('/').map(encodeURIComponent).join('/')}`;
const query = new URLSearchParams(location.search);
const view = query.has('orbit') ? { orbit: query.get('orbit') } : {};
const nameOf = (path) => path.replace(/\.htvm$/, '');

function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
    element.append(...children);
    return element;
}

function play(path, alone) {
    document.title = `${nameOf(path)} – htvm`;
    const attributes = { class: 'whole', src: address(path), label: `${nameOf(path)}, a three-dimensional capture` };
    const player = make('htvm-player', { ...attributes, ...view, autoplay: '', loop: '', controls: '' });
    content.append(player);
    player.focus({ focusVisible: false }); // its keys work at once
    if (!alone) content.append(make('a', { class: 'back', href: '/' }, 'All streams'));
}

function sizeText(bytes) {
    return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

// One player draws the stills one after the other: browsers have few graphics contexts.
async function drawStills(items) {
    const player = make('htvm-player', { ...view, class: 'maker', floor: 'none', theme: 'light', 'aria-hidden': 'true' });
    document.body.append(player);
    for (const { path, image, note } of items) {
        const shown = new Promise((resolve) => {
            player.addEventListener('framepresented', () => resolve(true), { once: true });
            player.addEventListener('error', () => resolve(false), { once: true });
        });
        player.src = address(path);
        if (await shown) {
            await player.idle();
            image.src = URL.createObjectURL(await player.screenshot());
            if (Number.isFinite(player.duration)) note.append(`, ${player.duration.toFixed(1)} s`);
        } else {
            note.append(', cannot be played');
        }
    }
    player.remove();
}

function list(files) {
    const items = files.map(({ path, bytes, poster }) => {
        const src = poster ? address(poster) : 'data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7';
        const image = make('img', { alt: '', src });
        const note = make('small', {}, sizeText(bytes));
        const link = make('a', { href: `/?${new URLSearchParams({ file: path, ...view })}` }, image, make('span', {}, nameOf(path)), note);
        return { path, poster, image, note, row: make('li', {}, link) };
    });
    const rows = items.map(({ row }) => row);
    content.append(make('div', { class: 'list' }, make('h1', {}, 'Streams'), make('ul', {}, ...rows)));
    const without = items.filter(({ poster }) => !poster);
    if (without.length > 0) void drawStills(without);
}

const response = await fetch('/api/files');
const files = response.ok ? await response.json() : [];
const asked = query.get('file');
const beside = query.get('beside');
if (asked !== null && beside !== null) {
    const streams = [asked, beside].map((path) => ({ name: nameOf(path.replace(/^beside\//, '')), address: address(path) }));
    document.title = `${streams.map(({ name }) => name).join(' | ')} – htvm`;
    content.append(playBeside(streams, view));
} else if (asked !== null) play(asked, false);
else if (files.length === 1) play(files[0].path, true);
else if (files.length > 0) list(files);
else content.append(make('p', { class: 'empty' }, 'There are no .htvm files in this folder.'));
