// The page of `htvm play` and `htvm serve`: a stream in the whole window (/play/NAME: a live one), or the list of streams, the
// live ones first, and of files with a still of each: the poster that lies beside it, or one drawn here.
import '/player/htvm-player.js';
import { playBeside } from '/player/beside.js';

const content = document.getElementById('content');
const address = (path) => `/files/${path.split('/').map(encodeURIComponent).join('/')}`;
const query = new URLSearchParams(location.search);
const looks = ['orbit', 'up']; // attributes of the player that the page's address gives
const view = Object.fromEntries(looks.filter((name) => query.has(name)).map((name) => [name, query.get(name)]));
const updateMs = 3000; // of the list of live streams
const nameOf = (path) => path.replace(/\.htvm$/, '');

function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
    element.append(...children);
    return element;
}

function play(name, attributes, alone) {
    document.title = `${name} – htvm`;
    const common = { class: 'whole', label: `${name}, a three-dimensional capture`, autoplay: '', controls: '' };
    const player = make('htvm-player', { ...common, ...attributes, ...view });
    content.append(player);
    player.focus({ focusVisible: false }); // its keys work at once
    if (!alone && !query.has('signature')) content.append(make('a', { class: 'back', href: '/' }, 'All streams'));
}

// What the page's address has besides `file`, such as a signed link's query, goes on to the file.
function playFile(path, alone) {
    const rest = new URLSearchParams(query);
    for (const own of ['file', ...looks]) rest.delete(own);
    play(nameOf(path), { src: address(path) + (rest.size > 0 ? `?${rest}` : ''), loop: '' }, alone);
}

// The query of a signed link goes on to the stream.
function playLive(name) {
    play(name, { src: `/watch/${encodeURIComponent(name)}${location.search}`, live: '' }, false);
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

// null where it cannot be had.
async function fetched(path) {
    try {
        const response = await fetch(path);
        return response.ok ? await response.json() : null;
    } catch {
        return null;
    }
}

function liveRows(streams) {
    return streams.map(({ name, published, viewers }) => {
        const note = published ? `live, ${viewers} watching` : 'publisher gone';
        const link = make('a', { href: `/play/${encodeURIComponent(name)}`, class: 'live' }, make('span', {}, name), make('small', {}, note));
        return make('li', {}, link);
    });
}

function list(files, streams) {
    const items = files.map(({ path, bytes, poster }) => {
        const src = poster ? address(poster) : 'data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7';
        const image = make('img', { alt: '', src });
        const note = make('small', {}, sizeText(bytes));
        const link = make('a', { href: `/?${new URLSearchParams({ file: path, ...view })}` }, image, make('span', {}, nameOf(path)), note);
        return { path, poster, image, note, row: make('li', {}, link) };
    });
    const live = make('ul', { class: 'now', 'aria-label': 'Live streams' });
    const empty = make('p', { class: 'empty' }, 'Nothing is live here now, and there are no .htvm files.');
    const rows = make('ul', {}, ...items.map(({ row }) => row));
    content.append(make('div', { class: 'list' }, make('h1', {}, 'Streams'), live, rows, empty));
    const showLive = (now) => {
        // Rows that are the same stay, so that one that has the focus keeps it.
        const next = liveRows(now);
        if (live.innerHTML !== make('ul', {}, ...next.map((row) => row.cloneNode(true))).innerHTML) live.replaceChildren(...next);
        empty.hidden = now.length + files.length > 0;
    };
    showLive(streams);
    const update = async () => {
        const now = document.visibilityState === 'visible' ? await fetched('/api/streams') : null;
        if (now) showLive(now);
        setTimeout(update, updateMs);
    };
    setTimeout(update, updateMs);
    const without = items.filter(({ poster }) => !poster);
    if (without.length > 0) void drawStills(without);
}

const watched = /^\/play\/([^/]+)$/.exec(location.pathname);
const asked = query.get('file');
const beside = query.get('beside');
if (watched) {
    playLive(decodeURIComponent(watched[1]));
} else if (asked !== null && beside !== null) {
    const streams = [asked, beside].map((path) => ({ name: nameOf(path.replace(/^beside\//, '')), address: address(path) }));
    document.title = `${streams.map(({ name }) => name).join(' | ')} – htvm`;
    content.append(playBeside(streams, view));
} else if (asked !== null) {
    playFile(asked, false);
} else {
    const [files, streams] = await Promise.all([fetched('/api/files'), fetched('/api/streams')]);
    // Where there are no live streams, the page is of files alone.
    if (streams) list(files ?? [], streams);
    else if (files?.length === 1) playFile(files[0].path, true);
    else if (files?.length > 0) list(files, []);
    else content.append(make('p', { class: 'empty' }, files ? 'There are no .htvm files in this folder.' : 'Nothing is listed here: watching needs a link.'));
}
