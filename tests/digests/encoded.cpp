// Encodes the frames of streams again, in several ways, and prints what came out: a build of the encoder for another
// system or processor must print the same lines. What goes in is decoded, so it is the same to the bit everywhere.
//
//   encoded FILE.htvm ...
//
// Prints one line per stream and way: the name, the way, the frames that came out, the bytes, their CRC-32.
#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/crc32.h"
#include "htvm/htvm.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

std::optional<Bytes> bytes_of(const char* path) {
    std::FILE* file = std::fopen(path, "rb");
    if (!file) return std::nullopt;
    Bytes out;
    std::array<std::uint8_t, 4096> piece;
    while (const std::size_t count = std::fread(piece.data(), 1, piece.size(), file))
        out.insert(out.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(count));
    std::fclose(file);
    return out;
}

std::optional<std::vector<htvm::DecodedFrame>> frames_of(const Bytes& stream) {
    htvm::Decoder decoder;
    htvm::PacketReader reader;
    reader.push(stream);
    std::vector<htvm::DecodedFrame> out;
    while (const auto packet = reader.pull()) {
        auto frame = decoder.decode_copy(*packet);
        if (!frame) return std::nullopt;
        if (*frame) out.push_back(std::move(**frame));
    }
    return out;
}

struct Way {
    const char* name;
    htvm::EncoderOptions options;
};

std::vector<Way> ways() {
    std::vector<Way> out;
    for (const auto& [name, profile] :
         {std::pair{"tracked", htvm::Profile::tracked}, {"topology", htvm::Profile::topology}}) {
        htvm::EncoderOptions options;
        options.profile = profile;
        options.key_interval = 5;
        out.push_back({name, options});
    }
    return out;
}

struct Coded {
    Bytes bytes;
    int packets = 0;
};

void add_packets(htvm::Encoder& encoder, Coded& out) {
    while (const auto packet = encoder.pull()) {
        const auto bytes = htvm::write_packet(*packet);
        out.bytes.insert(out.bytes.end(), bytes.begin(), bytes.end());
        ++out.packets;
    }
}

htvm::Result<Coded> encode(const std::vector<htvm::DecodedFrame>& frames, const htvm::EncoderOptions& options) {
    auto encoder = htvm::Encoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    Coded out;
    for (const auto& frame : frames) {
        if (auto pushed = encoder->push(frame.mesh, nullptr, frame.info.timestamp_us); !pushed)
            return tl::unexpected(pushed.error());
        add_packets(*encoder, out);
    }
    if (auto finished = encoder->finish(); !finished) return tl::unexpected(finished.error());
    add_packets(*encoder, out);
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    int failures = argc < 2 ? 1 : 0;
    for (int i = 1; i < argc; ++i) {
        const std::string path = argv[i], name = path.substr(path.find_last_of("/\\") + 1);
        const auto stream = bytes_of(argv[i]);
        const auto frames = stream ? frames_of(*stream) : std::nullopt;
        if (!frames) {
            std::printf("%s: cannot be read or decoded\n", name.c_str());
            ++failures;
            continue;
        }
        for (const auto& way : ways()) {
            const auto coded = encode(*frames, way.options);
            if (!coded) {
                std::printf("%-20s %-10s %s\n", name.c_str(), way.name, coded.error().message.c_str());
                ++failures;
                continue;
            }
            std::printf("%-20s %-10s %3d packets %8lu bytes  %08lx\n", name.c_str(), way.name, coded->packets,
                        static_cast<unsigned long>(coded->bytes.size()),
                        static_cast<unsigned long>(htvm::internal::crc32(coded->bytes)));
        }
    }
    return failures > 0 ? 1 : 0;
}
