// Peers: coders outside this program that join the sweep as a command.
//
// The command runs once a frame through the shell, after these were put into it, files' names quoted:
//   {in}       a binary PLY: the frame in mm, with colours where the capture has some (read it, leave it)
//   {out}      where the command writes the coded frame: the size of this file is what counts
//   {decoded}  where it writes the decoded frame, as PLY in mm, from nothing but {out} if it is to be fair
//   {q}        the sweep's quality, 0..100
//   {step}     that quality's step of positions, mm; {colour_step}, of colours, levels of 255
//   {bits}     the position bits whose cells over a frame's bounding box are nearest to the step
// Exit status 0 is success. Its time, on the wall clock, counts as encoding and decoding together.
#pragma once

#include <map>
#include <string>

#include "rd_coders.h"

namespace htvm::lab {

// From NAME=COMMAND; bad_input unless the name is letters, digits, dots, _ or - and the command names {in}, {out} and
// {decoded}.
Result<CoderUnderTest> peer_under_test(const std::string& name_and_command);

// Every {key} replaced by its value; braces round anything else stay.
std::string substitute(const std::string& text, const std::map<std::string, std::string>& values);

// As one word for the shell, whatever it holds.
std::string quoted_for_shell(const std::string& text);

}  // namespace htvm::lab
