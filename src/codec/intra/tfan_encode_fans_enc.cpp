#include "codec/intra/tfan_encode_fans.h"

namespace htvm::internal {

FocusLinks::FocusLinks(std::uint32_t vertex_count, std::span<const Triangle> triangles)
    : triangles_(triangles),
      first_corner_(std::size_t{vertex_count} + 1),
      corner_triangle_(triangles.size() * 3),
      coded_(triangles.size()),
      head_(vertex_count, none),
      arriving_(vertex_count) {
    for (const Triangle& triangle : triangles)
        for (const std::uint32_t vertex : triangle) ++first_corner_[vertex + 1];
    for (std::size_t v = 0; v < vertex_count; ++v) first_corner_[v + 1] += first_corner_[v];
    std::vector<std::uint32_t> at(first_corner_.begin(), first_corner_.end() - 1);
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
        for (const std::uint32_t vertex : triangles[t]) corner_triangle_[at[vertex]++] = t;
}

void FocusLinks::gather(std::uint32_t focus) {
    links_.clear();
    unled_cursor_ = cursor_ = 0;
    for (std::uint32_t c = first_corner_[focus]; c < first_corner_[focus + 1]; ++c) {
        const std::uint32_t t = corner_triangle_[c];
        if (coded_[t]) continue;  // also the second corner that a degenerate triangle has here
        coded_[t] = true;
        const Triangle& triangle = triangles_[t];
        const std::size_t corner = triangle[0] == focus ? 0 : triangle[1] == focus ? 1 : 2;
        links_.push_back({triangle[(corner + 1) % 3], triangle[(corner + 2) % 3], none});
    }
    remaining_ = links_.size();
    for (std::size_t i = links_.size(); i-- > 0;) {  // backwards, so that each vertex's first link is found first
        links_[i].next = head_[links_[i].from];
        head_[links_[i].from] = static_cast<std::uint32_t>(i);
        ++arriving_[links_[i].to];
    }
}

std::uint32_t FocusLinks::any_start() {
    for (; unled_cursor_ < links_.size(); ++unled_cursor_) {
        const std::uint32_t from = links_[unled_cursor_].from;
        if (head_[from] != none && arriving_[from] == 0) return from;
    }
    while (head_[links_[cursor_].from] == none) ++cursor_;
    return links_[cursor_].from;
}

std::uint32_t FocusLinks::follow(std::uint32_t vertex) {
    const Link& link = links_[head_[vertex]];
    head_[vertex] = link.next;
    --arriving_[link.to];
    --remaining_;
    return link.to;
}

}  // namespace htvm::internal
