// Sequences of mesh files, one per frame: which files a name given by the user refers to, and how decoded frames are
// named.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

struct SequenceFiles {
    std::vector<std::filesystem::path> paths;  // one per frame, in order; never empty
    std::vector<std::uint64_t> numbers;        // each name's number, ascending; empty if the names have none
};

// The files that `what` refers to. It may be, tried in this order:
// - the name of a file: that file;
// - a folder: its mesh files (as in mesh_file.h, without hidden ones) in natural order;
// - a name with one %d or %05d in its last part: the existing files of that name with any number (with %05d: of at
//   least five digits, padded with zeros), by ascending number; the first need not be 0 and numbers may be missing;
// - a name with * (any characters) or ? (one character) in its last part: the mesh files that match, in natural order.
// Fails (bad_input) if nothing is found, with what was looked for and what is there instead; also if a folder or a glob
// contains files of different formats, since then it most likely contains each frame twice.
Result<SequenceFiles> find_sequence(std::string_view what);

// The same of several names, as a shell makes them of a pattern: of mesh files of one format, which stay in their
// order.
Result<SequenceFiles> find_sequence(std::span<const std::string> names);

// The last number in each name, if the names differ only in it and the numbers ascend; else empty.
std::vector<std::uint64_t> numbers_in_names(std::span<const std::filesystem::path> paths);

// When each file was captured, in frames since the first: a number that is missing is a frame that is missing. The
// most frequent step between numbers (1; 10 if every tenth frame was kept) is one frame. 0, 1, 2 and so on if there are
// no numbers, if not all steps are multiples of that, or if more frames would be missing than there are (numbers that
// are times of a clock).
std::vector<std::uint64_t> places_in_time(const SequenceFiles& files);

// True if a sorts before b: letters by code, runs of digits by their number (2 before 10), equal numbers by fewer
// leading zeros.
bool natural_less(std::string_view a, std::string_view b);

// True if the whole of `text` matches `glob`: * stands for any characters or none, ? for one, everything else for
// itself.
bool glob_matches(std::string_view glob, std::string_view text);

// How frames written to files are named.
struct OutputNames {
    std::filesystem::path folder;
    std::string prefix;     // before the number
    std::string suffix;     // after it, with the extension
    int digits = 5;         // of the number, padded with zeros
    bool one_file = false;  // no number: the name of a single file for a single frame
};

// From a pattern (`out/frame_%05d.obj`), a folder (`out/`, or a name without extension: `out/00000.ply` and so on with
// `extension`), or the name of one file (`frame.ply`: one_file). Fails (bad_input) if the pattern is not a single %d or
// %0Nd in the last part.
Result<OutputNames> output_names(std::string_view what, std::string_view extension);
// The same for meshes. Fails (unsupported) too if the extension is not one that is written (mesh_file.h).
Result<OutputNames> mesh_output_names(std::string_view what, std::string_view extension = ".ply");

// The file for frame n.
std::filesystem::path output_path(const OutputNames& names, std::uint64_t n);

}  // namespace htvm
