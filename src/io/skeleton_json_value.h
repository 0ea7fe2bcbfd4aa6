// Checked access to parsed JSON, shared by the skeleton readers. Error messages say what is wrong, not where: the
// caller knows the frame and the joint and prepends them.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"

namespace htvm {

// Parses a JSON text (UTF-8; a byte order mark is skipped). NaN, Infinity and the like, which many programs write,
// become null. Error: bad_input with the byte at which it stops being JSON.
Result<nlohmann::json> parse_json(std::string_view text);

// The member of an object, else the first whose name differs in case and underscores alone (bodyId for body_id);
// nullptr if the value is not an object, has no such member, or the member is null.
const nlohmann::json* find_member(const nlohmann::json& value, const char* name);

// A finite number.
Result<double> finite_number(const nlohmann::json& value);

// [x, y, z] or {"x": x, "y": y, "z": z} times `scale`, in mm; nullopt for null, and if a coordinate is null. Error: not
// three finite numbers, or beyond max_joint_coordinate.
Result<std::optional<Vector3d>> point_or_null(const nlohmann::json& value, double scale);

// A non-empty list of names, at most max_skeleton_joints.
Result<std::vector<std::string>> joint_names(const nlohmann::json& value);

// A non-empty list of [first, second], each an index < names.size() or one of the names; first differs from second;
// at most max_skeleton_bones.
Result<std::vector<Bone>> bone_pairs(const nlohmann::json& value, const std::vector<std::string>& names);

// Prepends a place to an error's message: "PLACE: MESSAGE".
tl::unexpected<Error> fail_at(const std::string& place, const Error& error);

}  // namespace htvm
