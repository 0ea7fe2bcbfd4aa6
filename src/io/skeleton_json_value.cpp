#include "io/skeleton_json_value.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/skeleton_track.h"

namespace htvm {
namespace {

using nlohmann::json;

Result<std::uint16_t> joint_index(const json& value, const std::vector<std::string>& names) {
    if (value.is_string()) {
        const auto& name = value.get_ref<const std::string&>();
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) return fail(ErrorKind::bad_input, "no joint is named \"" + name + "\"");
        return static_cast<std::uint16_t>(found - names.begin());
    }
    if (!value.is_number_integer()) return fail(ErrorKind::bad_input, "a joint must be an index or a name");
    // Negative numbers become huge, and are refused as too large.
    const auto index =
        value.is_number_unsigned() ? value.get<std::uint64_t>() : static_cast<std::uint64_t>(value.get<std::int64_t>());
    if (index >= names.size())
        return fail(ErrorKind::bad_input, "joint " + value.dump() + " is not one of the " +
                                              std::to_string(names.size()) + " joints (the first is 0)");
    return static_cast<std::uint16_t>(index);
}

bool same_member(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    std::size_t i = 0, j = 0;
    for (;;) {
        while (i < a.size() && a[i] == '_') ++i;
        while (j < b.size() && b[j] == '_') ++j;
        if (i == a.size() || j == b.size()) return i == a.size() && j == b.size();
        if (lower(a[i++]) != lower(b[j++])) return false;
    }
}

bool is_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '#' ||
           c == '+' || c == '-';
}

// The text with null in place of words for numbers that are none, outside of strings.
std::string with_nulls(std::string_view text) {
    std::string out;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size();) {
        if (in_string || !is_word(text[i])) {
            if (text[i] == '"') in_string = !in_string;
            if (in_string && text[i] == '\\' && i + 1 < text.size()) out += text[i++];
            out += text[i++];
            continue;
        }
        std::size_t end = i;
        while (end < text.size() && is_word(text[end])) ++end;
        auto word = text.substr(i, end - i);
        i = end;
        const auto unsigned_word = word.substr(word.front() == '-' || word.front() == '+' ? 1 : 0);
        for (const std::string_view begin : {"nan", "infinity", "inf", "1.#", "undefined", "none"})
            if (unsigned_word.size() >= begin.size() && same_member(unsigned_word.substr(0, begin.size()), begin))
                word = "null";
        out += word;
    }
    return out;
}

Result<json> parse_strictly(std::string_view text) {
    // The parser reports errors by exceptions, this library by values.
    try {
        return json::parse(text.begin(), text.end());
    } catch (const json::parse_error& error) {
        return fail(ErrorKind::bad_input, "not valid JSON at byte " + std::to_string(error.byte) +
                                              ": the file is damaged, cut off or of another format");
    } catch (const json::exception&) {
        return fail(ErrorKind::bad_input, "the JSON holds a number that no double can hold");
    }
}

}  // namespace

tl::unexpected<Error> fail_at(const std::string& place, const Error& error) {
    return fail(error.kind, place + ": " + error.message);
}

Result<json> parse_json(std::string_view text) {
    auto document = parse_strictly(text);
    if (document) return document;
    const auto changed = with_nulls(text);
    auto mended = changed == text ? document : parse_strictly(changed);
    return mended ? mended : document;
}

const json* find_member(const json& value, const char* name) {
    if (!value.is_object()) return nullptr;
    auto found = value.find(name);
    for (auto member = value.begin(); found == value.end() && member != value.end(); ++member)
        if (same_member(member.key(), name)) found = member;
    return found == value.end() || found->is_null() ? nullptr : &*found;
}

Result<double> finite_number(const json& value) {
    if (!value.is_number()) return fail(ErrorKind::bad_input, "is not a number");
    const double number = value.get<double>();
    if (!std::isfinite(number)) return fail(ErrorKind::bad_input, "is not finite");
    return number;
}

Result<std::optional<Vector3d>> point_or_null(const json& value, double scale) {
    constexpr std::array names = {"x", "y", "z"};
    if (value.is_null()) return std::optional<Vector3d>();
    if (!value.is_object() && (!value.is_array() || value.size() != names.size()))
        return fail(ErrorKind::bad_input, "must be [x, y, z], or null where it is not tracked");
    Vector3d point{};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const json* coordinate = value.is_object() ? find_member(value, names[i]) : &value[i];
        if (!coordinate || coordinate->is_null()) return std::optional<Vector3d>();
        const auto number = finite_number(*coordinate);
        if (!number)
            return fail(ErrorKind::bad_input, "its coordinate " + std::to_string(i) + " " + number.error().message);
        point[i] = *number * scale;
        if (std::abs(point[i]) > max_joint_coordinate)
            return fail(ErrorKind::bad_input, "lies more than 1000 km from the origin; check the units");
    }
    return std::optional<Vector3d>(point);
}

Result<std::vector<std::string>> joint_names(const json& value) {
    if (!value.is_array() || value.empty())
        return fail(ErrorKind::bad_input, "must be a list of joint names, at least one");
    if (value.size() > max_skeleton_joints)
        return fail(ErrorKind::limit, std::to_string(value.size()) + " joints are more than the limit of " +
                                          std::to_string(max_skeleton_joints));
    std::vector<std::string> names;
    for (const json& name : value) {
        if (!name.is_string())
            return fail(ErrorKind::bad_input, "entry " + std::to_string(names.size()) + " is not a string");
        names.push_back(name.get<std::string>());
    }
    return names;
}

Result<std::vector<Bone>> bone_pairs(const json& value, const std::vector<std::string>& names) {
    if (!value.is_array() || value.empty())
        return fail(ErrorKind::bad_input, "must be a list of [first joint, second joint], at least one");
    if (value.size() > max_skeleton_bones)
        return fail(ErrorKind::limit, std::to_string(value.size()) + " bones are more than the limit of " +
                                          std::to_string(max_skeleton_bones));
    std::vector<Bone> bones;
    for (const json& pair : value) {
        const std::string place = "bone " + std::to_string(bones.size());
        if (!pair.is_array() || pair.size() != 2)
            return fail(ErrorKind::bad_input, place + ": must be [first joint, second joint]");
        const auto first = joint_index(pair[0], names), second = joint_index(pair[1], names);
        if (!first) return fail_at(place, first.error());
        if (!second) return fail_at(place, second.error());
        if (*first == *second) return fail(ErrorKind::bad_input, place + ": joins a joint to itself");
        bones.push_back({*first, *second});
    }
    return bones;
}

}  // namespace htvm
