#include "codec/encoder/configuration.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "codec/encoder/tracking_numbers.h"
#include "core/geometry.h"
#include "surface/open_border.h"

namespace htvm::internal {
namespace {

bool tells_presence(const EncoderOptions& options, const Mesh& first) {
    if (options.tracked.presence != SurfacePresence::automatic) return options.tracked.presence == SurfacePresence::on;
    // What one camera sees comes and goes.
    if (options.texture.layout == TextureLayout::projection) return true;
    return options.key_interval > 1 && comes_and_goes(first.positions, first.triangles);
}

// The length on this subject that corresponds to a millimetre on an adult, in millimetres. Reaches, spacings and
// thresholds are known for adults; those for a doll or a giant follow from its size. The extent of an adult depends on
// the pose, so a subject from 1.1 to 2.5 m counts as an adult. What is smaller and seen from some sides alone may be a
// part of one, as a head and shoulders before a phone: so its edges count, too, which on an adult are 8 mm long.
double adult_millimetre(const EncoderOptions& options, const Mesh& mesh, bool may_be_a_part) {
    constexpr double adult = 1750, shortest = 1100, longest = 2500;
    double size = options.subject_size;
    if (!(size > 0)) {
        for (std::size_t axis = 0; axis < 3 && !mesh.positions.empty(); ++axis) {
            const auto [low, high] =
                std::minmax_element(mesh.positions.begin(), mesh.positions.end(),
                                    [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
            size = std::max(size, static_cast<double>((*high)[axis]) - (*low)[axis]);
        }
    }
    if (size <= 0 || (size >= shortest && size <= longest)) return 1;
    if (!may_be_a_part || size > longest || options.subject_size > 0) return size / adult;
    constexpr double usual_edge = 8;
    const double edge = mean_edge(std::span<const Vector3f>(mesh.positions), mesh.triangles, 8);
    return std::clamp(edge / usual_edge, size / adult, 1.0);
}

// 1/16 mm on an adult and on whoever is larger, or finer if needed for a step of at least eight units. As much finer on
// a smaller subject as it is smaller, but not below a 64th of a step: the first frame may show little of a subject, and
// a fine lattice does not reach far.
int lattice_bits(const EncoderOptions& options, double adult) {
    if (options.lattice_bits > 0) return options.lattice_bits;
    const bool controlled = options.rate.bits_per_second > 0 || options.rate.target_error > 0;
    const double finest = controlled ? quality_steps(100).geometry_step : options.geometry_step;
    const auto bits_for = [&](double units) { return static_cast<int>(std::ceil(std::log2(units / finest))); };
    const int of_size = 4 - static_cast<int>(std::lround(std::log2(adult)));
    return std::clamp(std::max(bits_for(8), std::min(of_size, bits_for(64))), 4, 16);
}

FrameSteps steps_of(const Configuration& configuration, const QualitySteps& steps) {
    return {static_cast<std::int32_t>(std::clamp(std::lround(steps.geometry_step * configuration.scale.units), 1L,
                                                 static_cast<long>(lattice_limit))),
            static_cast<std::int32_t>(std::lround(steps.colour_step))};
}

}  // namespace

Result<PoseTracker> configure(Configuration& configuration, const Mesh& mesh, const Pose* pose) {
    const auto& options = configuration.options;
    auto& header = configuration.header;
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    header.lattice.origin = *origin;
    const bool comes_and_goes = options.profile == Profile::tracked && tells_presence(options, mesh);
    const double adult = adult_millimetre(options, mesh, comes_and_goes);
    header.lattice.bits = lattice_bits(options, adult);
    auto tracker = make_pose_tracker(options.skeleton, mesh, pose);
    if (!tracker) return tl::unexpected(tracker.error());
    header.skeleton = tracker->skeleton;
    header.has_skeleton = tracker->has_skeleton;
    auto radii = options.radii;
    if (radii.empty()) {
        auto calibrated = calibrate(mesh, header.skeleton, tracker->last);
        if (!calibrated) return tl::unexpected(calibrated.error());
        radii = std::move(*calibrated);
    }
    const double units = 1.0 / header.lattice.step();
    configuration.scale = {units, LatticeUnits(adult * units)};
    configuration.steps = steps_of(configuration, {options.geometry_step, options.colour_step});
    const auto on_lattice = [](double length) {
        return static_cast<std::int32_t>(std::lround(std::min(length, 1.0 * lattice_limit)));
    };
    header.radii.clear();
    for (const auto r : radii) header.radii.push_back(on_lattice(r * units));
    header.fps_numerator = options.fps_numerator;
    header.fps_denominator = options.fps_denominator;
    header.unit_micrometres = options.unit_micrometres;
    header.session = options.session;
    header.up = options.up;
    header.metadata = options.metadata;
    header.global_shift = options.global_shift;
    if (options.floor) {
        const auto origin_up = static_cast<double>(header.lattice.origin[axis_of(options.up)]);
        const double floor = std::round((*options.floor - origin_up) * units);
        if (!(std::abs(floor) <= lattice_limit))
            return fail(ErrorKind::bad_input, "the floor is too far from the first frame's mesh");
        header.floor = static_cast<std::int32_t>(floor);
    }
    if (options.tracked.group > 1) header.version = grouped_version;
    header.texture = options.texture;
    if (options.texture.layout != TextureLayout::none) header.version = textured_version;
    header.nearest_vertices = static_cast<std::uint8_t>(options.topology.nearest_vertices);
    header.weight_width = on_lattice(options.topology.weight_width * units);
    if (options.profile == Profile::tracked) {
        if (comes_and_goes) header.version = presence_version;
        if (options.texture.layout == TextureLayout::projection) header.version = projected_version;
        const double spacing = options.tracked.node_spacing > 0 ? options.tracked.node_spacing
                                                                : tracking_numbers.node_spacing.value * adult;
        header.node_spacing = std::max(on_lattice(spacing * units), 1);
    }
    return tracker;
}

FrameSteps steps_of_quality(const Configuration& configuration, double quality) {
    auto steps = quality_steps(quality);
    steps.geometry_step *= configuration.scale.adult_millimetre.value / configuration.scale.units;
    return steps_of(configuration, steps);
}

}  // namespace htvm::internal
