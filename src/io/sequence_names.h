// What the names of a sequence's files say: which belong together, in which order, and which number is the frame's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// True if a sorts before b: letters by code, runs of digits by their number (2 before 10), equal numbers by fewer
// leading zeros.
bool natural_less(std::string_view a, std::string_view b);

// True if the names are in the order in which shells and file managers sort text: by character, or by letters and
// digits alone whatever their case.
bool is_text_order(std::span<const std::string> names);

// Names that differ in their numbers alone: the text around the runs of digits is the same, whatever its case. A '-'
// before a number is its sign if other names lack it there, else text.
struct KindOfNames {
    std::vector<std::size_t> places;  // of its names, ascending
    std::string pattern;              // a %d in place of the number if one varies, a * for each if several do
    std::size_t varying_numbers = 0;  // how many of the numbers in them are not the same for all
};

// The kinds, the largest first; of equally large ones the one that begins first. ending: what follows each name.
std::vector<KindOfNames> kinds_of_names(std::span<const std::string> names, std::string_view ending);

struct FrameOrder {
    std::vector<std::size_t> places;     // of the names, in the order of the frames
    std::vector<std::uint64_t> numbers;  // of the frames, ascending; empty if no number in the names counts them
    std::vector<MeshRemark> remarks;
};

// The order of names of one kind. The frame's number is the one that varies. If several vary, it is one that differs
// in every name: rather one that counts frames (frame_step), then one that steps by 1, then one by which the names
// come in the order of all their numbers, then the last; a remark says which. If none does, as in a date and a time,
// the names are in the order of all their numbers. Two numbers with a point between them are one decimal number if
// they are seconds since 1970 or their digits behind the point differ in number as those of decimal numbers do.
// Numbers below zero make all numbers count from the lowest. Errors (bad_input): the same number in two names, which
// differ in leading zeros; several names for each number, as of levels of detail.
Result<FrameOrder> order_of_frames(std::span<const std::string> names, std::string_view ending);

// The order of names of several kinds that begin alike with a number that counts frames and differs in every name
// ("0001_walk", "0002_run"); nothing of others.
std::optional<FrameOrder> order_by_first_number(std::span<const std::string> names);

// The largest number that all steps of ascending numbers are multiples of, which is one frame: 10 where every tenth
// file was kept. Nothing if they do not count frames: more would be missing than there are (times of a clock).
std::optional<std::uint64_t> frame_step(std::span<const std::uint64_t> numbers);

// The name, without extension, that one is a copy of, as people and file managers mark copies ("f_3 (1)", "f_3 -
// Copy", "f_3_copy"); nothing of others.
std::optional<std::string> original_of_copy(std::string_view name);

// True for the names, without extension, of files that programs have not finished or keep for themselves ("f_3.tmp",
// "~f_3").
bool is_unfinished_name(std::string_view name);

}  // namespace htvm
