#include "rate_sharing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "rate_passes.h"

namespace htvm::app {
namespace {

// log2(bits) for a step of quality: as usual, until two passes tell; and what they may tell.
constexpr double usual_mesh_slope = 0.08, usual_picture_slope = 0.08, least_slope = 0.015, most_slope = 0.2;

double slope_between(double quality_a, double bits_a, double quality_b, double bits_b, double usual) {
    constexpr double far_enough = 2;  // steps: nearer ones tell more of chance
    if (std::abs(quality_a - quality_b) < far_enough || !(bits_a > 0) || !(bits_b > 0)) return usual;
    return std::clamp(std::log2(bits_b / bits_a) / (quality_b - quality_a), least_slope, most_slope);
}

// What meshes and pictures would take at other qualities, from the last pass.
struct Model {
    SharedPass last;
    double mesh_slope = usual_mesh_slope, picture_slope = usual_picture_slope;

    double meshes(double quality) const {
        return last.mesh_bits * std::exp2(mesh_slope * (std::min(quality, 100.0) - last.mesh_quality));
    }
    double pictures(double quality) const {
        return last.picture_bits * std::exp2(picture_slope * (quality - last.picture_quality));
    }
};

constexpr double finest_mesh = 99.5;

// Whether nobody tells the qualities apart, or, after some passes, they at least do not hurt.
bool is_balanced(const SharedPass& pass, std::size_t passes) {
    constexpr std::size_t some = 3;
    const double alike = passes < some ? 8 : 20;  // steps of quality
    return std::abs(pass.mesh_quality - pass.picture_quality) <= alike || pass.mesh_quality >= finest_mesh;
}

Model model_of(const std::vector<SharedPass>& passes) {
    Model out{passes.back()};
    if (passes.size() < 2) return out;
    const auto &a = passes[passes.size() - 2], &b = passes.back();
    out.mesh_slope = slope_between(a.mesh_quality, a.mesh_bits, b.mesh_quality, b.mesh_bits, usual_mesh_slope);
    out.picture_slope =
        slope_between(a.picture_quality, a.picture_bits, b.picture_quality, b.picture_bits, usual_picture_slope);
    return out;
}

// What the meshes are to have for all to take so much, where pictures keep their quality: they change a little with the
// meshes that they are drawn on, as the last two passes tell, if they differed in the meshes alone.
double bits_left_for_meshes(const std::vector<SharedPass>& passes, double wanted) {
    constexpr double least = 0.5, most = 4;  // bits of all for a bit of meshes
    const auto& last = passes.back();
    double for_one = 1;
    if (passes.size() > 1)
        if (const auto& before = passes[passes.size() - 2];
            before.picture_quality == last.picture_quality && before.mesh_bits != last.mesh_bits)
            for_one = std::clamp((last.bits() - before.bits()) / (last.mesh_bits - before.mesh_bits), least, most);
    return last.mesh_bits + (wanted - last.bits()) / for_one;
}

}  // namespace

bool RateSharing::is_met() const {
    return !passes_.empty() && is_balanced(passes_.back(), passes_.size()) &&
           std::abs(passes_.back().bits() / wanted_bits_ - 1) <= rate_tolerance;
}

bool RateSharing::is_finest() const {
    return !passes_.empty() && passes_.back().bits() < wanted_bits_ && passes_.back().mesh_quality >= finest_mesh &&
           passes_.back().picture_quality >= finest_picture_quality - 0.5;
}

RateSharing::Next RateSharing::next() const {
    // Near the rate, pictures stay as they are, whose quantiser has steps of up to a fifth of their bits; meshes, which
    // are controlled, take the rest, as far as they need not change much for it.
    const auto model = model_of(passes_);
    const auto& last = passes_.back();
    const double rest = bits_left_for_meshes(passes_, wanted_bits_);
    constexpr double much = 5;  // steps of quality
    if (is_balanced(last, 0) && last.mesh_quality < finest_mesh && rest > 0 && last.mesh_bits > 0 &&
        std::abs(std::log2(rest / last.mesh_bits)) < much * usual_mesh_slope)
        return {last.picture_quality, rest};
    double low = 0, high = finest_picture_quality;
    for (int i = 0; i < 40; ++i) {
        const double middle = (low + high) / 2;
        (model.meshes(middle) + model.pictures(middle) > wanted_bits_ ? high : low) = middle;
    }
    // Meshes at their finest take what they take, and no more can be asked of them.
    const double of_meshes = std::clamp(model.meshes(low), 0.05 * wanted_bits_, 0.95 * wanted_bits_);
    return {low, of_meshes};
}

}  // namespace htvm::app
