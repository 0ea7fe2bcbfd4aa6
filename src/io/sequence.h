// Sequences of mesh files, one a frame: which files a name given by a person means, and what decoded frames are called.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

struct SequenceFiles {
    std::vector<std::filesystem::path> paths;  // one a frame, in order; never empty
    std::vector<std::uint64_t> numbers;  // each name's number, where given by a %d pattern; else empty. Gaps show here
};

// The files that `what` means, which is, tried in this order:
// - the name of a file: that one;
// - a folder: its mesh files (.ply, .obj, .drc; hidden ones not) in natural order;
// - a name with one %d or %05d in its last part: the files there are of that name with any number (with %05d of at
//   least five digits, padded by zeros), by rising number; the first need not be 0 and numbers may be missing;
// - a name with * (any characters) or ? (one character) in its last part: the mesh files that match, in natural order.
// Fails (bad_input) where nothing is found, saying what was looked for and what is there instead, and where a folder or
// a glob means files of different formats (each frame twice, most likely).
Result<SequenceFiles> find_sequence(std::string_view what);

// True where a comes before b: letters by code, runs of digits by their number (2 before 10), equal numbers by fewer
// leading zeros.
bool natural_less(std::string_view a, std::string_view b);

// True where `text` as a whole matches `glob`: * for any characters or none, ? for one, all else for itself.
bool glob_matches(std::string_view glob, std::string_view text);

// How frames written to files are named.
struct OutputNames {
    std::filesystem::path folder;
    std::string prefix;     // before the number
    std::string suffix;     // after it, with the extension
    int digits = 5;         // of the number, padded by zeros
    bool one_file = false;  // no number: a name for one frame alone
};

// From a pattern (`out/frame_%05d.obj`), a folder (`out/`, or a name without extension: `out/00000.ply` and so on with
// `extension`), or the name of one file (`frame.ply`: one_file). Fails (bad_input, unsupported) where the pattern is
// not a single %d or %0Nd in the last part, or the extension is not one that is written (.ply, .obj).
Result<OutputNames> output_names(std::string_view what, std::string_view extension = ".ply");

// The file for frame n.
std::filesystem::path output_path(const OutputNames& names, std::uint64_t n);

}  // namespace htvm
