// In place of opus_track.cpp, sound_file.cpp and stream_sound.cpp where there are no libopus, libsndfile and
// libsamplerate.
#include "sound/opus_track.h"
#include "sound/stream_sound.h"

namespace htvm {
namespace {

tl::unexpected<Error> without_sound(const std::filesystem::path& path, const char* what) {
    return fail(ErrorKind::unsupported, path.string() + ": this htvm was built without sound, so it cannot " + what);
}

}  // namespace

Result<OpusTrack> read_opus_track(const std::filesystem::path& path, const OpusFileOptions&) {
    return without_sound(path, "read it");
}

Result<SoundFileSummary> write_stream_sound(const std::filesystem::path& path, std::vector<SoundPiece>, std::int64_t) {
    return without_sound(path, "write it");
}

}  // namespace htvm
