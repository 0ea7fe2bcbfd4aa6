// Sequences of mesh files, one per frame: which files a name given by the user refers to, and how decoded frames are
// named.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "io/mesh_reading.h"
#include "io/sequence_names.h"

namespace htvm {

struct Recording;  // io/recording.h

struct SequenceFiles {
    std::vector<std::filesystem::path> paths;  // one per frame, in order; never empty
    std::vector<std::uint64_t> numbers;        // of the frames, by the names, ascending; empty if the names have none
    std::vector<MeshRemark> remarks = {};      // what was left out or guessed, clauses behind the sequence's name
    std::shared_ptr<const Recording> recording = nullptr;  // that the frames are of; null: they are files by themselves
};

struct SequenceOptions {
    // Globs: files and folders whose name (its last part) matches one are taken as if they were not there. A file that
    // is named by itself is taken all the same.
    std::vector<std::string> ignored = {};
};

// The files that `what` refers to. It may be, tried in this order:
// - the name of a file: that file;
// - a folder: its mesh files (as in mesh_file.h, without hidden ones), in the order of their frames
//   (order_of_frames()); or, if it has none, a mesh of each of its folders that have some, which are then the frames
//   and have the numbers: the only one, or the only one of a name that is in all;
// - a name with one %d or %05d in its last part: the existing files of that name with any number, however many zeros
//   are in front, by ascending number; the first need not be 0 and numbers may be missing;
// - a name with * (any characters) or ? (one character) in its last part: the mesh files that match, as of a folder.
// Copies of other files in a folder or glob, and files that programs have not finished, are left out, with a remark.
// Fails (bad_input) if nothing is found, with what was looked for and what is there instead; and, naming the
// files, if they are more than a sequence of frames: of different formats (whatever the case of their endings), since
// then each frame is most likely there twice; of several captures; with meshes that do not belong to the frames; with
// a number twice. Names of which most are not numbered alike are taken in natural order, with a remark.
Result<SequenceFiles> find_sequence(std::string_view what, const SequenceOptions& options = {});

// The same of several names, as a shell makes them of a pattern: of mesh files of one format. They stay in their order
// unless that is how a shell sorts text: then they are taken by number. A remark says so if they are not by number.
// Copies are left out as those of a folder; what is no frame by its name is one all the same, with a remark.
Result<SequenceFiles> find_sequence(std::span<const std::string> names, const SequenceOptions& options = {});

// The frame's number in each name (order_of_frames()), if the names differ only in numbers and these ascend; else
// empty.
std::vector<std::uint64_t> numbers_in_names(std::span<const std::filesystem::path> paths);

// When each file was captured, in frames since the first: a number that is missing is a frame that is missing, and what
// numbers step by most often (1; 10 if every tenth frame was kept) is one frame. 0, 1, 2 and so on if there are no
// numbers or if they do not count frames (frame_step()).
std::vector<std::uint64_t> places_in_time(const SequenceFiles& files);

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
