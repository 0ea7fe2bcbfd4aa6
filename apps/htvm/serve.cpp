// htvm serve: a hub of live streams, and a folder of streams, for others to watch, with a page that plays them.
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "command_line/headings.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "live/files/http_request.h"
#include "live/files/player_files.h"
#include "live/server/credentials.h"
#include "live/server/live_segments.h"
#include "live/server/recorder.h"
#include "live/server/server.h"

namespace htvm::app {
namespace {

struct Options {
    live::ServerOptions server;
    live::HubLimits hub;
    live::RecorderOptions recorder;
    std::optional<live::LiveSegmentOptions> segments{};
    double window_seconds = 60, part_seconds = 0;
    std::optional<std::string> add_publisher{};  // only to make a token
    std::string congestion_control = "bbr";
    std::string access_log{};  // a file, or "-"
    bool same_site = false, add_link_key = false, json = false;
    Options() {
        server.port = 8080;
        server.admission.connections = 4096;
        server.admission.connections_per_address = 256;
        server.admission.viewers_per_address = 200;
    }
};

// Each connection needs a file descriptor, and each file that is being sent another.
void allow_files(std::size_t connections) {
    constexpr std::size_t others = 64;
    rlimit limit{};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
    const auto wanted = std::min<rlim_t>(2 * connections + others, limit.rlim_max);
    if (limit.rlim_cur >= wanted) return;
    limit.rlim_cur = wanted;
    setrlimit(RLIMIT_NOFILE, &limit);
}

// For people on standard error, for machines on standard output.
void write_event(const live::Event& event, bool json) {
    const auto now = std::chrono::system_clock::now();
    if (json) {
        fmt::print("{}\n", json_line(event, now));
        std::fflush(stdout);
    } else if (event.warning) {
        warn(text_line(event, now));
    } else {
        note(text_line(event, now));
    }
}

// So many events of a name can a person read.
constexpr std::uint64_t told_each_second = 20;

// A file to which others may write, too, and which is opened anew where another program has moved it away.
class AppendedFile {
public:
    explicit AppendedFile(std::string path) : path_(std::move(path)) {}
    Result<void> open() {
        std::unique_ptr<std::FILE, Close> file(std::fopen(path_.c_str(), "ae"));
        if (!file) return fail(ErrorKind::bad_input, fmt::format("cannot write {}: {}", path_, std::strerror(errno)));
        file_ = std::move(file);
        return {};
    }
    void write(const std::string& line) {
        fmt::print(file_.get(), "{}\n", line);
        std::fflush(file_.get());
    }

private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::string path_;
    std::unique_ptr<std::FILE, Close> file_;
};

// Every request, as its own line.
Result<void> open_access_log(const Options& options, live::ServerOptions& server) {
    if (options.access_log.empty()) return {};
    const auto line_of = [json = options.json](const live::Event& event) {
        const auto now = std::chrono::system_clock::now();
        return json ? json_line(event, now) : text_line(event, now);
    };
    if (options.access_log == "-") {
        server.access_log = [line_of](const live::Event& event) {
            fmt::print("{}\n", line_of(event));
            std::fflush(stdout);
        };
        return {};
    }
    const auto file = std::make_shared<AppendedFile>(options.access_log);
    if (auto opened = file->open(); !opened) return opened;
    server.access_log = [file, line_of](const live::Event& event) { file->write(line_of(event)); };
    server.reload = [file] {
        if (const auto opened = file->open(); !opened) warn(opened.error().message);
    };
    return {};
}

// The socket that systemd hands over, if it does (sd_listen_fds); -1: none.
int inherited_socket() {
    constexpr int first = 3;
    const auto number = [](const char* name) {
        const char* text = std::getenv(name);
        return text ? live::whole_number(text).value_or(0) : 0;
    };
    if (number("LISTEN_PID") != static_cast<std::uint64_t>(getpid()) || number("LISTEN_FDS") == 0) return -1;
    fcntl(first, F_SETFD, FD_CLOEXEC);
    return first;
}

// Where to open it in a browser.
std::string address_of(const live::ServerOptions& server, std::uint16_t port) {
    const bool six = server.address.find(':') != std::string::npos;
    return fmt::format("{}://{}{}{}:{}/", server.certificate.empty() ? "http" : "https", six ? "[" : "", server.address,
                       six ? "]" : "", port);
}

Result<void> add_publisher(const Options& options) {
    const auto token = live::add_publisher(options.server.admission.publishers, *options.add_publisher);
    if (!token) return tl::unexpected(token.error());
    note(fmt::format(
        "the token of {}, which is shown only now: {} keeps no more than a hash of it. A hub that runs reads "
        "the file again when it is sent SIGHUP.",
        *options.add_publisher, options.server.admission.publishers));
    fmt::print("{}\n", *token);
    return {};
}

Result<void> add_link_key(const Options& options) {
    const auto number = live::add_link_key(options.server.admission.link_keys);
    if (!number) return tl::unexpected(number.error());
    note(fmt::format(
        "{} has key {} now; links by the one before stay good until another is added. A hub that runs reads "
        "the file again when it is sent SIGHUP.",
        options.server.admission.link_keys, *number));
    return {};
}

// Options that say nothing without another, and so leave open what was meant to be closed.
Result<void> check_who_may(const live::ServerOptions& server) {
    const auto& who = server.admission;
    const bool asks = !server.authority.url.empty() || !who.web_token_keys.empty();
    if (!asks && !(who.guard_publishing && who.guard_watching))
        return fail(ErrorKind::bad_input, "--auth-for says what --auth and --jwt-keys are for: add one of them");
    if (!who.revoked.empty() && who.link_keys.empty() && who.web_token_keys.empty())
        return fail(ErrorKind::bad_input,
                    "--revoked takes links and tokens back: add --link-keys or --jwt-keys, which say what these are");
    return {};
}

Result<void> serve(const Options& options) {
    const auto log =
        live::limited([json = options.json](const live::Event& event) { write_event(event, json); }, told_each_second);
    live::Hub hub(options.hub, log);
    auto server = options.server;
    // What runs on this machine for this machine is nobody else's: neither by a name that another site lets lead here,
    // nor by a page of another site in a browser here.
    const bool for_this_machine = live::is_loopback(server.address);
    server.admission.loopback_names = for_this_machine;
    if (for_this_machine) server.admission.hosts.push_back(server.address);
    server.admission.other_sites = !options.same_site && !for_this_machine && server.admission.origins.empty();
    server.listening_socket = inherited_socket();
    if (auto opened = open_access_log(options, server); !opened) return opened;
    if (options.congestion_control != "system") server.congestion_control = options.congestion_control;
    server.hub = &hub;
    std::optional<live::Recorder> recorder;
    if (!options.recorder.folder.empty()) {
        auto opened = live::Recorder::open(options.recorder);
        if (!opened) return tl::unexpected(opened.error());
        server.recorder = &recorder.emplace(std::move(*opened));
    }
    std::optional<live::LiveSegments> segments;
    if (options.segments) {
        auto settings = *options.segments;
        settings.window_seconds = options.window_seconds;
        settings.part_seconds = options.part_seconds;
        server.segments = &segments.emplace(settings, hub);
    }
    if (auto ok = check_who_may(server); !ok) return ok;
    server.log = log;
    allow_files(server.admission.connections);
    auto opened = live::Server::open(server);
    if (!opened) return tl::unexpected(opened.error());
    if (!live::has_player()) warn("this htvm was built without the web player: it serves streams, but has no pages");
    if (const auto used = opened->congestion_control();
        options.congestion_control != "system" && used != options.congestion_control)
        warn(fmt::format(
            "this kernel's TCP has no '{}' (modprobe tcp_bbr loads bbr): it uses {}, with which live streams "
            "come late where packets are lost",
            options.congestion_control, used));
    const auto address = address_of(server, opened->port());
    if (options.json) {
        log({.name = "listening", .text = "listening at " + address, .numbers = {{"port", opened->port()}}});
    } else {
        fmt::print("{}\n", address);
        std::fflush(stdout);
    }
    const bool asks = !server.admission.web_token_keys.empty() || !server.authority.url.empty();
    if (server.admission.publishers.empty() && !(asks && server.admission.guard_publishing))
        log({.name = "publishing_open",
             .text = "no publishers are known: programs on this machine may publish, under any name, and nobody else"});
    opened->run();
    if (recorder) {
        recorder->finish();
        for (const auto& event : recorder->new_events()) log(event);
    }
    log({.name = "stopped", .text = "stopped"});
    return {};
}

void add_nats_options(CLI::App& command, live::NatsOptions& nats) {
    auto* servers = command
                        .add_option("--nats", nats.servers,
                                    "Join the hubs of other machines through NATS, at nats:// or tls://"
                                    "[USER:PASSWORD@]HOST[:PORT]; other users of this machine see the command line, "
                                    "but not the environment's HTVM_NATS")
                        ->type_name("URL")
                        ->envname("HTVM_NATS");
    command.add_option("--hub-name", nats.hub_name, "This hub's name among them (default: the machine's)")
        ->type_name("NAME")
        ->needs(servers);
    command
        .add_option("--hub-url", nats.hub_url,
                    "Where publishers and viewers reach this hub, such as wss://hub.example:8080; they are told "
                    "the addresses of all hubs")
        ->type_name("ADDRESS")
        ->needs(servers);
    command
        .add_option("--nats-ca", nats.ca_file, "Certificates to check those of NATS by (PEM; default: the system's)")
        ->type_name("FILE")
        ->needs(servers);
    command.add_option("--nats-credentials", nats.credentials_file, "A user of NATS's own accounts: JWT and seed")
        ->type_name("FILE")
        ->needs(servers);
}

// The options of the command as lines "name = value". What the command line has given already stays.
void read_options(CLI::App& command, const std::string& path) {
    CLI::ConfigTOML format;
    for (const auto& item : format.from_file(path)) {
        auto* option = item.parents.empty() ? command.get_option_no_throw("--" + item.name) : nullptr;
        if (!option || !option->get_configurable())
            throw CLI::ValidationError(path, "has '" + item.fullname() + "', which is no option");
        if (!option->empty()) continue;
        if (option->get_expected_min() == 0)
            option->add_result(option->get_flag_value(item.name, format.to_flag(item)));
        else
            for (const auto& value : item.inputs) option->add_result(value);
    }
}

// As browsers name it: anything behind the host would be no page's.
std::string is_site(const std::string& text) {
    const auto begin = text.find("://");
    const bool named = begin != std::string::npos && begin > 0 && begin + 3 < text.size();
    return named && text.find('/', begin + 3) == std::string::npos ? ""
                                                                   : text + " is no site such as https://a.example";
}

void add_access_options(CLI::App& command, Options& options) {
    auto& server = options.server;
    auto* certificate = command
                            .add_option("--cert", server.certificate,
                                        "With TLS: the certificate, and those between it and its root (PEM)")
                            ->type_name("FILE");
    auto* key =
        command.add_option("--key", server.private_key, "The certificate's private key (PEM)")->type_name("FILE");
    certificate->needs(key);
    key->needs(certificate);
    auto* publishers =
        command
            .add_option("--publishers", server.admission.publishers,
                        "Who may publish: a file that --add-publisher writes (default: programs on this machine)")
            ->type_name("FILE");
    command
        .add_option_function<std::string>(
            "--add-publisher", [&options](const std::string& name) { options.add_publisher = name; },
            "Make a token for the stream of this name, print it, keep its hash in the file, and end")
        ->type_name("NAME")
        ->needs(publishers)
        ->configurable(false);
    auto* keys = command
                     .add_option("--link-keys", server.admission.link_keys,
                                 "Watching needs a link that htvm link signs with a key of this file, which "
                                 "--add-link-key writes (default: anyone may watch)")
                     ->type_name("FILE");
    command
        .add_flag("--add-link-key", options.add_link_key, "Add a key to the file, drop all but the newest two, and end")
        ->needs(keys)
        ->configurable(false);
    auto* origins = command
                        .add_option("--origin", server.admission.origins,
                                    "Pages of this site, such as https://a.example, may read and watch, and no other "
                                    "site's; may be given more than once (default: pages of all sites, but none "
                                    "where the address is this machine's alone)")
                        ->type_name("SITE")
                        ->check(is_site)
                        ->allow_extra_args(false);
    command
        .add_option("--host", server.admission.hosts,
                    "Answer requests for this host, such as hub.example, and for this machine's own address alone; may "
                    "be given more than once (default: any host, but none other where the address is this machine's "
                    "alone)")
        ->type_name("NAME")
        ->allow_extra_args(false);
    command.add_flag("--same-site", options.same_site, "Pages of no other site may read and watch")->excludes(origins);
}

void add_others_word(CLI::App& command, Options& options) {
    auto& admission = options.server.admission;
    command
        .add_option(
            "--revoked", admission.revoked,
            "Links and tokens that were taken back: a file of their ids, a line each (htvm link writes id=ID into "
            "links; JWT: jti)")
        ->type_name("FILE");
    auto* keys = command
                     .add_option("--jwt-keys", admission.web_token_keys,
                                 "Who shows a token (JWT, RS256 or ES256) that one of these public keys signed may "
                                 "publish and watch what it names (PEM or JWKS)")
                     ->type_name("FILE");
    command
        .add_option("--jwt-audience", admission.web_token_audience,
                    "What the tokens' aud must name (default: tokens have none)")
        ->type_name("TEXT")
        ->needs(keys);
    auto* authority =
        command
            .add_option("--auth", options.server.authority.url,
                        "Ask this web service, http:// or https://, who may publish and watch: it is sent a "
                        "POST of JSON, and answers 200 or 403")
            ->type_name("URL");
    command
        .add_option_function<unsigned>(
            "--auth-time", [&options](unsigned given) { options.server.authority.time = std::chrono::seconds(given); },
            "Seconds for its answer (default 5); without one nobody is let in")
        ->check(CLI::Range(1, 60))
        ->needs(authority);
    command
        .add_option_function<std::string>(
            "--auth-for",
            [&admission](const std::string& what) {
                admission.guard_publishing = what != "watch";
                admission.guard_watching = what != "publish";
            },
            "What --jwt-keys and --auth are for: publish, watch, or both (default both)")
        ->type_name("WHAT")
        ->check(CLI::IsMember({"publish", "watch", "both"}));
}

void add_proxies(CLI::App& command, Options& options) {
    auto& server = options.server;
    auto* trusted = command
                        .add_option("--trust-proxy", server.trusted_proxies,
                                    "A web server or load balancer before the hub, by its address or network such as "
                                    "10.0.0.0/8: whom it names in X-Forwarded-For counts as the client; may be given "
                                    "more than once (default: none is believed)")
                        ->type_name("ADDRESS")
                        ->allow_extra_args(false);
    command
        .add_flag("--proxy-protocol", server.proxy_protocol,
                  "Connections from there begin with a header of the PROXY protocol, version 1 or 2")
        ->needs(trusted);
    command.add_flag("--reuse-port", server.share_port,
                     "Other hubs may listen on the same port: one that is started takes over before this one ends");
}

// An option whose number may be left out.
CLI::Option* add_seconds(CLI::App& command, const std::string& name, double left_out, std::pair<double, double> range,
                         const std::function<void(double)>& set, const std::string& text) {
    const auto take = [=](const CLI::results_t& given) {
        double seconds = left_out;
        if (!given.empty() && !given[0].empty() && !CLI::detail::lexical_cast(given[0], seconds)) return false;
        if (seconds < range.first || seconds > range.second)
            throw CLI::ValidationError(name,
                                       fmt::format("{} is not from {} to {}", seconds, range.first, range.second));
        set(seconds);
        return true;
    };
    return command.add_option(name, take, text)->type_name("SECONDS")->expected(0, 1);
}

void add_segments(CLI::App& command, Options& options) {
    auto* segments = add_seconds(
        command, "--segments", 2, {1, 60}, [&options](double seconds) { options.segments.emplace().seconds = seconds; },
        "Offer each live stream to HTTP caches and their viewers, too: /hls/NAME/stream.m3u8 is a playlist (HLS) of "
        "segments of about so many seconds (default 2), cut where players can start");
    command
        .add_option("--window", options.window_seconds,
                    "Seconds of each stream that its playlist has, so far can viewers go back (default 60)")
        ->type_name("SECONDS")
        ->check(CLI::Range(1.0, 86400.0))
        ->needs(segments);
    add_seconds(
        command, "--parts", 0.5, {0.1, 2}, [&options](double seconds) { options.part_seconds = seconds; },
        "Offer a segment in parts of at most so many seconds (default 0.5) while it comes, so viewers are less late")
        ->needs(segments);
}

void add_recording(CLI::App& command, Options& options) {
    auto* folder = command
                       .add_option("--record", options.recorder.folder,
                                   "Keep each session of a live stream in this folder, as NAME-YYYYMMDD-HHMMSS.htvm")
                       ->type_name("FOLDER");
    command
        .add_option_function<unsigned>(
            "--record-minutes",
            [&options](unsigned minutes) { options.recorder.file_length = std::chrono::minutes(minutes); },
            "Begin another file after so many minutes (default: a file a session)")
        ->check(CLI::Range(1, 100000))
        ->needs(folder);
    command
        .add_option("--access-log", options.access_log,
                    "Write each request to this file, or to standard output (-); with --json as JSON. SIGHUP opens the "
                    "file anew")
        ->type_name("FILE");
    command.add_flag("--metrics-anyone", options.server.admission.metrics_anyone,
                     "Show /metrics to everybody (default: to programs on this machine)");
}

void add_limits(CLI::App& command, Options& options) {
    const auto add = [&](const char* name, auto& limit, const std::string& text) {
        command.add_option(name, limit, fmt::format("{} (default {})", text, limit))->check(CLI::Range(1, 1000000));
    };
    auto& server = options.server;
    command
        .add_option("--threads", server.line_threads,
                    "Threads, beside the hub's own, over which what connections read, write and encrypt is spread "
                    "(default 0: the hub's own does it)")
        ->check(CLI::Range(0, 256));
    add("--connections", server.admission.connections, "Connections at once");
    add("--connections-per-address", server.admission.connections_per_address,
        "Of these from one address; an IPv6 network /64 is one");
    add("--streams", options.hub.streams, "Live streams at once");
    add("--viewers", options.hub.viewers, "Viewers of one live stream");
    add("--viewers-per-address", server.admission.viewers_per_address, "Viewers of live streams from one address");
    const auto add_bytes = [&](const char* name, std::size_t& limit, const std::string& text) {
        command.add_option(name, limit, fmt::format("{} (default {} MiB)", text, limit >> 20))
            ->transform(CLI::AsSizeValue(false));
    };
    add_bytes("--message-bytes", options.hub.packet_bytes, "A publisher's largest message");
    add_bytes("--memory", options.hub.memory, "All packets of live streams, kept, waiting, and come in part");
    add_bytes("--stream-memory", options.hub.stream_memory, "Of these, those of one stream");
    const auto add_time = [&](const char* name, auto& limit, const std::string& text) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit).count();
        command
            .add_option_function<unsigned>(
                name, [&limit](unsigned given) { limit = std::chrono::seconds(given); },
                fmt::format("Seconds for {} (default {})", text, seconds))
            ->check(CLI::Range(1, 3600));
    };
    add_time("--header-time", server.header_time, "a request's header, and for agreeing on TLS");
    add_time("--grace", options.hub.remembered_without_publisher,
             "a stream's publisher to come back, before its viewers are told that it has ended");
    add_time("--message-time", options.hub.message_time, "a message of a publisher or viewer, from its first part on");
}

}  // namespace

void add_serve(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command =
        app.add_subcommand("serve", "Carry live streams and serve a folder of streams, with a page that plays them");
    // The first option, since options are taken in this order, and it sets others.
    command
        ->add_option_function<std::string>(
            "--config", [command](const std::string& path) { read_options(*command, path); },
            "Read options from a file, a line each: port = 8443. Those of the command line come before its own")
        ->type_name("FILE")
        ->check(CLI::ExistingFile)
        ->configurable(false);
    auto& server = options->server;
    command
        ->add_option("--files", server.folder,
                     "A folder: its .htvm, .png and .jpg files can be read by anyone (default: live streams only)")
        ->type_name("FOLDER");
    command->add_option("--address", server.address,
                        "Address to listen on (default 127.0.0.1: this machine alone; 0.0.0.0 or ::: all networks)");
    command->add_option("--port", server.port, "Port to listen on; 0: a free one (default 8080)")
        ->check(CLI::Range(0, 65535));
    command
        ->add_option("--congestion-control", options->congestion_control,
                     "How TCP finds out how fast it may send: bbr (default; where packets are lost, live streams come "
                     "late with others: docs/live.md), another that the kernel has, or system: the kernel's choice")
        ->type_name("NAME");
    const auto under = [command](const char* heading) { command->option_defaults()->group(heading); };
    under("Hubs of other machines");
    add_nats_options(*command, server.nats);
    under("Who may publish and watch");
    add_access_options(*command, *options);
    add_others_word(*command, *options);
    under("Behind other servers");
    add_proxies(*command, *options);
    under("Caches before the hub");
    add_segments(*command, *options);
    under("Recording and watching over it");
    add_recording(*command, *options);
    command->add_flag("--json", options->json,
                      "Log as JSON, an object a line, on standard output (default: for people, on standard error)");
    under(heading::limits);
    add_limits(*command, *options);
    under("Options");
    add_front_page(*command,
                   {{{"--files"},
                     {"--address", "Address to listen on (default 127.0.0.1, this machine; ::, all networks)"},
                     {"--port", "Port to listen on (default 8080)"},
                     {"--cert", "With TLS: the certificate (PEM)"},
                     {"--key", "The certificate's private key (PEM)"},
                     {"--publishers"},
                     {"--add-publisher"},
                     {"--link-keys", "Watching needs a link that htvm link signs with a key of this file"},
                     {"--add-link-key"},
                     {"--origin", "Pages of this site alone may read and watch (default: of all)"},
                     {"--segments", "Offer live streams to HTTP caches: /hls/NAME/stream.m3u8"},
                     {"--record", "Keep each session of a live stream in this folder"},
                     {"--config", "Read options from a file, a line each: port = 8443"},
                     {"--json", "Log as JSON, an object a line"}}});
    command->footer(
        "Runs until Ctrl-C or SIGTERM, which give viewers and publishers 5 seconds to be told and to leave; a second "
        "one\n"
        "ends it at once. SIGHUP makes it read certificate, publishers and keys again. Live streams are published to\n"
        "ws://ADDRESS:PORT/publish/NAME and watched at http://ADDRESS:PORT/play/NAME (wss and https with --cert). Of "
        "the\n"
        "folder, symbolic links and hidden files are not served; the page shows NAME.png or NAME.jpg as the still of\n"
        "NAME.htvm if it lies beside it (htvm still makes one).\n"
        "Examples:\n"
        "  htvm serve --files streams/ --address 0.0.0.0\n"
        "  htvm serve --publishers publishers.json --add-publisher anna\n"
        "  htvm serve --address :: --cert chain.pem --key key.pem --publishers publishers.json");
    command->callback([options, &run] {
        run = [options] {
            if (options->add_publisher) return add_publisher(*options);
            return options->add_link_key ? add_link_key(*options) : serve(*options);
        };
    });
}

}  // namespace htvm::app
