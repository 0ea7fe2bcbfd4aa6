#include "encoder_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "command_line/choice.h"
#include "command_line/headings.h"
#include "publishing.h"

namespace htvm::app {
namespace {

constexpr std::array profiles = {
    Choice<Profile>{"tracked", Profile::tracked},
    Choice<Profile>{"topology", Profile::topology},
    Choice<Profile>{"paper", Profile::paper},
};
constexpr std::array intra_coders = {
    Choice<IntraCoder>{"tfan", IntraCoder::tfan},
    Choice<IntraCoder>{"draco", IntraCoder::draco},
};

constexpr std::array presets = {
    Choice<Preset>{"web", Preset::web},
    Choice<Preset>{"studio", Preset::studio},
    Choice<Preset>{"master", Preset::master},
};

bool is(const Option& option, std::string_view name) { return option.name == name; }

// Under which heading the help lists an option.
const char* heading_of(const Option& option) {
    if (option.group == OptionGroup::topology) return heading::experiments;
    if (option.group == OptionGroup::tracked && !is(option, "tracked.effort")) return heading::tracked;
    if (is(option, "threads") || is(option, "latency_frames")) return heading::parallel;
    if (is(option, "session")) return heading::live;
    return is(option, "subject_size") ? heading::input : heading::quality;
}

// The option as it is on the command line: with the name and the unit of its flag.
Option as_flag(const Option& option) {
    Option out = option;
    out.name = option.flag;
    if (*option.flag_unit) out.unit = option.flag_unit;
    out.least = option.least / option.flag_factor;
    out.most = option.most / option.flag_factor;
    return out;
}

std::string capitalised(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
}

// The default in the first of the group's profiles, and in the others where it is different.
std::string default_text(const Option& option) {
    const auto text = [&](Profile profile) {
        return value_text(option, option.get(default_options(profile)) / option.flag_factor);
    };
    const auto topology = text(Profile::topology), paper = text(Profile::paper);
    const bool is_tracked = option.group == OptionGroup::tracked || option.group == OptionGroup::common;
    auto out = is_tracked ? text(Profile::tracked) : topology;
    if (option.group == OptionGroup::common && topology != out) out += "; topology: " + topology;
    if (option.group != OptionGroup::tracked && paper != topology) out += "; paper: " + paper;
    return out;
}

// What `htvm encode` takes in place of the library's default, and where; empty: nothing else.
std::string own_default(const Option& option) {
    if (is(option, "session")) return "random where the output is no file";
    if (is(option, "latency_frames")) return "1 for files";
    return "";
}

std::string help_of(const Option& option) {
    if (is(option, "topology.merge_duplicates"))
        return "Vertices that decode to the same point and attributes are merged by default, and triangles that "
               "collapse are dropped; with this, the decoded set of triangles is exactly the input's";
    if (option.kind == OptionKind::on_or_off) return (option.flag_off ? "Do without " : "") + meaning_text(option);
    auto text = capitalised(meaning_text(option));
    if (is(option, "rate.bits_per_second"))
        text +=
            ". A warning says how many frames have the lowest quality, have their motion alone, or were dropped, "
            "for which the exit code is 5";
    const std::string own = own_default(option);
    return fmt::format("{} ({}{}; default {}{})", text, range_text(as_flag(option)),
                       is(option, "session") ? ", or random" : "", own.empty() ? "" : own + ", else ",
                       default_text(option));
}

void add_option(CLI::App& command, EncodingOptions& options, const Option& option) {
    if (option.kind == OptionKind::on_or_off) {
        command
            .add_flag_callback(
                option.flag, [&options, &option] { options.given.emplace_back(&option, option.flag_off ? 0 : 1); },
                help_of(option))
            ->group(heading_of(option));
        return;
    }
    const auto take = [&options, &option](const std::string& text) {
        const bool drawn = text == "random" && is(option, "session");
        options.draws_session = options.draws_session || drawn;
        const auto value =
            drawn ? Result<double>(static_cast<double>(random_session())) : parse_value(as_flag(option), text);
        if (!value) throw CLI::ValidationError(value.error().message);
        options.given.emplace_back(&option, *value * option.flag_factor);
    };
    command.add_option_function<std::string>(option.flag, take, help_of(option))
        ->type_name(option.kind == OptionKind::word ? fmt::format("WORD:{{{}}}", fmt::join(option.words, ","))
                                                    : "NUMBER")
        ->group(heading_of(option));
}

// Options that are not in the library's list, or set several.
void add_quality(CLI::App& command, EncodingOptions& options) {
    command
        .add_option(
            "-q,--quality", options.quality,
            fmt::format(
                "Quality, 0 to 100 (default {}). How far the surface is off (M2, mm, measured on three captures): with "
                "--profile tracked 1.2 to 1.7 at 20, 0.7 to 1.1 at 40, 0.4 to 0.8 at 60, 0.2 to 0.7 at 80, where the "
                "noisier capture, with noise of 1.5 mm that is new in every frame, errs more; with topology 1.6 to 2 "
                "at "
                "20, 0.9 at 40, 0.4 at 60, 0.16 at 80, 0.07 at 100. Steps of positions are 16 mm at 0, 2 mm at 50, "
                "0.25 mm at 100; of colours 32, 5.7 and 1 of 255 levels",
                default_quality))
        ->check(CLI::Range(0.0, 100.0))
        ->type_name("NUMBER")
        ->group(heading::quality);
    add_choice(command, "--preset", options.preset, presets,
               "A quality by what the stream is for: web, to watch on pages and phones, -q 42, the default; studio, "
               "to look at closely, -q 65; master, to keep, and to make others of, -q 85. Meshes and pictures get "
               "finer together")
        ->type_name("WORD")
        ->group(heading::quality);
    add_choice(command, "--profile", options.profile, profiles,
               "What the stream keeps. tracked (default): the fewest bits. Each frame is the last "
               "I-frame's mesh laid on the "
               "frame's surface (T-frames), with or without a skeleton; connectivity and sampling are not "
               "the capture's. topology: keeps every frame's own connectivity, for several times the "
               "bits. paper: the same with the choices of the published method")
        ->type_name("WORD")
        ->group(heading::quality);
}

void add_what_is_beside_the_list(CLI::App& command, EncodingOptions& options) {
    add_choice(command, "--intra", options.intra, intra_coders,
               "Coder of the I-frames: tfan (default; keeps every triangle) or draco (drops isolated "
               "vertices, splits non-manifold ones)")
        ->type_name("WORD")
        ->group(heading::quality);
    command
        .add_option("--radii", options.radii_file,
                    "Bone radii from htvm calibrate (default: the skeleton file's, else calibrated on the "
                    "first frame)")
        ->type_name("FILE")
        ->group(heading::skeleton);
    command
        .add_option(
            "--passes", options.passes,
            "2 encodes twice, so that the rate is met and the quality stays even from frame to frame "
            "(default: 1 for standard input, which comes once; for files 2, and more where these are off by more "
            "than 5 %, as they can be on short captures)")
        ->check(CLI::Range(1, 2))
        ->type_name("NUMBER")
        ->group(heading::quality);
}

// What a player may want to know, and what people want to keep with a capture.
void add_scene_options(CLI::App& command, EncodingOptions& options) {
    command
        .add_option("--floor", options.floor,
                    "Height of the floor on the axis of --up, metres, or lowest: of the first frame's vertices "
                    "(default: not known)")
        ->type_name("NUMBER")
        ->group(heading::scene);
    command
        .add_option("--front", options.front,
                    "From where the subject is seen from the front, degrees around the body: the --azimuth with which "
                    "'htvm still capture/' looks at the face. Players begin there (default: where 0 looks)")
        ->check(CLI::Range(-360.0, 360.0))
        ->type_name("NUMBER")
        ->group(heading::scene);
    const auto add_text = [&](const std::string& flag, const std::string& key, const std::string& help) {
        command
            .add_option_function<std::string>(
                flag,
                [&options, key](const std::string& text) {
                    options.metadata.push_back({key, text});
                },
                help)
            ->type_name("TEXT")
            ->group(heading::scene);
    };
    add_text("--title", "title", "What it is, for people");
    add_text("--rights", "rights", "Whose it is, and what may be done with it");
    command
        .add_option_function<std::vector<std::string>>(
            "--meta",
            [&options](const std::vector<std::string>& pairs) {
                for (const auto& pair : pairs) {
                    const auto end = pair.find('=');
                    if (end == 0 || end == std::string::npos)
                        throw CLI::ValidationError("--meta", "'" + pair + "' is not KEY=VALUE");
                    options.metadata.push_back({pair.substr(0, end), pair.substr(end + 1)});
                }
            },
            "Anything else, KEY=VALUE; may be given several times. Players know timecode=HH:MM:SS:FF, of the "
            "first frame")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all()
        ->group(heading::scene);
}

// The title of each group in docs/options.md.
const char* title_of(OptionGroup group) {
    constexpr std::array<const char*, 4> titles = {"Every profile", "Rate control, instead of a quality",
                                                   "Profile tracked (the default)", "Profiles topology and paper"};
    return titles[static_cast<std::size_t>(group)];
}

}  // namespace

void add_encoding_options(CLI::App& command, EncodingOptions& options) {
    add_quality(command, options);
    for (const auto& option : option_list())
        if (*option.flag && !is(option, "quality")) add_option(command, options, option);
    add_what_is_beside_the_list(command, options);
    add_scene_options(command, options);
}

double quality_of(Preset preset) {
    switch (preset) {
        case Preset::web:
            return default_quality;
        case Preset::studio:
            return 65;
        case Preset::master:
            return 85;
    }
    return default_quality;
}

EncoderOptions encoder_options(const EncodingOptions& options) {
    auto out = default_options(options.profile);
    out.quality = options.preset ? quality_of(*options.preset) : options.quality;
    for (const auto& [option, value] : options.given) option->set(out, value);
    return out;
}

std::string options_in_markdown() {
    std::string out =
        "# Options of the encoder\n\n"
        "Printed by `htvm encode --help-options`, from the one list by which all of them are checked\n"
        "([encoder_options.cpp](../src/codec/encoder/encoder_options.cpp)). Names are those of the C++ struct's "
        "fields\n"
        "([encoder_options.hpp](../include/htvm/encoder_options.hpp)) and of the C interface\n"
        "(`htvm_encoder_options_set`). Details: [the published method](published_method.md), [tracked "
        "frames](tracked_frames.md).\n";
    for (const auto group : {OptionGroup::common, OptionGroup::rate, OptionGroup::tracked, OptionGroup::topology}) {
        out += fmt::format("\n## {}\n\n| option | `htvm encode` | range | default | meaning |\n|---|---|---|---|---|\n",
                           title_of(group));
        for (const auto& option : option_list()) {
            if (option.group != group) continue;
            std::string flag = *option.flag ? fmt::format("`{}`", option.flag) : "";
            if (option.flag_off) flag += ": off";
            if (*option.flag_unit) flag += fmt::format(", {}", option.flag_unit);
            Option listed = option;
            listed.flag_factor = 1;  // in the library's unit
            const std::string own = own_default(option);
            out +=
                fmt::format("| `{}` | {} | {} | {}{} | {} |\n", option.name, flag, range_text(option),
                            default_text(listed), own.empty() ? "" : "; `htvm encode`: " + own, meaning_text(option));
        }
    }
    out +=
        "\n## Not in the list\n\n"
        "| field | `htvm encode` | meaning |\n|---|---|---|\n"
        "| `profile` | `--profile` | tracked (default), topology or paper: `default_options(profile)`, and "
        "`htvm_encoder_options_create` in C, give its defaults |\n"
        "| `runner` | | the caller's own threads (`htvm_encoder_options_set_run_tasks` in C) |\n"
        "| `skeleton` | `--skeleton` | the capture's joints and bones; none: one bone that spans the mesh is used |\n"
        "| `radii` | `--radii` | radii of the bones, from `calibrate()` or `htvm calibrate` |\n"
        "| `floor` | `--floor` | height of the floor: its coordinate on the `up` axis, mm |\n"
        "| | `--front` | from where the subject is seen from the front, degrees around the body: the direction as the "
        "entry `front` of the metadata |\n"
        "| `metadata` | `--title`, `--rights`, `--meta` | title, rights and other pairs of texts "
        "(`htvm_encoder_options_add_metadata` in C) |\n"
        "| `intra_coder` | `--intra` | a coder of I-frames other than TFAN |\n"
        "| `rate.first_pass` | `--passes` | the size of every frame in a first run |\n"
        "| `fps_numerator`, `fps_denominator` | `--fps` | default: as in the skeleton file |\n"
        "| `unit_micrometres` | `--unit` | default: guessed from the size of the meshes |\n";
    return out;
}

}  // namespace htvm::app
