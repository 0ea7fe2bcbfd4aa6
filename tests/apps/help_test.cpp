// What --help and --help-all show, and how a command line that contradicts itself ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "commands.h"
#include "htvm/option_list.hpp"

namespace htvm::app {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

struct Said {
    int code = 0;
    std::string out, error;
};

Said run(std::vector<std::string> words) {
    setenv("COLUMNS", "100", 1);
    Program program;
    program.name = "htvm";
    program.description = "htvm compresses.";
    program.commands = {add_check, add_compare, add_decode, add_encode, add_publish, add_serve, add_synth};
    words.insert(words.begin(), "htvm");
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Said said;
    said.code = run_program(program, static_cast<int>(words.size()), arguments.data());
    said.out = testing::internal::GetCapturedStdout();
    said.error = testing::internal::GetCapturedStderr();
    return said;
}

std::string help(const std::string& command, const std::string& flag = "--help") {
    const auto said = run({command, flag});
    EXPECT_EQ(said.code, 0);
    return said.out;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> out;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) out.push_back(line);
    return out;
}

// "--quality" of "  -q,--quality NUMBER  0 to 100 ...".
std::vector<std::string> flags_of(const std::string& help) {
    std::vector<std::string> out;
    for (const auto& line : lines_of(help)) {
        if (!line.starts_with("  -")) continue;
        const auto begin = line.find("--");
        out.push_back(line.substr(begin, line.find_first_of(" \n", begin) - begin));
    }
    return out;
}

// The flags below a heading, up to the next one.
std::vector<std::string> flags_under(const std::string& help, const std::string& heading) {
    const auto begin = help.find("\n" + heading + ":\n");
    EXPECT_NE(begin, std::string::npos) << heading;
    return begin == std::string::npos ? std::vector<std::string>()
                                      : flags_of(help.substr(begin, help.find("\n\n", begin + 1) - begin));
}

const std::vector<std::string> long_commands = {"check", "compare", "decode", "encode", "publish", "serve", "synth"};

TEST(FrontPage, EncodeShowsTheDozenOptionsThatPeopleNeed) {
    const auto page = help("encode");
    const auto flags = flags_of(page);
    EXPECT_GE(flags.size(), 12u);
    EXPECT_LE(flags.size(), 14u);
    for (const char* needed : {"--output", "--quality", "--bitrate", "--profile", "--skeleton", "--fps", "--threads"})
        EXPECT_THAT(flags, testing::Contains(needed));
    EXPECT_LE(lines_of(page).size(), 40u);
}

TEST(FrontPage, ExperimentsAndLogsAreNotOnIt) {
    const auto page = help("encode");
    for (const auto& option : option_list()) {
        if (option.group == OptionGroup::topology) {
            EXPECT_THAT(page, Not(HasSubstr(option.flag)));
        }
    }
    EXPECT_THAT(page, AllOf(Not(HasSubstr("--effort-log")), Not(HasSubstr("--repeat-efforts"))));
}

TEST(FrontPage, ItsLastLineNamesWhereTheRestIs) {
    for (const auto& command : long_commands) {
        const auto lines = lines_of(help(command));
        EXPECT_THAT(lines.back(), StartsWith("--help-all shows ")) << command;
        const auto more = std::stoul(lines.back().substr(17));
        EXPECT_EQ(flags_of(help(command)).size() + more + 1, flags_of(help(command, "--help-all")).size()) << command;
    }
}

TEST(FrontPage, HasTwoOrThreeExamples) {
    const auto page = help("encode");
    const auto examples = lines_of(page.substr(page.find("Examples:")));
    const auto count = std::count_if(examples.begin(), examples.end(),
                                     [](const std::string& line) { return line.find("htvm encode") != line.npos; });
    EXPECT_GE(count, 2);
    EXPECT_LE(count, 3);
}

TEST(FrontPage, OfEncodeTellsWhereTheSwitchesForDepthCamerasAre) {
    const auto page = help("encode"), all = help("encode", "--help-all");
    EXPECT_THAT(page, HasSubstr("Captures of depth cameras are known by their borders"));
    for (const char* flag : {"--presence", "--fill-holes", "--specks"}) {
        EXPECT_THAT(page, HasSubstr(flag));
        EXPECT_THAT(all, HasSubstr(flag));
    }
}

TEST(HelpAll, HasWhatTheFrontPageHas) {
    for (const auto& command : long_commands) {
        const auto all = flags_of(help(command, "--help-all"));
        for (const auto& flag : flags_of(help(command))) EXPECT_THAT(all, testing::Contains(flag)) << command;
    }
}

TEST(HelpAll, HasEveryOptionOfTheLibrarysList) {
    const auto all = flags_of(help("encode", "--help-all"));
    for (const auto& option : option_list()) {
        if (*option.flag) {
            EXPECT_THAT(all, testing::Contains(option.flag));
        }
    }
}

TEST(HelpAll, SortsOptionsByWhatTheyAreFor) {
    const auto all = help("encode", "--help-all");
    EXPECT_THAT(flags_under(all, "Input"), testing::IsSupersetOf({"--fps", "--unit", "--frames", "--on-bad-frame"}));
    EXPECT_THAT(
        flags_under(all, "Quality and rate"),
        testing::IsSupersetOf({"--quality", "--preset", "--bitrate", "--target-error", "--effort", "--profile"}));
    EXPECT_THAT(flags_under(all, "Textures"),
                testing::UnorderedElementsAre("--texture", "--texture-origin", "--texture-as", "--texture-size",
                                              "--texture-codec", "--texture-quality"));
    EXPECT_THAT(flags_under(all, "Skeleton"),
                testing::UnorderedElementsAre("--skeleton", "--skeleton-offset", "--radii"));
    EXPECT_THAT(flags_under(all, "Sound"),
                testing::UnorderedElementsAre("--audio", "--audio-delay", "--audio-bitrate"));
    EXPECT_THAT(flags_under(all, "Live streams and a camera's pace"),
                testing::IsSupersetOf({"--deadline", "--drop-late", "--other-hub", "--token", "--session"}));
    EXPECT_THAT(flags_under(all, "Many processors, many machines"),
                testing::UnorderedElementsAre("--threads", "--latency-frames", "--chunks", "--jobs", "--job"));
    EXPECT_THAT(flags_under(all, "Scripts and runs that can be repeated"),
                testing::UnorderedElementsAre("--json", "--effort-log", "--repeat-efforts", "--help-options"));
}

TEST(HelpAll, PublishedExperimentsAreByThemselves) {
    std::vector<std::string> experiments;
    for (const auto& option : option_list())
        if (option.group == OptionGroup::topology) experiments.emplace_back(option.flag);
    EXPECT_EQ(experiments.size(), 11u);
    EXPECT_THAT(flags_under(help("encode", "--help-all"), "Published experiments (--profile topology or paper)"),
                testing::UnorderedElementsAreArray(experiments));
}

TEST(HelpAll, NoOptionOfEncodeIsWithoutAHeading) {
    EXPECT_THAT(flags_under(help("encode", "--help-all"), "Options"),
                testing::UnorderedElementsAre("--help", "--help-all", "--quiet"));
}

TEST(HelpAll, OfCheckExplainsTheWordsOfItsReport) {
    const auto all = help("check", "--help-all");
    for (const char* word : {"border  ", "turned  ", "doubled  ", "specks  ", "far away  ", "flicker  ", "odd  "})
        EXPECT_THAT(all, HasSubstr(word));
    EXPECT_THAT(help("check"), AllOf(HasSubstr("--help-all explains the words of the report"), Not(HasSubstr("rims"))));
}

TEST(CommandLine, AContradictionIsAUsageErrorThatNamesTheOption) {
    const auto ends_with = [](std::vector<std::string> words, const std::string& why) {
        const auto said = run(std::move(words));
        EXPECT_EQ(said.code, 2) << why;
        EXPECT_THAT(said.error, StartsWith("htvm: error: " + why));
        EXPECT_EQ(said.out, "");
    };
    ends_with({"encode", "capture", "-o", "-", "--json"}, "--json: prints on standard output, where -o - puts");
    ends_with({"encode", "capture", "-o", "x.htvm", "--drop-late"}, "--drop-late: is for meshes on standard input");
    ends_with({"encode", "capture", "-o", "x.htvm", "--nearest", "8"},
              "--nearest does nothing with --profile tracked: add --profile topology; 'htvm encode --help-all'");
    ends_with({"encode", "capture", "-o", "x.htvm", "--texture-as", "keep"}, "--texture-as: keep keeps every frame's");
    ends_with({"encode", "capture", "-o", "x.htvm", "--job", "1/2", "--session", "random"}, "--session: is random");
    ends_with({"encode", "capture", "-o", "x.htvm", "--job", "3/2"}, "--job: '3/2' is not I/N");
    ends_with({"encode", "capture", "-o", "x.htvm", "--profile", "best"},
              "--profile: best is none of tracked, topology, paper; 'htvm encode --help-all' tells more");
    ends_with({"encode", "capture", "-o", "x.htvm", "--bitrate", "4", "-q", "50"}, "--quality excludes --bitrate");
    ends_with({"encode", "capture", "-o", "x.htvm", "--preset", "web", "-q", "50"}, "--quality excludes --preset");
    ends_with({"encode", "capture", "-o", "x.htvm", "--preset", "web", "--bitrate", "4"},
              "--preset excludes --bitrate");
    ends_with({"encode", "capture", "-o", "x.htvm", "--passes", "2"}, "--passes requires --bitrate");
    ends_with({"publish", "-", "ws://localhost:1/publish/a", "--loop"}, "--loop: begins again, which standard input");
    ends_with({"publish", "ws://localhost:1/publish/a", "ws://localhost:1/publish/a"},
              "input: is a file or standard input; hubs come behind it");
    ends_with({"decode", "a.htvm", "-o", "-", "--json"}, "--json: prints on standard output, where -o - puts");
    ends_with({"encode"}, "input is required; 'htvm encode --help' tells more");
    ends_with({"encode", "capture"}, "--output is required; 'htvm encode --help' tells more");
    ends_with({"decode", "a.htvm"}, "-o: is required, or --audio for the sound alone");
    ends_with({"decode", "a.htvm", "--audio", "voice.txt"}, "--audio: 'voice.txt' does not end in one of");
    ends_with({"synth", "--live", "folder"}, "OUT_DIR: or --live: give one of them");
    ends_with({"synth", "-"}, "OUT_DIR: is a folder; for meshes on standard output give --live");
}

std::string refusal_of(std::vector<std::string> words) {
    const auto said = run(std::move(words));
    EXPECT_EQ(said.code, 2);
    return said.error;
}

TEST(CommandLine, SaysWhichCommandHasAnOptionThatThisOneLacks) {
    EXPECT_EQ(refusal_of({"check", "capture", "--fill", "off"}),
              "htvm: error: htvm check has no option --fill; it is one of 'htvm encode', beside --fill-holes; "
              "'htvm check --help-all' tells more\n");
    EXPECT_THAT(refusal_of({"decode", "a.htvm", "--presence=on"}),
                HasSubstr("htvm decode has no option --presence; it is one of 'htvm encode'; 'htvm decode"));
    EXPECT_THAT(refusal_of({"compare", "a", "b", "--fps", "30"}),
                HasSubstr("htvm compare has no option --fps; it is one of 'htvm check', "));
    EXPECT_THAT(refusal_of({"check", "capture", "--nowhere-known"}),
                HasSubstr("htvm check has no option --nowhere-known; 'htvm check --help-all'"));
}

TEST(CommandLine, SaysWhichOptionOfTheSameCommandIsAlike) {
    EXPECT_THAT(refusal_of({"check", "capture", "--frams", "3"}),
                HasSubstr("htvm check has no option --frams; did you mean --frames? 'htvm check"));
    EXPECT_THAT(refusal_of({"compare", "a", "b", "--cover", "3"}), HasSubstr("did you mean --covered-within? "));
}

TEST(CommandLine, TakesNoValueOfASwitchForAFile) {
    EXPECT_EQ(refusal_of({"encode", "capture", "--fill", "off", "-o", "x.htvm"}),
              "htvm: error: --fill: takes no value, and 'off' is behind it; did you mean --fill-holes? "
              "'htvm encode --help-all' tells more\n");
    EXPECT_THAT(refusal_of({"encode", "--drop-late", "on", "-o", "x.htvm"}),
                HasSubstr("--drop-late: takes no value, and 'on' is behind it; 'htvm encode"));
}

TEST(CommandLine, OffersTheWordThatAMisspeltOneIsLike) {
    EXPECT_THAT(refusal_of({"compare", "a", "b", "--only", "cover"}),
                HasSubstr("--only: cover is none of m1, m2, regions, coverage, texcoords, d1, d2, m3, flicker, "
                          "topology; did you mean coverage? 'htvm compare --help-all' tells more"));
    EXPECT_THAT(refusal_of({"compare", "a", "b", "--only", "m1,flikker"}), HasSubstr("did you mean flicker?"));
    EXPECT_THAT(refusal_of({"encode", "capture", "-o", "x.htvm", "--profile", "trackd"}),
                HasSubstr("--profile: trackd is none of tracked, topology, paper; did you mean tracked?"));
    EXPECT_THAT(refusal_of({"encode", "capture", "-o", "x.htvm", "--specks", "kep"}),
                HasSubstr("--specks must be keep or auto, not 'kep'; did you mean keep?"));
    EXPECT_THAT(refusal_of({"decode", "a.htvm", "-o", "x", "--format", "glbb"}), HasSubstr("did you mean glb?"));
}

}  // namespace
}  // namespace htvm::app
