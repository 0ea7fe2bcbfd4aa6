#include "publishing.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <utility>

#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "live/client/hub_address.h"
#include "live/hub/stream_name.h"

namespace htvm::app {
namespace {

using Clock = std::chrono::steady_clock;

// A token is one line of printable characters: anything else would not pass through a request.
Result<std::string> checked_token(std::string token, const std::string& where) {
    while (!token.empty() && (token.back() == '\n' || token.back() == '\r' || token.back() == ' ')) token.pop_back();
    constexpr std::size_t longest = 1024;
    const bool fine = !token.empty() && token.size() <= longest &&
                      std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
    if (!fine) return fail(ErrorKind::bad_input, where + " has no token: one line of at most 1,024 letters and signs");
    return token;
}

}  // namespace

Result<std::string> token_of_environment() {
    const char* given = std::getenv("HTVM_TOKEN");
    if (!given || !*given) return std::string();
    return checked_token(given, "HTVM_TOKEN");
}

namespace {

Result<std::string> token_of(const PublishingOptions& options) {
    if (!options.token_file.empty()) {
        std::ifstream file(options.token_file);
        std::string line;
        if (!file) return fail(ErrorKind::bad_input, options.token_file + " cannot be read");
        std::getline(file, line);
        return checked_token(line, options.token_file);
    }
    if (!options.token.empty()) return checked_token(options.token, "--token");
    return token_of_environment();
}

}  // namespace

void add_hub_trust(CLI::App& command, HubTrust& trust) {
    command
        .add_option("--ca", trust.certificates,
                    "wss: PEM file of the certificates that may vouch for the hub's (default: the system's)")
        ->type_name("FILE")
        ->check(CLI::ExistingFile)
        ->group(heading::live);
    command
        .add_flag("--insecure", trust.insecure, "wss: take any certificate, whoever may be behind it: for tests alone")
        ->group(heading::live);
}

void add_publishing_options(CLI::App& command, PublishingOptions& options) {
    auto* token =
        command
            .add_option("--token", options.token,
                        "The token by which the hub knows who may publish. Others on this machine can see it\n"
                        "here: the environment variable HTVM_TOKEN, or a file, keeps it")
            ->type_name("TOKEN")
            ->group(heading::live);
    command.add_option("--token-file", options.token_file, "A file whose first line is the token")
        ->type_name("FILE")
        ->excludes(token)
        ->group(heading::live);
    add_hub_trust(command, options.trust);
    command
        .add_flag("--end", options.ends,
                  "At the end, tell viewers that the stream has ended; otherwise the hub keeps it for a while, for\n"
                  "whoever goes on with it")
        ->group(heading::live);
    command
        .add_flag("--stamps", options.stamps,
                  "Tell when each frame was sent, for measurements by viewers who ask for it (?stamps)")
        ->group(heading::live);
}

Destination destination_of(const std::string& path_or_address) {
    using enum DestinationKind;
    if (path_or_address == "-") return {path_or_address, standard_output};
    if (live::looks_like_hub_address(path_or_address)) return {path_or_address, hub};
    std::error_code error;
    const bool is_there = std::filesystem::exists(path_or_address, error);
    return {path_or_address, is_there && !std::filesystem::is_regular_file(path_or_address, error) ? pipe : file};
}

std::uint64_t random_session() {
    std::random_device random;
    constexpr std::uint64_t largest = (std::uint64_t{1} << 53) - 1;
    return std::max<std::uint64_t>((std::uint64_t{random()} << 32 | random()) & largest, 1);
}

std::string shown_place(const std::string& path_or_address) {
    if (path_or_address == "-") return "standard output";
    if (!live::looks_like_hub_address(path_or_address)) return path_or_address;
    return path_or_address.substr(0, path_or_address.find('?'));
}

std::string rung_address(const std::string& address, std::size_t number) {
    const auto end = std::min(address.find('?'), address.size());
    const auto publish = address.find("/publish/");
    if (publish == std::string::npos || publish > end) return address;
    return live::rung_name(address.substr(0, end), number) + address.substr(end);
}

Result<Publishing> Publishing::open(const std::string& address, const PublishingOptions& options) {
    if (address.find("/publish/") == std::string::npos)
        return fail(ErrorKind::bad_input, "'" + shown_place(address) +
                                              "' is not where a stream is published: "
                                              "that is ws://HOST:PORT/publish/NAME");
    auto token = token_of(options);
    if (!token) return tl::unexpected(token.error());
    PublisherOptions settings;
    settings.token = std::move(*token);
    settings.other_hubs = options.other_hubs;
    settings.certificates = options.trust.certificates;
    settings.insecure = options.trust.insecure;
    settings.stamps = options.stamps;
    auto publisher = Publisher::open(address, settings);
    if (!publisher) return tl::unexpected(publisher.error());
    return Publishing(std::move(*publisher), options.ends);
}

// A hub takes the connection before it judges the stream: it is found again once it has kept the connection for a
// while, which is longer than it takes to refuse what it was sent.
void Publishing::tell() {
    constexpr std::chrono::seconds kept{1};
    const auto now = publisher_.state();
    if (now.is_over) return;  // said by who ends for it
    if (!now.trouble.empty() && now.trouble != told_) {
        warn(now.trouble + "; trying again");
        told_ = now.trouble;
    }
    if (!now.connected || std::exchange(connections_, now.connections) != now.connections) connected_ = Clock::now();
    if (!now.connected || told_.empty() || Clock::now() - connected_ < kept) return;
    note("connected to " + now.hub);
    told_.clear();
}

Result<void> Publishing::send(const Packet& packet) {
    auto sent = publisher_.send(packet);
    if (sent) tell();
    return sent;
}

LineState Publishing::line() const {
    const auto state = publisher_.state();
    return {Clock::now(), state.connected, state.queue_time, state.sent_bytes};
}

std::string Publishing::progress() {
    const auto state = publisher_.state();
    const auto now = Clock::now();
    constexpr std::chrono::seconds window{2};
    if (now - looked_ >= window) {
        const double seconds = std::chrono::duration<double>(now - looked_).count();
        megabits_ = 8e-6 * static_cast<double>(state.sent_bytes - bytes_then_) / seconds;
        looked_ = now;
        bytes_then_ = state.sent_bytes;
    }
    if (!state.connected) return "not connected";
    std::string out = fmt::format("{:.2f} Mbit/s", megabits_);
    if (state.viewers) out += ", " + counted(*state.viewers, "viewer");
    if (state.queue_bytes > 0)
        out += fmt::format(", {:.2f} s wait", static_cast<double>(state.queue_time.count()) / 1e3);
    if (state.dropped_frames > 0) out += fmt::format(", {} dropped", state.dropped_frames);
    return out;
}

Result<void> Publishing::finish() {
    constexpr std::chrono::milliseconds patience{5000}, after_interruption{1000};
    const auto timeout = interruption() == 0 ? patience : after_interruption;
    return ends_ ? publisher_.finish(timeout) : publisher_.leave(timeout);
}

}  // namespace htvm::app
