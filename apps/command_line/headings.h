// The headings under which --help-all and the man pages list options: the same thing has the same heading in every
// command.
#pragma once

namespace htvm::app::heading {

inline constexpr const char* input = "Input";
inline constexpr const char* output = "Output";
inline constexpr const char* quality = "Quality and rate";
inline constexpr const char* textures = "Textures";
inline constexpr const char* skeleton = "Skeleton";
inline constexpr const char* sound = "Sound";
inline constexpr const char* live = "Live streams and a camera's pace";
inline constexpr const char* parallel = "Many processors, many machines";
inline constexpr const char* tracked = "Tracked frames (--profile tracked, the default)";
inline constexpr const char* experiments = "Published experiments (--profile topology or paper)";
inline constexpr const char* scene = "What the stream says of the capture";
inline constexpr const char* pictures = "Pictures that are drawn";
inline constexpr const char* measurements = "Measurements";
inline constexpr const char* limits = "Limits, for untrusted streams";
inline constexpr const char* scripts = "Scripts and runs that can be repeated";

}  // namespace htvm::app::heading
