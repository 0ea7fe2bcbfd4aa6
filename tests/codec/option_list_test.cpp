// The list of options: each can be read and set within its range and not beyond, has an effect, and combinations that
// contradict each other are refused.
#include "htvm/option_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "htvm/encoder.hpp"

namespace htvm {
namespace {

using namespace test;
using ::testing::HasSubstr;

constexpr double infinite = std::numeric_limits<double>::infinity();

Profile profile_of(const Option& option) {
    return option.group == OptionGroup::tracked ? Profile::tracked : Profile::topology;
}

double default_of(const Option& option) { return option.get(default_options(profile_of(option))); }

// Legal values, beginning with those that differ little from the default.
std::vector<double> values_of(const Option& option) {
    std::vector<double> out;
    if (option.kind == OptionKind::on_or_off) return {0, 1};
    if (option.kind == OptionKind::word) {
        for (std::size_t w = 0; w < option.words.size(); ++w) out.push_back(static_cast<double>(w));
        return out;
    }
    const double middle = default_of(option);
    for (const double value : {2 * middle, middle + 1, middle, option.least, option.most, 0.0})
        if (check_value(option, value)) out.push_back(value);
    return out;
}

std::string message_of(const EncoderOptions& options) {
    const auto encoder = Encoder::create(options);
    if (encoder) return "";
    EXPECT_EQ(encoder.error().kind, ErrorKind::bad_input);
    return encoder.error().message;
}

TEST(OptionList, NamesEveryOptionByItsPathAndOnce) {
    std::set<std::string> names, flags;
    for (const auto& option : option_list()) {
        const std::string name = option.name;
        EXPECT_TRUE(names.insert(name).second) << name;
        if (*option.flag) {
            EXPECT_TRUE(flags.insert(option.flag).second) << option.flag;
        }
        const auto dot = name.find('.');
        EXPECT_EQ(dot == name.npos ? "common" : name.substr(0, dot), group_name(option.group)) << name;
        EXPECT_EQ(option.words.empty(), option.kind != OptionKind::word) << name;
        EXPECT_EQ(find_option(name), &option);
    }
    EXPECT_EQ(find_option("key"), nullptr);
}

TEST(OptionList, ValuesComeBackAsTheyWereSet) {
    for (const auto& option : option_list())
        for (const double value : values_of(option)) {
            EncoderOptions options;
            ASSERT_TRUE(set_option(options, option.name, value)) << option.name << ' ' << value;
            EXPECT_EQ(option.get(options), value) << option.name;
            if (option.name == std::string("geometry_step") && value < 1e-3) continue;  // shown as 2^-16
            EncoderOptions by_text;
            ASSERT_TRUE(set_option(by_text, option.name, value_text(option, value))) << option.name << ' ' << value;
            EXPECT_EQ(option.get(by_text), value) << option.name;
            for (const auto& other : option_list())
                if (&other != &option) {
                    EXPECT_EQ(other.get(options), other.get({})) << option.name << " sets " << other.name;
                }
        }
}

TEST(OptionList, RangesEndWhereTheySay) {
    const auto refused = [](const Option& option, double value) {
        EncoderOptions options;
        const auto set = set_option(options, option.name, value);
        EXPECT_FALSE(set) << option.name << ' ' << value;
        if (set) return;
        EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
        EXPECT_THAT(set.error().message, HasSubstr(option.name));
        EXPECT_THAT(set.error().message, HasSubstr(range_text(option)));
        EXPECT_EQ(option.get(options), option.get({})) << "nothing is changed";
        if (option.kind != OptionKind::number) return;
        option.set(options, value);
        options.profile = profile_of(option);
        EXPECT_EQ(message_of(options), set.error().message) << "set in the struct";
    };
    for (const auto& option : option_list()) {
        for (const double value : {-infinite, infinite, std::nan(""), -1.0}) refused(option, value);
        if (option.kind == OptionKind::on_or_off) refused(option, 2);
        if (option.kind == OptionKind::word) refused(option, static_cast<double>(option.words.size()));
        if (option.kind != OptionKind::number) refused(option, 0.5);
        if (option.kind == OptionKind::number) {
            refused(option, std::nextafter(option.least, -infinite));
            refused(option, std::nextafter(option.most, infinite));
        }
        if (option.kind == OptionKind::whole_number) {
            refused(option, option.most + 1);
            if (option.least > 0 && !*option.zero) refused(option, option.least - 1);
        }
    }
}

TEST(OptionList, ErrorsAreWholeSentences) {
    EncoderOptions options;
    EXPECT_EQ(set_option(options, "rate.buffer_seconds", 0.001).error().message,
              "rate.buffer_seconds must be 0.01 to 3600 s, not 0.001");
    EXPECT_EQ(set_option(options, "threads", 5000).error().message, "threads must be 0, or 1 to 1024, not 5000");
    EXPECT_EQ(set_option(options, "topology.frame_choice", "best").error().message,
              "topology.frame_choice must be fixed, motion, rd or cheaper, not 'best'");
    EXPECT_EQ(set_option(options, "topology.scene_changes", "yes").error().message,
              "topology.scene_changes must be on or off, not 'yes'");
    for (const char* text : {"", " 1", "1 ", "1,5", "nan", "inf", "0x10", "1e400", "one"})
        EXPECT_FALSE(set_option(options, "colour_step", text)) << text;
}

TEST(OptionList, UnknownNamesAreToldTheNearest) {
    for (const auto& [wrong, right] :
         std::vector<std::pair<std::string, std::string>>{{"keyinterval", "key_interval"},
                                                          {"keyint", "key_interval"},
                                                          {"bitrate", "rate.bits_per_second"},
                                                          {"frame_choice", "topology.frame_choice"},
                                                          {"Node spacing", "tracked.node_spacing"},
                                                          {"--target_error", "rate.target_error"},
                                                          {std::string(100000, 'x'), ""},
                                                          {"", ""}}) {
        EncoderOptions options;
        const auto set = set_option(options, wrong, 1);
        ASSERT_FALSE(set);
        EXPECT_EQ(set.error().kind, ErrorKind::bad_input);
        EXPECT_THAT(set.error().message, HasSubstr("the nearest is '" + right));
        EXPECT_LT(set.error().message.size(), 200u);
    }
}

TEST(OptionList, OptionsOfAnotherProfileAreRefusedByName) {
    int refused = 0;
    for (const auto profile : {Profile::tracked, Profile::topology, Profile::paper})
        for (const auto& option : option_list()) {
            auto options = default_options(profile);
            const double usual = option.get(options);
            for (const double value : values_of(option)) {
                option.set(options, value);
                if (serves(option.group, profile) || value == usual) continue;
                ++refused;
                EXPECT_EQ(message_of(options), std::string(option.name) + " does nothing with the " +
                                                   profile_name(profile) + " profile; choose the " +
                                                   group_name(option.group) + " profile");
            }
        }
    EXPECT_GT(refused, 30);
    auto options = default_options(Profile::paper);
    options.profile = Profile::tracked;
    EXPECT_THAT(message_of(options), HasSubstr("does nothing with the tracked profile"));
}

TEST(OptionList, ContradictionsAreRefused) {
    const auto message = [](Profile profile, auto&& change) {
        auto options = default_options(profile);
        change(options);
        return message_of(options);
    };
    for (const auto profile : {Profile::tracked, Profile::topology, Profile::paper})
        EXPECT_EQ(message(profile, [](auto&) {}), "");
    EXPECT_EQ(message(Profile::tracked,
                      [](auto& o) {
                          o.key_interval = 3;
                          o.least_key_interval = 4;
                      }),
              "least_key_interval, 4 frames, is above key_interval, 3");
    EXPECT_EQ(message(Profile::tracked,
                      [](auto& o) {
                          o.rate.bits_per_second = 1e6;
                          o.rate.target_error = 1;
                      }),
              "rate.bits_per_second and rate.target_error exclude each other");
    EXPECT_EQ(message(Profile::tracked,
                      [](auto& o) {
                          o.quality = 60;
                          o.rate.bits_per_second = 1e6;
                      }),
              "quality does nothing with rate.bits_per_second or rate.target_error: it follows from these");
    EXPECT_EQ(message(Profile::tracked, [](auto& o) { o.rate.buffer_seconds = 2; }),
              "rate.buffer_seconds does nothing without rate.bits_per_second");
    EXPECT_EQ(message(Profile::tracked, [](auto& o) { o.rate.first_pass.resize(1); }),
              "rate.first_pass does nothing without rate.bits_per_second");
    for (const auto choice : {FrameChoice::fixed, FrameChoice::rate_distortion}) {
        EXPECT_EQ(message(Profile::topology,
                          [&](auto& o) {
                              o.topology.frame_choice = choice;
                              o.topology.predicted_below = 5;
                          }),
                  "topology.predicted_below does nothing unless topology.frame_choice is motion");
        EXPECT_EQ(message(Profile::paper,
                          [&](auto& o) {
                              o.topology.frame_choice = choice;
                              o.topology.intra_above = 5;
                          }),
                  "topology.intra_above does nothing unless topology.frame_choice is motion");
    }
    EXPECT_THAT(message(Profile::tracked, [](auto& o) { o.profile = static_cast<Profile>(3); }), HasSubstr("profile"));
    EXPECT_THAT(message(Profile::topology, [](auto& o) { o.topology.frame_choice = static_cast<FrameChoice>(4); }),
                HasSubstr("topology.frame_choice must be fixed, motion, rd or cheaper, not 4"));
}

TEST(Quality, IsTwoStepsEachOfWhichCanBeGivenInItsPlace) {
    EncoderOptions options;
    EXPECT_EQ(options.quality, 42);
    EXPECT_EQ(quality_steps(options).geometry_step, 16 * std::exp2(-0.42 * 6));
    EXPECT_EQ(quality_steps(options).colour_step, 32 * std::exp2(-0.42 * 5));
    const auto person = walking(3, 300);
    const auto by_quality = encode(person, options).bytes;
    auto by_steps = options;
    by_steps.geometry_step = 16 * std::exp2(-0.42 * 6);
    by_steps.colour_step = 32 * std::exp2(-0.42 * 5);
    EXPECT_EQ(encode(person, by_steps).bytes, by_quality);
    by_steps.quality = 100;
    EXPECT_EQ(encode(person, by_steps).bytes, by_quality);
    options.quality = 60;
    EXPECT_NE(encode(person, options).bytes, by_quality);
    options.geometry_step = 3;
    EXPECT_EQ(quality_steps(options).geometry_step, 3);
    EXPECT_EQ(quality_steps(options).colour_step, 4);
}

TEST(Profiles, ThePapersDifferFromTopologyInFourChoices) {
    std::set<std::string> differ;
    for (const auto& option : option_list())
        if (option.get(default_options(Profile::paper)) != option.get(default_options(Profile::topology)))
            differ.insert(option.name);
    EXPECT_EQ(differ, (std::set<std::string>{"topology.frame_choice", "topology.reference_vertices",
                                             "topology.registration", "topology.weight_width"}));
    differ.clear();
    for (const auto& option : option_list())
        if (option.get(default_options(Profile::tracked)) != option.get(default_options(Profile::topology)))
            differ.insert(option.name);
    EXPECT_EQ(differ, std::set<std::string>{"key_interval"});
}

// Settings under which other options have an effect: coarse steps at which vertices coincide, a bitrate, an error,
// animated parts and frames, I-frames by motion.
std::vector<EncoderOptions> settings_for(const Option& option) {
    auto usual = default_options(profile_of(option));
    usual.key_interval = 6;
    std::vector<EncoderOptions> out = {usual};
    const auto with = [&](auto&& change) {
        out.push_back(usual);
        change(out.back());
    };
    with([](auto& o) { o.geometry_step = 40, o.colour_step = 255; });
    with([](auto& o) { o.rate.bits_per_second = 400e3; });
    with([](auto& o) { o.rate.target_error = 1.5; });
    if (usual.profile == Profile::tracked) return out;
    with([](auto& o) { o.topology.still_below = 60; });
    with([](auto& o) { o.topology.animation_error = 0; });
    with([](auto& o) { o.topology.frame_choice = FrameChoice::motion, o.topology.animation_error = 0; });
    with([](auto& o) { o.topology.frame_choice = FrameChoice::motion, o.topology.intra_above = 30; });
    return out;
}

// The bytes; nothing if the options contradict each other.
std::optional<std::vector<std::uint8_t>> bytes_by(const TestSequence& sequence, const EncoderOptions& options) {
    if (!Encoder::create(options)) return {};
    return encode(sequence, options).bytes;
}

// A ball without its lower end, with a speck beside it; from the third frame on there is a hole in it.
TestSequence coming_and_going() {
    auto out = horned_ball(6, never);
    for (std::size_t t = 0; t < out.frames.size(); ++t) {
        auto& mesh = out.frames[t].mesh;
        std::erase_if(mesh.triangles, [&](const Triangle& triangle) {
            const auto& p = mesh.positions[triangle[0]];
            return p[2] < -200 || (t > 1 && p[0] > 250);
        });
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const auto& p :
             {Vector3f{-500, 0, 0}, Vector3f{-488, 0, 0}, Vector3f{-500, 12, 0}, Vector3f{-488, 12, 0}}) {
            mesh.positions.push_back(p);
            mesh.colours.push_back({90, 90, 90});
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first + 1, first + 3, first + 2});
    }
    return out;
}

TEST(OptionList, EveryOptionChangesTheBytesButThreads) {
    // A person moves, and is two metres away in the last frame: a scene change.
    auto sequence = walking(5, 300);
    const auto with_normals = sequence;
    for (auto& frame : sequence.frames) {
        frame.mesh.normals.clear();
        frame.mesh.texcoords.clear();  // otherwise I-frames are not simplified, and no two vertices are equal
    }
    for (auto& p : sequence.frames.back().mesh.positions) p[0] += 2000;
    const auto lost_in_part = horned_ball(3);
    const auto in_sight = coming_and_going();
    auto of_many_vertices = walking(1, 8000);  // where levels pay
    of_many_vertices.frames[0].mesh.texcoords.clear();
    for (const auto& option : option_list()) {
        bool changes = false;
        for (auto settings : settings_for(option)) {
            const bool patches = std::string(option.name) == "tracked.patch_share";
            const bool seen =
                std::string(option.name) == "tracked.fill" || std::string(option.name) == "tracked.specks";
            const auto& tried_on = patches                                        ? lost_in_part
                                   : std::string(option.name) == "tracked.levels" ? of_many_vertices
                                   : seen                                         ? in_sight
                                   : std::string(option.name) == "normals"        ? with_normals
                                                                                  : sequence;
            if (patches || seen) settings.subject_size = patched_options().subject_size;
            const auto before = bytes_by(tried_on, settings);
            ASSERT_TRUE(before.has_value());
            for (const double value : values_of(option)) {
                auto changed = settings;
                option.set(changed, value);
                const auto bytes = bytes_by(tried_on, changed);
                changes = changes || (bytes && *bytes != *before);
                if (changes) break;
            }
            if (changes) break;
        }
        const std::string name = option.name;
        EXPECT_EQ(changes, name != "threads" && name != "latency_frames") << name;
    }
}

}  // namespace
}  // namespace htvm
