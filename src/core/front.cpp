#include "core/front.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

namespace htvm {
namespace {

using internal::cross, internal::dot, internal::operator*, internal::operator+, internal::operator-;

constexpr double degree = std::numbers::pi / 180;
constexpr const char* front_key = "front";

// Where the head is along a negative axis the right side stays, so the front is behind.
std::pair<Vector3d, Vector3d> right_and_up(UpAxis up) {
    switch (up) {
        case UpAxis::plus_x:
            return {{{0, 1, 0}}, {{1, 0, 0}}};
        case UpAxis::minus_x:
            return {{{0, 1, 0}}, {{-1, 0, 0}}};
        case UpAxis::unknown:
        case UpAxis::plus_y:
            break;
        case UpAxis::minus_y:
            return {{{1, 0, 0}}, {{0, -1, 0}}};
        case UpAxis::plus_z:
            return {{{1, 0, 0}}, {{0, 0, 1}}};
        case UpAxis::minus_z:
            return {{{1, 0, 0}}, {{0, 0, -1}}};
    }
    return {{{1, 0, 0}}, {{0, 1, 0}}};
}

// Three numbers with blanks between them, and nothing else.
std::optional<Vector3d> three_numbers(std::string_view text) {
    Vector3d out{};
    const char *at = text.data(), *end = at + text.size();
    for (double& number : out) {
        while (at != end && *at == ' ') ++at;
        const auto read = std::from_chars(at, end, number);
        if (read.ec != std::errc{}) return std::nullopt;
        at = read.ptr;
    }
    while (at != end && *at == ' ') ++at;
    return at == end ? std::optional(out) : std::nullopt;
}

}  // namespace

ViewAxes view_axes(UpAxis up) {
    const auto [right, head] = right_and_up(up);
    return {right, head, cross(right, head)};
}

Vector3d direction_at(double azimuth, UpAxis up) {
    const ViewAxes axes = view_axes(up);
    return axes.front * std::cos(azimuth * degree) + axes.right * std::sin(azimuth * degree);
}

std::optional<double> azimuth_of(const Vector3d& direction, UpAxis up) {
    const ViewAxes axes = view_axes(up);
    const double ahead = dot(direction, axes.front), aside = dot(direction, axes.right);
    constexpr double least = 0.1;  // of its length, level
    if (!(std::hypot(ahead, aside) > least * std::sqrt(dot(direction, direction)))) return std::nullopt;
    return std::atan2(aside, ahead) / degree;
}

MetadataEntry front_entry(const Vector3d& direction) {
    std::string text;
    for (const double number : direction) {
        // Four digits are a hundredth of a degree; 0.0 takes the sign off zeros.
        const double rounded = std::round(number * 1e4) / 1e4 + 0.0;
        char digits[32];
        const auto written = std::to_chars(digits, digits + sizeof digits, rounded);
        text += (text.empty() ? "" : " ") + std::string(digits, written.ptr);
    }
    return {front_key, text};
}

std::optional<Vector3d> front_of(std::span<const MetadataEntry> metadata) {
    for (const auto& [key, value] : metadata) {
        if (key != front_key) continue;
        const auto direction = three_numbers(value);
        const double size = direction ? std::sqrt(dot(*direction, *direction)) : 0;
        if (!(size > 0) || !std::isfinite(size)) return std::nullopt;
        return *direction * (1 / size);
    }
    return std::nullopt;
}

std::optional<Vector3d> facing_of(const Mesh& mesh) {
    Vector3d sum{};
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Vector3d a = internal::to_vector(mesh.positions[t[0]]), b = internal::to_vector(mesh.positions[t[1]]),
                       c = internal::to_vector(mesh.positions[t[2]]);
        const Vector3d normal = cross(b - a, c - a);
        sum = sum + normal;
        area += std::sqrt(dot(normal, normal));
    }
    // Of the area, how much must face one way more than any other: a half sphere faces its pole by a half.
    constexpr double least = 0.25;
    if (!(std::sqrt(dot(sum, sum)) > least * area)) return std::nullopt;
    return sum * (1 / area);
}

}  // namespace htvm
