// htvm link: addresses that let others watch for a while what a hub shows by link alone.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "commands.h"
#include "live/files/http_request.h"
#include "live/hub/stream_name.h"
#include "live/server/credentials.h"

namespace htvm::app {
namespace {

struct Options {
    std::string name, keys, hub = "http://127.0.0.1:8080";
    std::uint64_t seconds = 0;
    bool file = false, packets = false, segments = false;
};

// A path as an address spells it: what is no letter, digit or one of -_.~/ becomes %XX.
std::string in_address(const std::string& path) {
    std::string out;
    for (const char c : path) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("-_.~/").find(c) != std::string_view::npos;
        out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return out;
}

Result<void> link(const Options& options) {
    if (!options.file && !live::is_stream_name(options.name))
        return fail(ErrorKind::bad_input, fmt::format("'{}' is no name of a live stream: {}; --file makes a link to a "
                                                      "file",
                                                      options.name, live::stream_name_rule));
    if (const std::string ladder(live::ladder_of(options.name)); !options.file && ladder != options.name)
        return fail(ErrorKind::bad_input,
                    fmt::format("{} is a rung of {}, whose link is for all rungs", options.name, ladder));
    const auto served = live::path_segments('/' + in_address(options.name));
    const auto ends = [&](const char* ending) { return options.name.ends_with(ending); };
    if (options.file && (!served || served->empty() || !(ends(".htvm") || ends(".png") || ends(".jpg"))))
        return fail(ErrorKind::bad_input,
                    fmt::format("no hub serves '{}': names end in .htvm, .png or .jpg, and no part of one begins with "
                                "a dot",
                                in_address(options.name)));
    const auto keys = live::read_link_keys(options.keys);
    if (!keys) return tl::unexpected(keys.error());
    auto hub = options.hub;
    while (hub.ends_with('/')) hub.pop_back();
    if (!hub.starts_with("http://") && !hub.starts_with("https://"))
        return fail(ErrorKind::bad_input,
                    fmt::format("{} is no address of a hub: https://HOST or http://HOST:PORT", hub));
    const auto path = (options.file ? "files/" : options.segments ? "hls/" : "watch/") + options.name;
    const auto query = live::link_query(
        *keys, path, std::chrono::system_clock::now() + std::chrono::seconds(options.seconds), live::new_link_id());
    if (options.segments) {
        fmt::print("{}/hls/{}/{}/stream.m3u8\n", hub, live::link_segment(query), in_address(options.name));
        return {};
    }
    if (options.packets) hub.replace(0, 4, "ws");  // https becomes wss
    const auto shown = options.file || options.packets ? path : "play/" + options.name;
    fmt::print("{}/{}?{}\n", hub, in_address(shown), query);
    return {};
}

}  // namespace

void add_link(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("link", "Write a link by which to watch a stream of a hub for a while");
    command->add_option("name", options->name, "The live stream, or with --file a file below /files/")->required();
    command->add_option("--for", options->seconds, "How long the link is good: 90s, 30m, 2h or 7d")
        ->type_name("TIME")
        ->transform(
            CLI::AsNumberWithUnit(std::map<std::string, std::uint64_t>{{"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86400}},
                                  CLI::AsNumberWithUnit::UNIT_REQUIRED))
        // Before the other, which takes a negative time for a very long one.
        ->transform(CLI::Validator(
            [](const std::string& text) {
                return text.starts_with('-') ? "a link cannot be good for less than no time" : std::string();
            },
            ""))
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{3660} * 86400))
        ->required();
    command
        ->add_option("--keys", options->keys, "The hub's file of keys (htvm serve --link-keys); the newest one signs")
        ->type_name("FILE")
        ->required();
    command->add_option("--url", options->hub, "The hub's address, https or http (default http://127.0.0.1:8080)")
        ->type_name("ADDRESS");
    auto* file =
        command->add_flag("--file", options->file, "To a file, whose name may have folders, instead of a live stream");
    command
        ->add_flag("--packets", options->packets, "The address for programs, such as htvm decode, instead of the page")
        ->excludes(file);
    command
        ->add_flag("--segments", options->segments,
                   "The address of the stream's playlist (htvm serve --segments), in whose path the link is")
        ->excludes(file)
        ->excludes("--packets");
    command->footer(
        "Nobody can change the name or the time in a link. Whoever has it can pass it on; one that has expired ends\n"
        "no viewer who is already watching. Its id (id=...) in a file that htvm serve --revoked reads takes it back.\n"
        "Example:\n"
        "  htvm link anna --for 2h --keys keys.json --url https://hub.example");
    command->callback([options, &run] { run = [options] { return link(*options); }; });
}

}  // namespace htvm::app
