// The sound of a stream as a file: packets of any bytes, that lie anywhere. What is written is as long as it says, and
// Opus is read again.
#include "sound/stream_sound.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "fuzz_input.h"
#include "io/ogg_opus.h"

namespace {

using namespace htvm;
using fuzz::require;

const std::filesystem::path& folder() {
    static const auto made = [] {
        auto out = std::filesystem::temp_directory_path() / ("htvm-fuzz-sound-" + std::to_string(getpid()));
        std::filesystem::create_directories(out);
        std::atexit([] { std::filesystem::remove_all(folder()); });
        return out;
    }();
    return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const bool wav = input.flag();
    std::vector<SoundPiece> pieces;
    // Within twenty seconds: what is longer takes time alone.
    constexpr std::int64_t most = 20 * 48000;
    std::int64_t at = 0;
    while (input.left() > 0 && pieces.size() < 50) {
        if (input.flag()) at = static_cast<std::int64_t>(input.below(2 * most)) - most;
        Packet packet;
        packet.kind = PacketKind::audio;
        const auto bytes = input.take(input.below(300));
        packet.payload.assign(bytes.begin(), bytes.end());
        auto audio = read_audio(packet);
        if (!audio) continue;
        const auto samples = static_cast<std::int64_t>(audio->samples());
        pieces.push_back({std::move(*audio), at});
        at += samples;
    }
    const auto path = folder() / (wav ? "sound.wav" : "sound.opus");
    const auto written = write_stream_sound(path, std::move(pieces), most);
    if (!written) return 0;
    if (wav) {
        const auto bytes = 2 * static_cast<std::uint64_t>(written->channels) * written->samples;
        require(std::filesystem::file_size(path) == 44 + bytes, "a WAV is as long as it says");
    } else {
        const auto track = read_ogg_opus(path);
        require(track && track->samples == written->samples, "the Opus that is written is read again");
    }
    return 0;
}
