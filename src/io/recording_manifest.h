// The manifests of recordings (recording.h), parsed; each gives nothing if the JSON is not of its kind.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "htvm/result.hpp"
#include "io/recording.h"

namespace htvm::internal {

using MaybeRecording = Result<std::optional<Recording>>;

MaybeRecording scandy_recording(const nlohmann::json& manifest, const std::filesystem::path& folder);
MaybeRecording universal_recording(const nlohmann::json& manifest, const std::filesystem::path& folder);
MaybeRecording geometry_sequence_recording(const nlohmann::json& manifest, const std::filesystem::path& folder);
MaybeRecording depthkit_recording(const nlohmann::json& manifest, const std::filesystem::path& folder);

// A file of the folder or below it, by the name that a manifest gives: as it is, or without the folders of another
// machine before it.
std::optional<std::filesystem::path> recorded_file(const std::filesystem::path& folder, std::string name);

// The files of a folder with one of these extensions (lower case, with the dot), in natural order.
std::vector<std::filesystem::path> files_with(const std::filesystem::path& folder,
                                              std::initializer_list<std::string_view> extensions);

}  // namespace htvm::internal
