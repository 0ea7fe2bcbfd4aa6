#include "metrics/front.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

namespace htvm {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr const char* front_key = "front";

// Where the head is along a negative axis the right side stays, so the front is behind.
std::pair<Point3, Point3> right_and_up(UpAxis up) {
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
std::optional<Point3> three_numbers(std::string_view text) {
    Point3 out{};
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

Point3 direction_at(double azimuth, UpAxis up) {
    const ViewAxes axes = view_axes(up);
    return axes.front * std::cos(azimuth * degree) + axes.right * std::sin(azimuth * degree);
}

std::optional<double> azimuth_of(const Point3& direction, UpAxis up) {
    const ViewAxes axes = view_axes(up);
    const double ahead = dot(direction, axes.front), aside = dot(direction, axes.right);
    constexpr double least = 0.1;  // of its length, level
    if (!(std::hypot(ahead, aside) > least * std::sqrt(dot(direction, direction)))) return std::nullopt;
    return std::atan2(aside, ahead) / degree;
}

MetadataEntry front_entry(const Point3& direction) {
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

std::optional<Point3> front_of(std::span<const MetadataEntry> metadata) {
    for (const auto& [key, value] : metadata) {
        if (key != front_key) continue;
        const auto direction = three_numbers(value);
        const double size = direction ? std::sqrt(dot(*direction, *direction)) : 0;
        if (!(size > 0) || !std::isfinite(size)) return std::nullopt;
        return *direction * (1 / size);
    }
    return std::nullopt;
}

std::optional<Point3> facing_of(const Mesh& mesh) {
    Point3 sum{};
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Point3 a = to_point(mesh.positions[t[0]]), b = to_point(mesh.positions[t[1]]),
                     c = to_point(mesh.positions[t[2]]);
        const Point3 normal = cross(b - a, c - a);
        sum = sum + normal;
        area += std::sqrt(dot(normal, normal));
    }
    // How much of the area must face one way more than any other: a half sphere faces its pole by a half.
    constexpr double least = 0.25;
    if (!(std::sqrt(dot(sum, sum)) > least * area)) return std::nullopt;
    return sum * (1 / area);
}

}  // namespace htvm
