#include "core/letter_case.h"
#include "sound/stream_sound.h"

namespace htvm {

bool is_written_sound_name(const std::filesystem::path& path) {
    const auto extension = internal::lower_case(path.extension().string());
    return extension == ".wav" || extension == ".opus" || extension == ".ogg" || extension == ".oga";
}

}  // namespace htvm
