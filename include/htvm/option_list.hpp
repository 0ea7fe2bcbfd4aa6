// The encoder's options as a list. The check, the C interface, the command line, its help and docs/options.md are
// derived from it; a dialogue or a binding to another language can be too. An option is one field in
// encoder_options.hpp and one row in src/codec/encoder/encoder_options.cpp.
//
//   for (const htvm::Option& option : htvm::option_list())
//       if (htvm::serves(option.group, options.profile)) show(option.name, htvm::value_text(option,
//       option.get(options)));
//   if (auto set = htvm::set_option(options, "tracked.node_spacing", "60"); !set) show(set.error().message);
//
// Not in the list, because they are not numbers, words or switches: the profile, runner, floor, metadata, global shift,
// skeleton, radii, intra_coder, first_pass, texture.
//
// Threads and lifetimes. The list is constant, lives as long as the program, and may be read by any thread at any time.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "htvm/encoder_options.hpp"
#include "htvm/result.hpp"

namespace htvm {

enum class OptionGroup : std::uint8_t { common, rate, tracked, topology };

enum class OptionKind : std::uint8_t {
    number,
    whole_number,
    on_or_off,  // 1 or 0
    word,       // one of Option::words, given by its index
};

struct Option {
    const char* name;  // the field's path in EncoderOptions: "key_interval", "tracked.node_spacing"
    OptionGroup group;
    OptionKind kind;
    const char* unit = "";       // "mm", "frames"; "": none
    double least = 0, most = 1;  // range of numbers; both ends are allowed
    const char* zero = "";       // what 0 means if it has a special meaning; it is then allowed besides the range
    const char* meaning;         // in one line
    std::span<const char* const> words = {};
    double (*get)(const EncoderOptions&);
    void (*set)(EncoderOptions&, double);  // the value must be in range and, except for numbers, whole: see
                                           // set_option()

    const char* flag = "";       // on the command line; "": it has none
    const char* flag_unit = "";  // "": as `unit`
    double flag_factor = 1;      // factor from the command line's unit to `unit`
    bool flag_off = false;       // for a switch: the flag turns it off
};

std::span<const Option> option_list();

// nullptr if no option has that name.
const Option* find_option(std::string_view name);
// The option whose name, last part of the name or flag is most similar.
const Option& nearest_option(std::string_view name);
// bad_input with a message that names the most similar option.
Error no_such_option(std::string_view name);

// bad_input if there is no such option, if the text is not a value for it, or if the value is out of range.
// Encoder::create() checks whether options fit together.
Result<void> set_option(EncoderOptions& options, std::string_view name, double value);
// text: a number with a decimal point, "on" or "off", or one of the words.
Result<void> set_option(EncoderOptions& options, std::string_view name, std::string_view text);
Result<double> parse_value(const Option& option, std::string_view text);
// bad_input if the value is out of range or, except for numbers, not whole.
Result<void> check_value(const Option& option, double value);

// In the form that set_option() reads: "0.12", "off", "motion".
std::string value_text(const Option& option, double value);
// "0.01 to 3600 s", "0, or 1 to 1024", "on or off", "bone or any".
std::string range_text(const Option& option);
// The meaning of the option, including that of 0.
std::string meaning_text(const Option& option);

// Whether options of the group have an effect in the profile. Those of other groups must stay at their defaults.
bool serves(OptionGroup group, Profile profile);
const char* group_name(OptionGroup group);  // "common", "rate", "tracked", "topology"
const char* profile_name(Profile profile);  // "tracked", "topology", "paper"

}  // namespace htvm
