// Decodes the pictures of a textured stream: AV1 by dav1d, VP9 by libvpx, image files by whoever can read them. H.264,
// which is for browsers that have neither, is refused as unsupported: the stream that it was made of has the same
// pictures.
//
//   htvm::PictureDecoder pictures;
//   for each packet of the stream, behind the mesh decoder's:
//       if (packet.kind == htvm::PacketKind::texture) pictures.decode(packet);
//   draw(mesh, *pictures.image());
//
// Part of the library htvm::texture, which needs libaom, libvpx and libdav1d.
//
// Threads and lifetimes. One object is used by one thread at a time. An image that it lends is valid until its next
// call.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "htvm/image.hpp"
#include "htvm/packet.hpp"
#include "htvm/picture_planes.hpp"
#include "htvm/result.hpp"
#include "htvm/texture.hpp"

namespace htvm {

struct PictureDecoderOptions {
    unsigned threads = 1;                            // of AV1 and VP9; 0: one per core
    std::uint32_t largest_side = most_picture_side;  // pixels; larger pictures are refused with ErrorKind::limit
    // Reads a PNG, JPEG or WebP file; empty: they are refused as unsupported.
    std::function<Result<Image>(std::span<const std::uint8_t>)> read_image_file = {};
};

class PictureDecoder {
public:
    explicit PictureDecoder(PictureDecoderOptions options = {});
    PictureDecoder(PictureDecoder&&) noexcept;
    PictureDecoder& operator=(PictureDecoder&&) noexcept;
    ~PictureDecoder();

    // Decodes the picture of a packet of PacketKind::texture, which image() and planes() then lend. After an error the
    // last one stays, and the next key picture is the next that can be decoded.
    Result<void> decode(const Packet& packet);
    // Forgets everything, as for another sequence of the stream.
    void reset();

    // The last picture with its gains, in red, green and blue; null before the first. On loan until the next decode().
    // Converted when it is asked for.
    std::shared_ptr<const Image> image();
    // Its planes, as decoded: gains are not applied. Null before the first, and of image files. On loan likewise.
    const PicturePlanes* planes() const;
    // What its packet says; `coded` is empty.
    const TexturePicture& picture() const;
    std::uint32_t frame() const;  // whose picture it is

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace htvm
