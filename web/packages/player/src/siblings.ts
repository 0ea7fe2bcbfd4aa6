// Where a browser does not decode the pictures of a stream: the same stream with other pictures, beside it. The meshes of
// person.vp9.htvm and person.h264.htvm, as `htvm transcode` writes them, are those of person.htvm.
import type { Variant } from './playlist.js';

interface Coder {
    /** In names of files. */
    word: string;
    /** As readPicture() calls it. */
    name: string;
    /** How names of its codecs begin in playlists. */
    begins: string[];
    /** One of these, of pictures of 1920 x 1080. */
    codec: string;
}

// The one with the fewest bits first.
const coders: readonly Coder[] = [
    { word: 'av1', name: 'AV1', begins: ['av01.'], codec: 'av01.0.08M.08' },
    { word: 'vp9', name: 'VP9', begins: ['vp09.'], codec: 'vp09.00.40.08' },
    { word: 'h264', name: 'H.264', begins: ['avc1.', 'avc3.'], codec: 'avc1.640028' },
];

async function decodes(codec: string): Promise<boolean> {
    if (typeof VideoDecoder === 'undefined') return false;
    return VideoDecoder.isConfigSupported({ codec }).then(({ supported }) => supported === true, () => false);
}

/** The address of a sibling whose pictures this browser decodes; null where there is none. coder: the one that it does not decode. */
export async function siblingOf(url: string, coder: string): Promise<string | null> {
    const address = new URL(url);
    const [, name, ending] = /^(.+)(\.htvm|\.mp4)$/.exec(address.pathname) ?? [];
    if (!name || !/^https?:$/.test(address.protocol)) return null;
    for (const { word, name: other, codec } of coders) {
        if (other === coder || !(await decodes(codec))) continue;
        address.pathname = `${name}.${word}${ending}`;
        const answer = await fetch(address, { method: 'HEAD' }).catch(() => null);
        if (answer?.ok) return address.href;
    }
    return null;
}

/**
 * Of the qualities in a list of playlists those with pictures by one coder: the first that this browser decodes; where it decodes
 * none, all by the first coder, whose meshes are shown. Qualities that tell no coder are kept.
 */
export async function decodable(variants: readonly Variant[]): Promise<Variant[]> {
    const coderOf = ({ codecs }: Variant): Coder | undefined =>
        coders.find(({ begins }) => codecs.split(',').some((codec) => begins.some((begin) => codec.trim().startsWith(begin))));
    const there = coders.filter((coder) => variants.some((variant) => coderOf(variant) === coder));
    if (there.length < 2) return [...variants];
    let chosen = there[0]!;
    for (const coder of there) {
        if (!(await decodes(coder.codec))) continue;
        chosen = coder;
        break;
    }
    return variants.filter((variant) => [undefined, chosen].includes(coderOf(variant)));
}
