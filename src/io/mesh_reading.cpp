#include "io/mesh_reading.h"

#include <algorithm>
#include <utility>

namespace htvm {

void remark(MeshFindings* findings, const char* about, std::string text, bool is_loss) {
    if (!findings) return;
    auto& all = findings->remarks;
    if (std::any_of(all.begin(), all.end(), [&](const auto& other) { return other.about == about; })) return;
    all.push_back({about, std::move(text), is_loss});
}

}  // namespace htvm
