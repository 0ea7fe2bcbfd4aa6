#include "synth/appearance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "synth/random.h"

namespace htvm::synth {
namespace {

using Eigen::Vector3d;

// Where one material ends and the next begins, in mm of rest coordinates.
constexpr double collar_height = 1472, hem_height = 925, cuff_height = 112, sleeve_end = 368, arm_begin = 215;

double smooth_step(double u) {
    u = std::clamp(u, 0.0, 1.0);
    return u * u * (3.0 - 2.0 * u);
}

// The slope of a random gradient at a lattice point, along an offset from it.
double lattice_slope(std::int64_t x, std::int64_t y, std::int64_t z, double dx, double dy, double dz) {
    const std::uint64_t bits =
        mix_bits(static_cast<std::uint64_t>(x) * 0x8da6b343u ^ static_cast<std::uint64_t>(y) * 0xd8163841u ^
                 static_cast<std::uint64_t>(z) * 0xcb1ab31fu);
    const auto component = [&](int shift) { return static_cast<double>(bits >> shift & 0xffff) * 0x1p-15 - 1.0; };
    return component(0) * dx + component(16) * dy + component(32) * dz;
}

// Smooth noise, mostly in [-1, 1], with features about one unit wide.
double smooth_noise(double x, double y, double z) {
    const double fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy),
               iz = static_cast<std::int64_t>(fz);
    const double dx = x - fx, dy = y - fy, dz = z - fz;
    const double u = smooth_step(dx), v = smooth_step(dy), w = smooth_step(dz);
    const auto along_x = [&](int j, int k) {
        const double a = lattice_slope(ix, iy + j, iz + k, dx, dy - j, dz - k);
        const double b = lattice_slope(ix + 1, iy + j, iz + k, dx - 1, dy - j, dz - k);
        return a + u * (b - a);
    };
    const auto along_y = [&](int k) {
        const double a = along_x(0, k), b = along_x(1, k);
        return a + v * (b - a);
    };
    const double a = along_y(0), b = along_y(1);
    return std::clamp(1.9 * (a + w * (b - a)), -1.2, 1.2);
}

// Rounded ridges where the noise crosses zero, like folds of cloth: in [-1, 1].
double ridges(double x, double y, double z) {
    const double n = 1.8 * smooth_noise(x, y, z);
    const double crest = std::max(0.0, 1.0 - n * n);
    return 2.0 * crest * crest - 1.0;
}

// 1 at the centre of an ellipse in the frontal plane, 0 outside it.
double spot(const Vector3d& q, double x, double y, double radius_x, double radius_y) {
    const double u = (std::abs(q.x()) - x) / radius_x, v = (q.y() - y) / radius_y;
    return smooth_step(1.5 * (1.0 - std::sqrt(u * u + v * v)));
}

bool on_arm(const Vector3d& q) { return std::abs(q.x()) > arm_begin && q.y() > 1200; }

// Positive where hair grows, in mm from the hairline: high on the brow, low at the nape.
double hair_depth(const Vector3d& q) { return q.y() - 1592 - 100 * smooth_step((q.z() + 40) / 110); }

// 1 on the ears, which have no hair.
double ear_cover(const Vector3d& q) {
    const double u = (q.z() + 2) / 40, v = (q.y() - 1634) / 48;
    return smooth_step(1.6 * (1.0 - std::sqrt(u * u + v * v))) * smooth_step((std::abs(q.x()) - 40) / 20);
}

double head_relief(const Vector3d& q) {
    double relief = 0;
    const double hair = hair_depth(q);
    if (hair > -5) {
        const double strands = smooth_noise(q.x() / 11, q.y() / 38, q.z() / 15);
        relief += (1 - ear_cover(q)) * smooth_step((hair + 5) / 12) *
                  (10 + 2.2 * strands + 2 * smooth_noise(q.x() / 34, q.y() / 34, q.z() / 34));
    }
    if (q.z() > 45) {
        relief -= 4.5 * spot(q, 30, 1655, 21, 12);  // eye sockets
        relief += 2.2 * spot(q, 30, 1654, 12, 8);   // eyeballs
        relief += 3.0 * spot(q, 30, 1673, 24, 8);   // brows
        relief += 2.6 * spot(q, 0, 1588, 24, 5.5);  // upper lip
        relief += 3.0 * spot(q, 0, 1577, 19, 5.5);  // lower lip
        relief -= 2.0 * spot(q, 0, 1566, 16, 5);    // under the lip
        relief += 1.5 * spot(q, 42, 1622, 18, 16);  // cheeks
    }
    return relief;
}

double arm_relief(const Vector3d& q) {
    const double along = std::abs(q.x());
    const double sleeve = smooth_step((sleeve_end - along) / 7);
    const double flare = 5.5 * smooth_step((along - 290) / 70);
    const double folds = 2.4 * ridges(q.x() / 42, q.y() / 90, q.z() / 90 + 7);
    const double skin = 0.35 * smooth_noise(q.x() / 26, q.y() / 26, q.z() / 26);
    return sleeve * (2.5 + flare + folds) + (1 - sleeve) * skin;
}

double torso_relief(const Vector3d& q) {
    const double collar = 3.5 * smooth_step((q.y() - 1446) / 12) * smooth_step((collar_height - q.y()) / 6);
    const double lower = smooth_step((1250 - q.y()) / 250);
    // Folds from the shoulders to the waist, different on each side.
    const double slant = 0.5 * std::abs(q.x());
    const double folds = ridges((q.y() + slant) / 75, q.x() / 150, q.z() / 140);
    const double hang = ridges(q.x() / 55, q.y() / 260, q.z() / 55 + 3);
    const double hem = 6.0 * (1 - smooth_step((q.y() - hem_height) / 130));
    return 2 + collar + hem + (1.6 + 1.8 * lower) * folds + 1.6 * (1 - lower) * hang +
           0.8 * smooth_noise(q.x() / 24, q.y() / 24, q.z() / 24);
}

bool on_back_pocket(const Vector3d& q) {
    return q.z() < -60 && q.y() > 790 && q.y() < 870 && std::abs(std::abs(q.x()) - 82) < 38;
}

double leg_relief(const Vector3d& q) {
    const double knee = std::exp(-std::pow((q.y() - 495) / 95, 2)), bottom = smooth_step((330 - q.y()) / 180);
    const double folds = ridges(q.x() / 95, q.y() / (38 + 20 * (1 - knee)), q.z() / 95 + 11);
    const double cuff = 5.0 * smooth_step((190 - q.y()) / 70);
    const double seam = 1.2 * std::exp(-std::pow((q.z() + 6) / 5, 2)) * (std::abs(q.x()) > 100 ? 1 : 0);
    const double pocket = on_back_pocket(q) ? 1.5 : 0.0;
    return 1.5 + (1.2 + 2.2 * knee + 2.2 * bottom) * folds + cuff + seam + pocket +
           0.7 * smooth_noise(q.x() / 22, q.y() / 22, q.z() / 22);
}

double shoe_relief(const Vector3d& q) {
    const double sole = 3.5 * smooth_step((26 - q.y()) / 5);
    const double tongue = q.y() > 55 && std::abs(std::abs(q.x()) - 103) < 20 ? 2.0 : 0.0;
    const double laces = tongue > 0 && q.z() > 5 ? 1.2 * std::sin(q.z() * 0.42) : 0.0;
    return sole + tongue + laces;
}

// Colours are computed in 0..255 and rounded once.
Vector3d mix(const Vector3d& a, const Vector3d& b, double weight) { return a + std::clamp(weight, 0.0, 1.0) * (b - a); }

Vector3d skin_colour(const Vector3d& q) {
    const double blotches = smooth_noise(q.x() / 45, q.y() / 45, q.z() / 45 + 5);
    const double pores = smooth_noise(q.x() / 13, q.y() / 13, q.z() / 13);
    return Vector3d(211, 160, 131) + blotches * Vector3d(7, 9, 8) + pores * Vector3d(4, 4, 4);
}

Vector3d head_colour(const Vector3d& q) {
    Vector3d colour = skin_colour(q);
    if (q.z() > 45) {
        colour = mix(colour, {214, 120, 104}, 0.5 * spot(q, 45, 1618, 24, 18));
        colour = mix(colour, {178, 88, 84}, 1.4 * spot(q, 0, 1582, 26, 11));
        colour = mix(colour, {96, 46, 46}, 1.2 * spot(q, 0, 1582, 24, 2.6));
        colour = mix(colour, {74, 50, 36}, 1.5 * spot(q, 31, 1676, 24, 6.5));
        colour = mix(colour, {236, 232, 226}, 2.0 * spot(q, 30, 1655, 16, 8));
        colour = mix(colour, {62, 84, 102}, 2.0 * spot(q, 30, 1655, 8, 8));
        colour = mix(colour, {24, 22, 24}, 1.5 * spot(q, 30, 1655, 4, 4));
        colour = mix(colour, {120, 70, 60}, 1.0 * spot(q, 8, 1612, 6, 5));  // nostrils
    }
    const double edge = hair_depth(q) - 90 * ear_cover(q) + 5 * smooth_noise(q.x() / 14, q.y() / 14, q.z() / 14);
    const double strands = smooth_noise(q.x() / 9, q.y() / 45, q.z() / 12);
    const Vector3d hair = Vector3d(70, 46, 30) + strands * Vector3d(24, 18, 12);
    return mix(colour, hair, smooth_step(edge / 6));
}

// A shirt with blue and white bands, crossed by a thin red line, with a round badge on the chest.
Vector3d shirt_colour(const Vector3d& q) {
    const bool arm = on_arm(q);
    const double along = arm ? std::abs(q.x()) : q.y();
    const double around = arm ? std::atan2(q.y() - 1395, q.z()) : std::atan2(q.x(), q.z());
    const double band = std::sin(along * 0.105), line = std::sin(around * (arm ? 6 : 16));
    Vector3d colour = mix({42, 82, 146}, {205, 212, 218}, smooth_step(2.2 * band + 0.5));
    colour = mix(colour, {178, 50, 52}, smooth_step((line - 0.9) * 14));
    if (!arm && q.z() > 40) {
        const double radius = std::hypot(q.x(), q.y() - 1290);
        const double angle = std::atan2(q.x(), q.y() - 1290);
        const double star = 30 + 15 * std::cos(5 * angle);
        colour = mix(colour, {238, 186, 56}, smooth_step((72 - radius) / 5));
        colour = mix(colour, {40, 44, 62}, smooth_step((star - radius) / 5));
    }
    const double edge = arm ? sleeve_end - along : q.y() - hem_height;
    colour = mix(colour, {30, 52, 92}, smooth_step((18 - edge) / 5));
    if (q.y() > 1454) colour = mix(colour, {30, 52, 92}, smooth_step((q.y() - 1454) / 4));
    const double weave = smooth_noise(q.x() / 11, q.y() / 11, q.z() / 11);
    return colour * (1.0 + 0.06 * weave);
}

Vector3d trouser_colour(const Vector3d& q) {
    const double wash = smooth_noise(q.x() / 120, q.y() / 160, q.z() / 120),
                 grain = smooth_noise(q.x() / 10, q.y() / 26, q.z() / 10);
    Vector3d colour = Vector3d(66, 70, 84) + wash * Vector3d(12, 12, 13) + grain * Vector3d(11, 11, 12);
    if (q.y() > 885) colour = mix(colour, {52, 36, 26}, smooth_step((q.y() - 885) / 4));  // belt
    return on_back_pocket(q) && (q.y() > 862 || q.y() < 798) ? mix(colour, {140, 110, 70}, 0.6) : colour;
}

Vector3d shoe_colour(const Vector3d& q) {
    const double scuff = smooth_noise(q.x() / 16, q.y() / 16, q.z() / 16);
    Vector3d colour = Vector3d(128, 44, 40) + scuff * Vector3d(10, 6, 6);
    if (q.y() > 55 && std::abs(std::abs(q.x()) - 103) < 20 && q.z() > 5)
        colour = mix(colour, {235, 232, 224}, smooth_step(2 * std::sin(q.z() * 0.42)));  // laces
    return mix(colour, {226, 224, 216}, smooth_step((27 - q.y()) / 4));
}

std::uint8_t to_byte(double value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0l, 255l)); }

double person_relief(const Vector3d& q) {
    if (on_arm(q)) return arm_relief(q);
    // The reliefs of the regions fade into each other over a few millimetres: steep, like a hem, but without a jump.
    if (q.y() > collar_height) return mix({head_relief(q), 0, 0}, {2, 0, 0}, (collar_height + 4 - q.y()) / 4).x();
    if (q.y() > hem_height) return torso_relief(q);
    if (q.y() > hem_height - 6) {
        const double w = smooth_step((q.y() - (hem_height - 6)) / 6);
        return (1 - w) * leg_relief(q) + w * torso_relief(q);
    }
    if (q.y() > cuff_height) return leg_relief(q);
    const double w = smooth_step((q.y() - (cuff_height - 7)) / 7);
    return w > 0 ? w * leg_relief(q) + (1 - w) * shoe_relief(q) : shoe_relief(q);
}

// Clothes of other colours: what is coloured strongly or dark is, skin and hair are not.
Vector3d other_clothes(const Vector3d& colour) {
    return {0.75 * colour.z() + 30, colour.y() + 8, 0.8 * colour.x() + 12};
}

Vector3d person_colour(const Vector3d& q, bool second) {
    Vector3d colour;
    if (on_arm(q)) {
        colour = std::abs(q.x()) < sleeve_end ? shirt_colour(q) : skin_colour(q);
    } else if (q.y() > collar_height) {
        colour = head_colour(q);
    } else if (q.y() > hem_height - 3) {
        colour = shirt_colour(q);
    } else {
        colour = q.y() > cuff_height - 3 ? trouser_colour(q) : shoe_colour(q);
    }
    const bool cloth = on_arm(q) ? std::abs(q.x()) < sleeve_end : q.y() < collar_height && q.y() > cuff_height;
    if (cloth && second) colour = other_clothes(colour);
    // Hollows are darker, as in the texture of a capture.
    if (cloth) colour *= std::clamp(0.94 + 0.025 * (person_relief(q) - 3.0), 0.82, 1.06);
    return colour;
}

Vector3d wood_colour(const Vector3d& q) {
    const double grain =
        smooth_noise(q.x() / 14, q.y() / 90, q.z() / 90) + 0.5 * smooth_noise(q.x() / 5, q.y() / 60, q.z() / 60);
    return Vector3d(168, 118, 72) + grain * Vector3d(18, 16, 12);
}

// Eight panels in turn yellow and blue, and a white ring round the middle.
Vector3d ball_colour(const Vector3d& q) {
    const double panel = std::sin(4 * std::atan2(q.z(), q.x()));
    const Vector3d colour = mix({232, 184, 52}, {38, 84, 170}, smooth_step(6 * panel + 0.5));
    return mix(colour, {236, 234, 228}, smooth_step((16 - std::abs(q.y())) / 4));
}

}  // namespace

double surface_relief(Figure figure, const Vector3d& q) {
    return figure == Figure::person || figure == Figure::other_person ? person_relief(q) : 0.0;
}

Colour surface_colour(Figure figure, const Vector3d& q) {
    const Vector3d colour = figure == Figure::chair  ? wood_colour(q)
                            : figure == Figure::ball ? ball_colour(q)
                                                     : person_colour(q, figure == Figure::other_person);
    return {to_byte(colour.x()), to_byte(colour.y()), to_byte(colour.z())};
}

}  // namespace htvm::synth
