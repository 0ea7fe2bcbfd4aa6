// Which of the bodies that a sensor saw is the subject.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "htvm/skeleton.hpp"

namespace htvm {

struct AzureBody {
    std::int64_t id = 0;
    std::optional<Vector3d> place;  // mm; nothing: no joint is tracked
};

using AzureBodies = std::vector<AzureBody>;  // of one frame

// For each frame, the place of the subject in its list; nothing where it is not seen. The subject is the body seen in
// most frames (of equals, the one seen first), together with those which a tracker that lost it took for new ones: of
// other ids, in no frame together with it, and first or last seen within a metre of where it was. Notes say so.
std::vector<std::optional<std::size_t>> choose_azure_body(const std::vector<AzureBodies>& frames,
                                                          std::vector<std::string>& notes);

}  // namespace htvm
