export { opusSamples, readAudio } from './audio.js';
export type { AudioPacket } from './audio.js';
export { crc32 } from './crc32.js';
export { Decoder, DecoderError, DecoderModule } from './decoder.js';
export type { DecoderOptions, ErrorCode, Axis, Frame, FrameKind, IndexEntry, SequenceInfo } from './decoder.js';
export { codecDescription, codecString, isKeyPicture, isVideo, readPicture } from './picture.js';
export type { PictureCoder, TexturePicture } from './picture.js';
export { streamVersion } from './layouts.js';
export {
    isAccess, isFrame, isReference, isReferred, isStart, packetFlag, packetKind, PacketSplitter, readPacketHeader,
} from './packets.js';
export type { Packet, PacketHeader } from './packets.js';
import { DecoderModule } from './decoder.js';

/** Loads the module that lies beside this file, or the one at `url`. */
export async function loadDecoder(url: URL | string = new URL('./htvm_decoder.wasm', import.meta.url)): Promise<DecoderModule> {
    return DecoderModule.load(await fetch(url));
}
