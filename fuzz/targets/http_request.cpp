// What a web client sends: paths never lead out of the folder, parts lie within the file.
#include "live/files/http_request.h"

#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    fuzz::FuzzInput input(data, size);
    const std::uint64_t file_size = input.u64() >> (input.u8() % 64);
    const auto rest = input.rest();
    const std::string text(rest.begin(), rest.end());
    if (const auto segments = live::path_segments(text)) {
        fuzz::require(segments->size() <= 16, "paths are short");
        for (const auto& segment : *segments) {
            fuzz::require(!segment.empty() && segment.front() != '.', "no segment leads upwards or is hidden");
            fuzz::require(segment.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos,
                          "a segment is one name");
        }
    }
    if (const auto value = live::query_value(text, "key"))
        fuzz::require(value->find_first_of(std::string_view("\n\0", 2)) == std::string::npos, "a value is one line");
    const auto part = live::requested_part(text, file_size);
    fuzz::require(part.kind != live::FilePart::Kind::part ||
                      (part.count > 0 && part.first < file_size && part.count <= file_size - part.first),
                  "a part lies within the file");
    live::names_tag(text, "\"tag\"");
    live::accepts_gzip(text);
    return 0;
}
