#include "metrics/presence_change.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace htvm {
namespace {

// A surface that stays until the next frame has been held against it.
struct HeldSurface {
    Mesh mesh;
    std::optional<SearchedSurface> searched;
    std::vector<SurfaceSample> samples;
};

Result<std::unique_ptr<const HeldSurface>> hold(const Mesh& mesh, const CoverageOptions& options) {
    auto out = std::make_unique<HeldSurface>();
    out->mesh.positions = mesh.positions;
    out->mesh.triangles = mesh.triangles;
    auto searched = SearchedSurface::build(out->mesh, options.threads);
    if (!searched) return tl::unexpected(searched.error());
    out->searched = std::move(*searched);
    out->samples = so_many_samples_on(out->mesh, options.samples);
    return std::unique_ptr<const HeldSurface>(std::move(out));
}

AreaChange change_between(const HeldSurface& before, const HeldSurface& now, const CoverageOptions& options) {
    const SurfaceCoverage of_now = surface_coverage(*now.searched, now.samples, *before.searched, options);
    const SurfaceCoverage of_before = surface_coverage(*before.searched, before.samples, *now.searched, options);
    return {of_now.area, of_now.absent, of_before.absent, of_now.covered};
}

}  // namespace

struct PresenceMeter::Frame {
    std::unique_ptr<const HeldSurface> captured, shown;
};

PresenceMeter::PresenceMeter(CoverageOptions options) : options_(options) {}
PresenceMeter::PresenceMeter(PresenceMeter&&) noexcept = default;
PresenceMeter& PresenceMeter::operator=(PresenceMeter&&) noexcept = default;
PresenceMeter::~PresenceMeter() = default;

void PresenceMeter::begin_anew() { before_.reset(); }

Result<std::optional<PresenceChange>> PresenceMeter::add(const Mesh& captured, const Mesh& shown) {
    if (const auto ok = check_measurable(captured, "original"); !ok) return tl::unexpected(ok.error());
    if (const auto ok = check_measurable(shown, "decoded mesh"); !ok) return tl::unexpected(ok.error());
    auto first = hold(captured, options_);
    if (!first) return tl::unexpected(first.error());
    auto second = hold(shown, options_);
    if (!second) return tl::unexpected(second.error());
    const auto before =
        std::exchange(before_, std::make_unique<const Frame>(Frame{std::move(*first), std::move(*second)}));
    if (!before) return std::optional<PresenceChange>{};
    return std::optional(PresenceChange{change_between(*before->captured, *before_->captured, options_),
                                        change_between(*before->shown, *before_->shown, options_)});
}

AreaChange& operator+=(AreaChange& sums, const AreaChange& more) {
    sums.area += more.area;
    sums.appeared += more.appeared;
    sums.vanished += more.vanished;
    sums.covered_before += more.covered_before;
    return sums;
}

PresenceChange& operator+=(PresenceChange& sums, const PresenceChange& more) {
    sums.captured += more.captured;
    sums.shown += more.shown;
    return sums;
}

double changed_share(const AreaChange& change) {
    return change.area > 0 ? (change.appeared + change.vanished) / change.area : 0;
}

double covered_before_share(const AreaChange& change) {
    return change.area > 0 ? change.covered_before / change.area : 1;
}

}  // namespace htvm
