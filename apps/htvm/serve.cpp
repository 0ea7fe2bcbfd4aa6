// htvm serve: a hub of live streams, and a folder of streams, for others to watch, with a page that plays them.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command_line/terminal.h"
#include "commands.h"
#include "live/file_server.h"

namespace htvm::app {
namespace {

struct Options {
    std::string folder, address = "127.0.0.1";
    std::uint16_t port = 8080;
    bool same_site = false;
    unsigned connections = live::FileServerOptions{}.connections;
    std::string congestion_control = "bbr";
    live::NatsOptions nats{};
};

Result<void> serve(const Options& options) {
    live::FileServerOptions server;
    server.folder = options.folder;
    server.address = options.address;
    server.port = options.port;
    server.other_sites = !options.same_site;
    server.connections = options.connections;
    if (options.congestion_control != "system") server.congestion_control = options.congestion_control;
    live::Hub hub;
    server.hub = &hub;
    server.nats = options.nats;
    auto opened = live::FileServer::open(server);
    if (!opened) return tl::unexpected(opened.error());
    if (!live::has_player()) warn("this htvm was built without the web player: it serves streams, but has no pages");
    if (const auto used = opened->congestion_control();
        options.congestion_control != "system" && used != options.congestion_control)
        warn(fmt::format(
            "this kernel's TCP has no '{}' (modprobe tcp_bbr loads bbr): it uses {}, with which live streams "
            "come late where packets are lost",
            options.congestion_control, used));
    note("No publishers are known: programs on this machine may publish, under any name, and nobody else.");
    const bool six = options.address.find(':') != std::string::npos;
    fmt::print("http://{}{}{}:{}/\n", six ? "[" : "", options.address, six ? "]" : "", opened->port());
    std::fflush(stdout);
    opened->run();
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
                    "Where publishers and viewers reach this hub; they are told the addresses of all hubs")
        ->type_name("wss://HOST[:PORT]")
        ->needs(servers);
    command
        .add_option("--nats-ca", nats.ca_file, "Certificates to check those of NATS by (PEM; default: the system's)")
        ->type_name("FILE")
        ->needs(servers);
    command.add_option("--nats-credentials", nats.credentials_file, "A user of NATS's own accounts: JWT and seed")
        ->type_name("FILE")
        ->needs(servers);
}

}  // namespace

void add_serve(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command =
        app.add_subcommand("serve", "Carry live streams and serve a folder of streams, with a page that plays them");
    command
        ->add_option("--files", options->folder,
                     "A folder: its .htvm, .png and .jpg files can be read by anyone (default: live streams only)")
        ->type_name("FOLDER");
    command->add_option("--address", options->address,
                        "Address to listen on (default 127.0.0.1: this machine alone; 0.0.0.0 or ::: all networks)");
    command->add_option("--port", options->port, "Port to listen on; 0: a free one (default 8080)")
        ->check(CLI::Range(0, 65535));
    command->add_flag("--same-site", options->same_site, "Do not allow pages of other sites to read the streams");
    command->add_option("--connections", options->connections, "Connections at once (default 512)")
        ->check(CLI::Range(1, 100000));
    command
        ->add_option("--congestion-control", options->congestion_control,
                     "How TCP finds out how fast it may send: bbr (default; where packets are lost, live streams come "
                     "late with others: docs/live.md), another that the kernel has, or system: the kernel's choice")
        ->type_name("NAME");
    if (live::has_nats()) add_nats_options(*command, options->nats);
    command->footer(
        "Runs until Ctrl-C. Live streams are published to ws://ADDRESS:PORT/publish/NAME, by programs on this machine\n"
        "alone, and watched at http://ADDRESS:PORT/play/NAME by anyone who reaches it. Of the folder, symbolic links "
        "and\n"
        "hidden files are not served; the page shows NAME.png or NAME.jpg as the still of NAME.htvm if it lies beside "
        "it\n"
        "(htvm still makes one). It speaks HTTP without TLS: across other people's networks put a web server with TLS "
        "in\n"
        "front of it.\n"
        "Examples:\n"
        "  htvm serve --files streams/ --address 0.0.0.0\n"
        "  htvm serve");
    command->callback([options, &run] { run = [options] { return serve(*options); }; });
}

}  // namespace htvm::app
