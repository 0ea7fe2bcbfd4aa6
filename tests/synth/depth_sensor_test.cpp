// What a depth sensor measures of walls that are known.
#include "synth/depth_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace htvm::synth {
namespace {

constexpr int side = 200;  // pixels
constexpr RandomKey key{7};

// A wall before every pixel.
std::vector<SeenPixel> wall(double depth, double facing = 1, std::uint8_t level = 200) {
    SeenPixel pixel;
    pixel.centre = pixel.front = static_cast<float>(depth);
    pixel.cover = 1;
    pixel.facing = static_cast<float>(facing);
    pixel.colour = {level, level, level};
    return std::vector<SeenPixel>(side * side, pixel);
}

// An edge within every pixel, half of which shows what is before it.
std::vector<SeenPixel> edge(double front, double back) {
    auto pixels = wall(front);
    for (SeenPixel& pixel : pixels) {
        pixel.cover = 0.5F;
        pixel.back = static_cast<float>(back);
    }
    return pixels;
}

double lost_share(const std::vector<float>& depths) {
    return static_cast<double>(std::ranges::count(depths, 0.0F)) / static_cast<double>(depths.size());
}

// RMS of the errors of what is measured.
double error_of(DepthSensor sensor, double depth, double facing = 1, std::uint8_t level = 200) {
    double squares = 0, count = 0;
    for (const float measured : measured_depths(model_of(sensor), wall(depth, facing, level), side, 1, key)) {
        if (measured <= 0) continue;
        squares += std::pow(measured - depth, 2);
        ++count;
    }
    return std::sqrt(squares / count);
}

TEST(DepthSensor, NoiseHasTheDeviationOfTheModelAtEveryDistance) {
    for (const double depth : {1000.0, 2000.0, 3000.0, 4000.0})
        EXPECT_NEAR(error_of(DepthSensor::kinect, depth),
                    noise_deviation(model_of(DepthSensor::kinect), depth, 1, 200 / 255.0), 0.3)
            << depth;
}

TEST(DepthSensor, AKinectErrsByOneOrTwoMillimetresAtTwoMetresAndByTwiceAsMuchAtFour) {
    const double at_two = error_of(DepthSensor::kinect, 2000), at_four = error_of(DepthSensor::kinect, 4000);
    EXPECT_GT(at_two, 1);
    EXPECT_LT(at_two, 2);
    EXPECT_GT(at_four, 2 * at_two);
}

TEST(DepthSensor, APhoneErrsByHalfAPercentAtAnArmsLengthAndMoreThanTwiceAsMuchAtAMetre) {
    const double near = error_of(DepthSensor::phone, 600), far = error_of(DepthSensor::phone, 1000);
    EXPECT_NEAR(near, 3, 0.6);
    EXPECT_GT(far, 2 * near);
}

TEST(DepthSensor, NoiseGrowsWithSlopeAndDarkness) {
    for (const DepthSensor sensor : depth_sensors) {
        const double depth = sensor == DepthSensor::phone ? 600 : 2500;
        const double facing = error_of(sensor, depth), turned = error_of(sensor, depth, 0.5),
                     more = error_of(sensor, depth, 0.4), dark = error_of(sensor, depth, 1, 10);
        EXPECT_GT(turned, 1.05 * facing) << sensor_name(sensor);
        EXPECT_GT(more, turned) << sensor_name(sensor);
        EXPECT_GT(dark, 1.2 * facing) << sensor_name(sensor);
    }
}

TEST(DepthSensor, NoiseOfAPhoneComesInWavesAndThatOfAKinectFromPixelToPixel) {
    const auto roughness = [](DepthSensor sensor, double depth) {
        const auto depths = measured_depths(model_of(sensor), wall(depth), side, 1, key);
        double squares = 0, count = 0;
        for (std::size_t i = 0; i + 1 < depths.size(); ++i) {
            if (depths[i] <= 0 || depths[i + 1] <= 0 || i % side == side - 1) continue;
            squares += std::pow(depths[i] - depths[i + 1], 2);
            ++count;
        }
        return std::sqrt(squares / count) / error_of(sensor, depth);
    };
    EXPECT_LT(roughness(DepthSensor::phone, 600), 0.5);
    EXPECT_GT(roughness(DepthSensor::kinect, 2500), 0.9);
}

TEST(DepthSensor, AKinectTellsWholeMillimetresAndAPhoneStepsOfDisparity) {
    for (const float depth : measured_depths(model_of(DepthSensor::kinect), wall(2500.4), side, 1, key))
        EXPECT_EQ(depth, std::round(depth));
    for (const float depth : measured_depths(model_of(DepthSensor::phone), wall(600.3), side, 1, key)) {
        if (depth <= 0) continue;
        const double steps = 1024 * 1000 / static_cast<double>(depth);
        EXPECT_NEAR(steps, std::round(steps), 1e-3);
    }
}

TEST(DepthSensor, FewPixelsAreLostOnABrightWallMoreOnABlackOneAndAllOnOneSeenFromTheSide) {
    for (const DepthSensor sensor : depth_sensors) {
        const DepthSensorModel& model = model_of(sensor);
        const auto lost = [&](double facing, std::uint8_t level) {
            double sum = 0;
            constexpr int images = 20;
            for (std::uint64_t image = 0; image < images; ++image)
                sum += lost_share(measured_depths(model, wall(model.nearest + 300, facing, level), side, 1, {image}));
            return sum / images;
        };
        EXPECT_NEAR(lost(1, 200), model.lost, model.lost / 3) << sensor_name(sensor);
        EXPECT_NEAR(lost(1, 0), model.lost + model.lost_in_the_dark, 0.01) << sensor_name(sensor);
        EXPECT_EQ(lost(0.5 * model.least_facing, 200), 1) << sensor_name(sensor);
        EXPECT_NEAR(lost(2 * model.least_facing, 200), 0.5, 0.05) << sensor_name(sensor);
    }
}

TEST(DepthSensor, PixelsOnEdgesAreLostFlyOrShowWhatIsAtTheirCentre) {
    for (const DepthSensor sensor : depth_sensors) {
        const DepthSensorModel& model = model_of(sensor);
        const double front = model.nearest + 300, flight = model.longest_flight / 2;  // half of the pixel is covered
        const double reach = 4 * noise_deviation(model, front + flight, 1, 1) + 1;
        const auto depths = measured_depths(model, edge(front, front + 1000), side, 1, key);
        const auto share_within = [&](double low, double high) {
            return static_cast<double>(
                       std::ranges::count_if(depths, [&](float depth) { return depth >= low && depth <= high; })) /
                   static_cast<double>(depths.size());
        };
        EXPECT_NEAR(lost_share(depths), model.mixed_lost, 0.05) << sensor_name(sensor);
        EXPECT_GT(share_within(front + reach, front + flight + reach), 0.5 * model.mixed_flying) << sensor_name(sensor);
        EXPECT_LT(share_within(front + reach, front + flight + reach), 1.2 * model.mixed_flying) << sensor_name(sensor);
        EXPECT_NEAR(lost_share(depths) + share_within(front - reach, front + flight + reach), 1, 1e-9)
            << "nothing flies further";
    }
}

TEST(DepthSensor, WhatFliesNeverLiesBehindWhatIsBehindTheEdge) {
    const DepthSensorModel& model = model_of(DepthSensor::kinect);
    const double reach = 4 * noise_deviation(model, 2100, 1, 1) + 1;
    for (const float depth : measured_depths(model, edge(2000, 2080), side, 1, key)) EXPECT_LT(depth, 2040 + reach);
}

TEST(DepthSensor, WithoutNoiseEveryCentreWithinReachHasItsExactDepth) {
    const DepthSensorModel& model = model_of(DepthSensor::kinect);
    for (const float depth : measured_depths(model, edge(2000.5, 3000), side, 0, key)) EXPECT_EQ(depth, 2000.5F);
    for (const double outside : {model.nearest - 1, model.farthest + 1})
        EXPECT_EQ(lost_share(measured_depths(model, wall(outside), side, 0, key)), 1);
}

TEST(DepthSensor, TheSameKeyGivesTheSameDepthsAndAnotherOneOthers) {
    const DepthSensorModel& model = model_of(DepthSensor::phone);
    const auto depths = measured_depths(model, wall(600), side, 1, key);
    EXPECT_EQ(depths, measured_depths(model, wall(600), side, 1, key));
    EXPECT_NE(depths, measured_depths(model, wall(600), side, 1, {8}));
}

}  // namespace
}  // namespace htvm::synth
