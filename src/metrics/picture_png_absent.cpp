// In place of picture_png.cpp where there is no libpng.
#include "metrics/render.h"
#include "metrics/smooth_picture.h"

namespace htvm {
namespace {

tl::unexpected<Error> without_png() {
    return fail(ErrorKind::unsupported, "this htvm was built without PNG images, so it cannot write pictures");
}

}  // namespace

Result<void> write_png(const Picture&, const std::string&) { return without_png(); }
Result<std::vector<std::uint8_t>> png_of(const SmoothPicture&, const std::optional<Colour>&) { return without_png(); }

}  // namespace htvm
