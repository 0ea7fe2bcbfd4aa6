// Playlists of HLS (RFC 8216, and parts of segments as its second edition has them), as far as streams in segments have them
// (docs/mp4.md), from servers that may say anything.
import { SourceError } from './byte_source.js';

/** A piece of a segment that can be fetched before the segment is whole; the first one begins where decoding can start. */
export interface Part {
    url: string;
    seconds: number;
}

export interface Segment {
    /** Counted through the stream; segments of the same number in other rungs have the same frames. */
    number: number;
    /** '' of one that is not whole. */
    url: string;
    /** Of what is needed before its first frame. */
    mapUrl: string;
    seconds: number;
    /** All of them, or none. Where the segment is not whole, those that are there. */
    parts: Part[];
    /** When it was made, milliseconds since 1970; null: not told. */
    dateMs: number | null;
}

export interface MediaPlaylist {
    targetSeconds: number;
    /** Consecutive. */
    segments: Segment[];
    /** The number of the first segment that is listed, or would be. */
    firstNumber: number;
    /** No segment follows. */
    ended: boolean;
    /** The segment behind the last one, of which parts are there; null where none are. */
    open: Segment | null;
    /** That no part lasts longer than; 0: there are none. */
    partSeconds: number;
    /** How far behind the end of the last part players are to stay; 0: not told. */
    partHoldBack: number;
    /** The part that comes next, which who asks for it gets once it is there; '': not told. */
    hint: string;
    /** The server says that who asks for what comes next gets the list once it is there. */
    canWait: boolean;
}

/** One of several qualities of the same stream. */
export interface Variant {
    url: string;
    bitsPerSecond: number;
    /** As "1024x1024", or ''. */
    resolution: string;
    /** As "htvm,av01.0.08M.08", or ''. */
    codecs: string;
}

const mostSegments = 100000;
const mostParts = 1000; // of a segment
const mostVariants = 32;
const mostNameLength = 2048;
const longestSeconds = 3600;

const lies = (what: string): SourceError => new SourceError('not-htvm', `The playlist cannot be read: ${what}.`);

/** Whether a text that begins so, with seven bytes at least, may be a playlist. */
export function looksLikePlaylist(bytes: Uint8Array): boolean {
    return String.fromCharCode(...bytes.subarray(0, 7)) === '#EXTM3U';
}

/** base: the address that it came from. The variants, by rate, of a list of playlists; or the playlist. */
export function readPlaylist(text: string, base: string): { variants: Variant[] } | { playlist: MediaPlaylist } {
    if (!text.startsWith('#EXTM3U')) throw lies('it does not begin with #EXTM3U');
    const lines = text.split('\n').map((line) => line.trim()).filter((line) => line !== '');
    return lines.some((line) => line.startsWith('#EXT-X-STREAM-INF:')) ? { variants: readVariants(lines, base) } : { playlist: readSegments(lines, base) };
}

function readVariants(lines: string[], base: string): Variant[] {
    const out: Variant[] = [];
    let told: Map<string, string> | null = null;
    for (const line of lines) {
        if (line.startsWith('#EXT-X-STREAM-INF:')) told = attributesOf(line);
        if (line.startsWith('#') || !told) continue;
        const bitsPerSecond = numberIn(told.get('AVERAGE-BANDWIDTH') ?? told.get('BANDWIDTH') ?? '', 'BANDWIDTH', 1e12);
        out.push({ url: addressOf(line, base), bitsPerSecond, resolution: told.get('RESOLUTION') ?? '', codecs: told.get('CODECS') ?? '' });
        told = null;
        if (out.length > mostVariants) throw lies('it has more qualities than are taken');
    }
    if (out.length === 0) throw lies('it names no playlist');
    return out.sort((a, b) => a.bitsPerSecond - b.bitsPerSecond);
}

function readSegments(lines: string[], base: string): MediaPlaylist {
    const out: MediaPlaylist = { targetSeconds: 0, segments: [], firstNumber: 0, ended: false, open: null, partSeconds: 0, partHoldBack: 0, hint: '', canWait: false };
    let seconds: number | null = null;
    let [mapUrl, dateMs, parts] = ['', null as number | null, [] as Part[]];
    const add = (url: string, lasts: number): Segment => {
        if (!mapUrl) throw lies('a segment has no #EXT-X-MAP');
        const segment = { number: out.firstNumber + out.segments.length, url, mapUrl, seconds: lasts, parts, dateMs };
        [dateMs, parts] = [null, []];
        return segment;
    };
    for (const line of lines) {
        const value = line.slice(line.indexOf(':') + 1);
        if (line.startsWith('#EXTINF:')) seconds = numberIn(value.split(',')[0]!, '#EXTINF', longestSeconds);
        else if (line.startsWith('#EXT-X-TARGETDURATION:')) out.targetSeconds = numberIn(value, '#EXT-X-TARGETDURATION', longestSeconds);
        else if (line.startsWith('#EXT-X-MEDIA-SEQUENCE:')) out.firstNumber = numberIn(value, '#EXT-X-MEDIA-SEQUENCE', Number.MAX_SAFE_INTEGER / 2);
        else if (line.startsWith('#EXT-X-PROGRAM-DATE-TIME:')) dateMs = dateIn(value);
        else if (line === '#EXT-X-ENDLIST') out.ended = true;
        else if (line.startsWith('#EXT-X-MAP:')) {
            const attributes = attributesOf(line);
            if (attributes.has('BYTERANGE')) throw lies('it has maps that are parts of files, which are not read here');
            mapUrl = addressOf(attributes.get('URI') ?? '', base);
        } else if (line.startsWith('#EXT-X-PART:')) parts.push(partOf(line, base, parts.length));
        else if (line.startsWith('#EXT-X-PRELOAD-HINT:')) out.hint = hintIn(line, base) ?? out.hint;
        else if (line.startsWith('#EXT-X-PART-INF:')) out.partSeconds = numberIn(attributesOf(line).get('PART-TARGET') ?? '', 'PART-TARGET', longestSeconds);
        else if (line.startsWith('#EXT-X-SERVER-CONTROL:')) {
            const attributes = attributesOf(line);
            out.canWait = attributes.get('CAN-BLOCK-RELOAD') === 'YES';
            out.partHoldBack = numberIn(attributes.get('PART-HOLD-BACK') ?? '0', 'PART-HOLD-BACK', longestSeconds);
        } else if (line.startsWith('#EXT-X-BYTERANGE:')) throw lies('it has segments that are parts of files, which are not read here');
        else if (line.startsWith('#EXT-X-KEY:') && attributesOf(line).get('METHOD') !== 'NONE') throw lies('it is encrypted');
        if (line.startsWith('#')) continue;
        if (seconds === null) throw lies('a segment has no #EXTINF');
        if (out.segments.length >= mostSegments) throw lies('it has more segments than are taken');
        out.segments.push(add(addressOf(line, base), seconds));
        seconds = null;
    }
    if (parts.length > 0 && !out.ended) out.open = add('', 0);
    for (const { parts: listed } of [...out.segments.slice(-100), ...(out.open ? [out.open] : [])])
        for (const { seconds: lasts } of listed) out.partSeconds = Math.max(out.partSeconds, lasts);
    out.targetSeconds = Math.max(out.targetSeconds, ...out.segments.slice(-100).map((segment) => segment.seconds), 0.1);
    return out;
}

function partOf(line: string, base: string, before: number): Part {
    const attributes = attributesOf(line);
    if (attributes.has('BYTERANGE')) throw lies('it has parts that are parts of files, which are not read here');
    if (before >= mostParts) throw lies('a segment has more parts than are taken');
    return { url: addressOf(attributes.get('URI') ?? '', base), seconds: numberIn(attributes.get('DURATION') ?? '', 'the DURATION of a part', longestSeconds) };
}

// Null of what is no part, or a part of a file.
function hintIn(line: string, base: string): string | null {
    const attributes = attributesOf(line);
    if (attributes.get('TYPE') !== 'PART' || attributes.has('BYTERANGE-START')) return null;
    return addressOf(attributes.get('URI') ?? '', base);
}

// Players do without a date that is none.
function dateIn(text: string): number | null {
    const date = Date.parse(text);
    return Number.isFinite(date) ? date : null;
}

// NAME=VALUE or NAME="VALUE", with commas between. A name begins the line or is behind a comma, so that each letter is looked at
// a few times, however long the line is.
function attributesOf(line: string): Map<string, string> {
    const out = new Map<string, string>();
    for (const [, name, quoted, plain] of line.slice(line.indexOf(':') + 1).matchAll(/(?:^|,)\s*([A-Z0-9-]+)=(?:"([^"]*)"|([^",]*))/g))
        out.set(name!, quoted ?? plain ?? '');
    return out;
}

function numberIn(text: string, of: string, most: number): number {
    const value = /^\d+(\.\d+)?$/.test(text.trim()) ? Number(text) : NaN;
    if (!(value <= most)) throw lies(`${of} has a number that is none: ${text.slice(0, 40)}`);
    return value;
}

function addressOf(name: string, base: string): string {
    if (name === '' || name.length > mostNameLength) throw lies('a name is missing, or too long');
    let address: URL;
    try {
        address = new URL(name, base);
    } catch {
        throw lies(`${name.slice(0, 80)} is no address`);
    }
    if (address.protocol !== 'https:' && address.protocol !== 'http:') throw lies(`it names an address of another kind: ${address.protocol}`);
    return address.href;
}
