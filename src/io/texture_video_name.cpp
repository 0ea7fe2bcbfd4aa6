#include <algorithm>
#include <iterator>

#include "core/letter_case.h"
#include "io/texture_video.h"

namespace htvm {

bool is_video_file_name(const std::filesystem::path& path) {
    const auto extension = internal::lower_case(path.extension().string());
    return std::ranges::find(video_extensions, extension) != std::end(video_extensions);
}

}  // namespace htvm
