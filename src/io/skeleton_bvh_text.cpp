#include "io/skeleton_bvh_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "core/letter_case.h"
#include "io/skeleton_track.h"

namespace htvm {

using internal::lower_case;
namespace {

constexpr std::size_t max_channels = 12;  // of one joint

bool is_space(char c) { return static_cast<unsigned char>(c) <= ' '; }
// What commas are in a part of the file.
enum class Commas { letters, decimal, space };

// Words separated by white space, with the line for messages.
struct WordReader {
    std::string_view text;
    std::size_t position = 0;
    std::size_t line = 1;
    Commas commas = Commas::letters;

    void step() {
        // The \n of \r\n counts.
        const bool ends_line = text[position] == '\n' ||
                               (text[position] == '\r' && (position + 1 == text.size() || text[position + 1] != '\n'));
        line += ends_line;
        ++position;
    }
    bool at_comment() const { return text[position] == '#' || text.substr(position, 2) == "//"; }
    bool at_space() const { return is_space(text[position]) || (commas == Commas::space && text[position] == ','); }
    void skip_space() {
        while (position < text.size()) {
            if (at_space()) {
                step();
            } else if (at_comment()) {
                while (position < text.size() && text[position] != '\n' && text[position] != '\r') ++position;
            } else {
                return;
            }
        }
    }
    // The next word; empty at the end. Braces stand alone.
    std::string_view word() {
        skip_space();
        const std::size_t begin = position;
        while (position < text.size() && !at_space() && text[position] != '{' && text[position] != '}') ++position;
        if (position == begin && position < text.size()) ++position;
        return text.substr(begin, position - begin);
    }
    // The rest of the line up to a brace, without surrounding spaces: names may contain spaces.
    std::string_view name() {
        while (position < text.size() && (text[position] == ' ' || text[position] == '\t')) ++position;
        const std::size_t begin = position;
        while (position < text.size() && text[position] != '\n' && text[position] != '\r' && text[position] != '{')
            ++position;
        std::string_view found = text.substr(begin, position - begin);
        while (!found.empty() && is_space(found.back())) found.remove_suffix(1);
        return found;
    }
};

bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return lower_case(x) == lower_case(y); });
}

tl::unexpected<Error> fail_on_line(const WordReader& words, const std::string& message) {
    return fail(ErrorKind::bad_input, "BVH line " + std::to_string(words.line) + ": " + message);
}

// The first characters of a word, in quotes.
std::string quoted(std::string_view word) {
    std::string text("\"");
    text.append(word.substr(0, 40)).append("\"");
    return text;
}

std::string found_instead(std::string_view word) { return word.empty() ? "the end of the file" : quoted(word); }

Result<void> expect_word(WordReader& words, std::string_view expected) {
    const auto found = words.word();
    if (same_word(found, expected)) return {};
    return fail_on_line(words, "expected " + std::string(expected) + ", found " + found_instead(found));
}

// A label such as "Frame Time:", with any spaces between its words and around its colon, or no colon.
Result<void> expect_label(WordReader& words, std::string_view label) {
    auto ahead = words;
    for (const char expected : label) {
        ahead.skip_space();
        if (expected == ' ') continue;
        if (ahead.position == ahead.text.size() || lower_case(ahead.text[ahead.position]) != lower_case(expected))
            return fail_on_line(words, "expected " + std::string(label) + ":, found " + found_instead(words.word()));
        ++ahead.position;
    }
    ahead.skip_space();
    if (ahead.position < ahead.text.size() && ahead.text[ahead.position] == ':') ++ahead.position;
    words = ahead;
    return {};
}

// ---- Numbers --------------------------------------------------------------------------------------------------------

// Finite or not; false if the word is no number.
bool parse_number(std::string_view word, Commas commas, double& value) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    std::array<char, 64> with_point{};
    if (commas == Commas::decimal && word.size() < with_point.size() && word.find(',') != word.npos) {
        std::replace_copy(word.begin(), word.end(), with_point.begin(), ',', '.');
        word = std::string_view(with_point.data(), word.size());
    }
    const auto end = word.data() + word.size();
    const auto result = std::from_chars(word.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
}

bool parse_finite(std::string_view word, Commas commas, double& value) {
    return parse_number(word, commas, value) && std::isfinite(value);
}

// What programs write in place of a number that they do not have.
bool stands_for_no_number(std::string_view word) {
    if (!word.empty() && (word.front() == '-' || word.front() == '+')) word.remove_prefix(1);
    for (const std::string_view begin : {"nan", "inf", "1.#", "1,#", "null", "none", "undefined", "n/a"})
        if (same_word(word.substr(0, begin.size()), begin)) return true;
    return false;
}

// By the words that look like numbers.
Commas commas_of(std::string_view text) {
    bool any = false, points = false, between = false;
    for (std::size_t at = 0; at < text.size();) {
        if (is_space(text[at])) {
            ++at;
            continue;
        }
        const std::size_t begin = at;
        while (at < text.size() && !is_space(text[at])) ++at;
        const auto word = text.substr(begin, at - begin);
        if (word.find_first_not_of("0123456789+-.,eE") != word.npos) continue;
        const auto count = std::count(word.begin(), word.end(), ',');
        any = any || count > 0;
        points = points || word.find('.') != word.npos;
        between = between || count > 1 || word.front() == ',' || word.back() == ',';
    }
    if (!any) return Commas::letters;
    return between || points ? Commas::space : Commas::decimal;
}

// ---- The hierarchy --------------------------------------------------------------------------------------------------

Result<void> read_offset(WordReader& words, BvhJoint& joint) {
    for (double& coordinate : joint.offset)
        if (!parse_finite(words.word(), words.commas, coordinate))
            return fail_on_line(words, "OFFSET of \"" + joint.name + "\" must be three numbers");
    joint.has_offset = true;
    return {};
}

Result<void> read_channels(WordReader& words, BvhJoint& joint) {
    const auto count_word = words.word();
    std::size_t count = 0;
    const auto parsed = std::from_chars(count_word.data(), count_word.data() + count_word.size(), count);
    if (parsed.ec != std::errc() || parsed.ptr != count_word.data() + count_word.size() || count > max_channels)
        return fail_on_line(words, "CHANNELS of \"" + joint.name + "\" must start with their number, at most " +
                                       std::to_string(max_channels));
    if (count > 0 && joint.end_site) return fail_on_line(words, "an end site cannot have CHANNELS");
    if (!joint.channels.empty()) return fail_on_line(words, "\"" + joint.name + "\" has CHANNELS twice");
    for (std::size_t c = 0; c < count; ++c) {
        const auto word = words.word();
        const std::size_t axis = word.empty() ? 3 : static_cast<std::size_t>((word[0] | 0x20) - 'x');
        const auto kind = word.substr(std::min<std::size_t>(1, word.size()));
        if (axis < 3 && same_word(kind, "scale"))
            return fail(ErrorKind::unsupported, "BVH line " + std::to_string(words.line) +
                                                    ": scale channels are not supported; export without them");
        if (axis >= 3 || !(same_word(kind, "position") || same_word(kind, "rotation")))
            return fail_on_line(words, quoted(word) + " is not a channel (Xposition ... Zrotation)");
        joint.channels.push_back({axis, same_word(kind, "rotation")});
    }
    return {};
}

// Adds a joint below `parent` and reads its opening brace.
Result<void> open_joint(WordReader& words, BvhHierarchy& hierarchy, std::size_t parent, bool end_site) {
    BvhJoint joint;
    joint.parent = parent;
    joint.end_site = end_site;
    if (end_site) {
        // Some name it there, for nobody.
        const auto site = words.name();
        const bool is_site = same_word(site.substr(0, 4), "site");
        if (!site.empty() && !is_site) return fail_on_line(words, "expected Site, found " + quoted(site));
        joint.name = hierarchy.joints[parent].name + " end";
    } else {
        joint.name = std::string(words.name());
        if (joint.name.empty()) return fail_on_line(words, "a joint has no name");
    }
    if (const auto brace = expect_word(words, "{"); !brace) return brace;
    if (hierarchy.joints.size() >= max_skeleton_joints)
        return fail(ErrorKind::limit, "BVH line " + std::to_string(words.line) + ": more than the limit of " +
                                          std::to_string(max_skeleton_joints) + " joints");
    hierarchy.joints.push_back(std::move(joint));
    return {};
}

Result<void> close_joint(const WordReader& words, BvhHierarchy& hierarchy, std::size_t index) {
    const BvhJoint& joint = hierarchy.joints[index];
    if (joint.has_offset) return {};
    // An end site, which has no joints in it, is the last one.
    if (!joint.end_site) return fail_on_line(words, "\"" + joint.name + "\" has no OFFSET");
    hierarchy.joints.pop_back();
    return {};
}

Result<BvhHierarchy> read_hierarchy(WordReader& words) {
    BvhHierarchy hierarchy;
    for (const char* keyword : {"HIERARCHY", "ROOT"})
        if (const auto found = expect_word(words, keyword); !found) return tl::unexpected(found.error());
    if (const auto root = open_joint(words, hierarchy, no_bvh_parent, false); !root)
        return tl::unexpected(root.error());
    std::vector<std::size_t> open = {0};
    while (!open.empty()) {
        const std::size_t index = open.back();
        const auto word = words.word();
        Result<void> done;
        const bool end_site = same_word(word, "End") || same_word(word, "EndSite");
        if ((end_site || same_word(word, "JOINT")) && !hierarchy.joints[index].end_site) {
            done = open_joint(words, hierarchy, index, end_site);
            open.push_back(hierarchy.joints.size() - 1);
        } else if (same_word(word, "OFFSET")) {
            done = read_offset(words, hierarchy.joints[index]);
        } else if (same_word(word, "CHANNELS")) {
            done = read_channels(words, hierarchy.joints[index]);
        } else if (word == "}") {
            done = close_joint(words, hierarchy, index);
            open.pop_back();
        } else {
            done = fail_on_line(words, quoted(word) + " does not belong inside \"" + hierarchy.joints[index].name +
                                           "\"" + (word.empty() ? ": the file ends there" : ""));
        }
        if (!done) return tl::unexpected(done.error());
    }
    for (const auto& joint : hierarchy.joints) hierarchy.channel_count += joint.channels.size();
    return hierarchy;
}

// ---- The motion -----------------------------------------------------------------------------------------------------

// A frame time that was rounded to few digits: exactly that of the usual rate that is written so.
double without_rounding(std::string_view word, double seconds) {
    constexpr std::array rates = {30.0,  24.0,  25.0,  50.0,  60.0,  72.0,           75.0,           90.0,
                                  100.0, 120.0, 144.0, 200.0, 240.0, 30000.0 / 1001, 24000.0 / 1001, 60000.0 / 1001};
    const auto point = word.find_first_of(".,");
    if (point == word.npos || word.find_first_of("eE") != word.npos) return seconds;
    const double half_a_digit = 0.5 * std::pow(10.0, -static_cast<double>(word.size() - point - 1));
    if (std::abs(1 / seconds - std::round(1 / seconds)) < 1e-6) return seconds;
    for (const double rate : rates)
        if (std::abs(seconds - 1 / rate) <= half_a_digit) return 1 / rate;
    return seconds;
}

Result<double> read_frame_time(WordReader& words, std::vector<std::string>& notes) {
    constexpr double shortest = 1e-6, longest = 1000;
    const auto word = words.word();
    double seconds = 0;
    const bool is_number = parse_number(word, word.find('.') == word.npos ? Commas::decimal : words.commas, seconds);
    if (!is_number && !stands_for_no_number(word))
        return fail_on_line(words, "Frame Time: must be followed by a number of seconds, found " + found_instead(word));
    if (!is_number || !std::isfinite(seconds) || seconds == 0) {
        notes.push_back("The BVH file does not say its rate (Frame Time: " + std::string(word.substr(0, 40)) + ").");
        return 0.0;
    }
    if (seconds < shortest || seconds > longest)
        return fail_on_line(words, "Frame Time: must be a number of seconds from 0.000001 to 1000");
    const double exact = without_rounding(word, seconds);
    if (std::abs(exact / seconds - 1) > 5e-4)
        notes.push_back("The BVH file's Frame Time of " + std::string(word) + " s is taken as " +
                        std::to_string(std::lround(1 / exact)) + " poses a second, rounded.");
    return exact;
}

// The number of frames that the file declares.
Result<std::size_t> read_frame_count(WordReader& words) {
    const auto first = words.word();
    if (same_word(first, "ROOT"))
        return fail(ErrorKind::unsupported,
                    "BVH line " + std::to_string(words.line) + ": a second ROOT; keep one skeleton in the file");
    if (!same_word(first, "MOTION"))
        return fail_on_line(words, "expected MOTION after the hierarchy, found " + found_instead(first));
    if (const auto found = expect_label(words, "Frames"); !found) return tl::unexpected(found.error());
    const auto count = words.word();
    std::size_t frames = 0;
    const auto parsed = std::from_chars(count.data(), count.data() + count.size(), frames);
    if (parsed.ec != std::errc() || parsed.ptr != count.data() + count.size())
        return fail_on_line(words, "Frames: must be followed by their number");
    return frames;
}

// What ended the frames.
enum class End { file, within_frame, other_text };

// A frame, or what is there instead.
struct FrameOrEnd {
    std::optional<BvhFrame> frame;
    End end = End::file;
};

Result<FrameOrEnd> read_frame(WordReader& words, const BvhHierarchy& hierarchy, std::size_t frame, bool is_declared) {
    BvhFrame out;
    out.values.resize(hierarchy.channel_count);
    std::size_t next = 0;
    bool all_numbers = true;
    for (const auto& joint : hierarchy.joints)
        for (std::size_t c = 0; c < joint.channels.size(); ++c, ++next) {
            const auto word = words.word();
            if (word.empty()) return FrameOrEnd{{}, next == 0 ? End::file : End::within_frame};
            double& value = out.values[next];
            const bool is_number = parse_number(word, words.commas, value);
            all_numbers = all_numbers && is_number && std::isfinite(value);
            if (is_number || stands_for_no_number(word)) continue;
            // A recording that was interrupted may end within a number.
            if (words.position == words.text.size() && next > 0) return FrameOrEnd{{}, End::within_frame};
            if (!is_declared && next == 0) return FrameOrEnd{{}, End::other_text};
            return fail_on_line(words, "frame " + std::to_string(frame) + " (the first is 0), channel " +
                                           std::to_string(c) + " of joint \"" + joint.name + "\": " + quoted(word) +
                                           " is not a number");
        }
    if (!all_numbers) out.values.clear();
    return FrameOrEnd{std::move(out), {}};
}

void say_what_was_there(BvhText& out, std::size_t declared, End end) {
    const std::size_t found = out.frames.size();
    const bool cut = end == End::within_frame;
    if (found != declared || cut)
        out.notes.push_back("The BVH file declares " + std::to_string(declared) + " frames and holds " +
                            std::to_string(found) + (cut ? " and a part of another" : "") + ": " +
                            (cut ? "the whole ones are taken." : "these are taken."));
    if (end == End::other_text)
        out.notes.push_back("The BVH file goes on after its " + std::to_string(found) +
                            " frames: the rest is ignored.");
    std::size_t broken = 0, first = 0;
    for (std::size_t t = found; t-- > 0;)
        if (out.frames[t].values.empty()) ++broken, first = t;
    if (broken > 0)
        out.notes.push_back("In " + std::to_string(broken) + " of " + std::to_string(found) +
                            " frames of the BVH file, the first of them frame " + std::to_string(first) +
                            " (the first is 0), values are not numbers: these frames are taken as missing.");
}

Result<void> read_frames(WordReader& words, std::size_t declared, BvhText& out) {
    const std::size_t joints = out.hierarchy.joints.size();
    if (out.hierarchy.channel_count == 0) return fail_on_line(words, "the skeleton has no CHANNELS, and so no motion");
    words.commas = commas_of(words.text.substr(words.position));
    if (words.commas == Commas::decimal) out.notes.push_back("The BVH file writes its numbers with decimal commas.");
    End end = End::file;
    bool any = false;
    for (;;) {
        auto frame = read_frame(words, out.hierarchy, out.frames.size(), out.frames.size() < declared);
        if (!frame) return tl::unexpected(frame.error());
        end = frame->end;
        if (!frame->frame) break;
        any = any || !frame->frame->values.empty();
        out.frames.push_back(std::move(*frame->frame));
        // Poses take memory in proportion to the joints, of which a hierarchy can have many with few channels.
        if (out.frames.size() * joints > std::max<std::size_t>(words.text.size(), 1 << 16))
            return fail(ErrorKind::limit, "BVH line " + std::to_string(words.line) + ": more than " +
                                              std::to_string(out.frames.size() - 1) + " frames of " +
                                              std::to_string(joints) +
                                              " joints are far more than the file has values for");
    }
    if (out.frames.empty())
        return fail_on_line(words, "there is no frame of motion, only the skeleton at rest; export it with its motion");
    if (!any) return fail_on_line(words, "no frame has numbers for all channels");
    say_what_was_there(out, declared, end);
    return {};
}

}  // namespace

Result<BvhText> read_bvh_text(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    WordReader words{text};
    // The last one: a joint may have the word in its name.
    std::size_t motion = text.size();
    for (std::size_t at = text.size(); at-- > 0 && motion == text.size();)
        if ((at == 0 || is_space(text[at - 1]) || text[at - 1] == '}') && same_word(text.substr(at, 6), "MOTION"))
            motion = at;
    words.commas = commas_of(text.substr(0, motion));
    auto hierarchy = read_hierarchy(words);
    if (!hierarchy) return tl::unexpected(hierarchy.error());
    if (hierarchy->joints.size() < 2)
        return fail(ErrorKind::bad_input, "the BVH hierarchy has a single joint and so no bone");
    BvhText out;
    out.hierarchy = std::move(*hierarchy);
    words.commas = Commas::letters;
    const auto declared = read_frame_count(words);
    if (!declared) return tl::unexpected(declared.error());
    if (const auto label = expect_label(words, "Frame Time"); !label) return tl::unexpected(label.error());
    const auto frame_time = read_frame_time(words, out.notes);
    if (!frame_time) return tl::unexpected(frame_time.error());
    out.frame_time = *frame_time;
    if (const auto read = read_frames(words, *declared, out); !read) return tl::unexpected(read.error());
    return out;
}

}  // namespace htvm
