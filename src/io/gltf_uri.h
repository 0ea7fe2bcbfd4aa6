// URIs as glTF files have them: bytes in the text itself, or the name of a file. Programs escape spaces or not, and
// some write backslashes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace htvm::internal {

bool is_data_uri(std::string_view uri);

// What a data: URI holds, as Base64 or as escaped text, whatever it says of its type; nothing if it is damaged.
std::optional<std::vector<std::uint8_t>> content_of_data_uri(std::string_view uri);

// The name of the file in that folder that a URI means: without its escapes or as it is, with slashes, without a query.
// Where none is there, the first of these. Nothing if the URI leads elsewhere by a scheme ("http:", "C:"), or is no
// name.
std::optional<std::string> name_in_uri(std::string_view uri, const std::filesystem::path& folder);

}  // namespace htvm::internal
