// htvm calibrate: bone radii from a T-pose.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "command_line/capture.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/encoder.hpp"
#include "io/output_file.h"

namespace htvm::app {
namespace {

struct Options {
    CaptureOptions capture;
    CalibrationOptions calibration;
    std::string output = "-";
};

Result<void> calibrate_capture(const Options& options) {
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    if (capture->skeleton().bones.empty())
        return fail(ErrorKind::bad_input, "calibration needs a skeleton; give one with --skeleton");
    const auto mesh = capture->next();
    if (!mesh) return tl::unexpected(mesh.error());
    if (!*mesh) return fail(ErrorKind::bad_input, "there was no mesh to calibrate on");
    const auto radii = calibrate(**mesh, capture->skeleton(), *capture->pose(), options.calibration);
    if (!radii) return tl::unexpected(radii.error());
    nlohmann::json out;
    out["radii"] = *radii;
    const auto& names = capture->skeleton().joint_names;
    for (std::size_t i = 0; i < radii->size(); ++i) {
        const auto& bone = capture->skeleton().bones[i];
        out["bones"].push_back({names[bone.first], names[bone.second]});
        note(fmt::format("{} - {}: {:.0f} mm", names[bone.first], names[bone.second], (*radii)[i]));
    }
    if (options.output == "-") {
        fmt::print("{}\n", out.dump(2));
        return {};
    }
    return write_file(options.output, out.dump(2) + "\n");
}

}  // namespace

void add_calibrate(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command =
        app.add_subcommand("calibrate", "Measure the bones' radii on a frame in T-pose, for encode --radii");
    add_capture_options(*command, options->capture);
    command->get_option("--skeleton")
        ->description("The tracked skeleton: htvm's JSON (docs/skeleton.md), BVH, or Azure Kinect's JSON")
        ->required();
    command
        ->add_option("--percentile", options->calibration.percentile,
                     "Percentile of the distances of a bone's vertices (default 70); 100, the paper's maximum, suffers "
                     "from outliers")
        ->check(CLI::Range(0.0, 100.0));
    command->add_option("-o,--output", options->output, "The calibration, JSON (default: - for standard output)")
        ->type_name("FILE");
    command->footer(
        "The first frame is used; --first N takes frame N.\n"
        "Example:  htvm calibrate capture/ --skeleton capture/skeleton.json -o radii.json");
    command->callback([options, &run] { run = [options] { return calibrate_capture(*options); }; });
}

}  // namespace htvm::app
