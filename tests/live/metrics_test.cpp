// What Prometheus reads: checked by a reader of its text format.
#include "live/server/metrics.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>

#include "live_packets.h"

namespace htvm::live {
namespace {

using namespace std::chrono_literals;

constexpr Hub::Clock::time_point start{};

// Each sample by its name with labels. Fails unless every line is as the text format has it, each name has its type and
// help before its samples, which come together, and no sample is there twice.
std::map<std::string, double> read_metrics(const std::string& text) {
    std::map<std::string, double> out;
    std::set<std::string> types, helps;
    std::string current;
    bool histogram = false;
    std::istringstream lines(text);
    EXPECT_TRUE(text.ends_with('\n'));
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string hash, keyword, name, rest;
        if (line.starts_with('#')) {
            words >> hash >> keyword >> name >> rest;
            EXPECT_EQ(hash, "#") << line;
            if (keyword == "HELP") {
                EXPECT_TRUE(helps.insert(name).second) << line;
            } else {
                EXPECT_EQ(keyword, "TYPE") << line;
                histogram = rest == "histogram";
                EXPECT_TRUE(rest == "counter" || rest == "gauge" || histogram) << line;
                EXPECT_EQ(rest == "counter", name.ends_with("_total")) << line;
                EXPECT_EQ(histogram, name.ends_with("_seconds") && rest != "gauge") << line;
                EXPECT_TRUE(types.insert(name).second) << line;
                current = name;
            }
            continue;
        }
        auto end = line.find_first_of("{ ");
        name = line.substr(0, end);
        if (histogram)
            EXPECT_TRUE(name == current + "_bucket" || name == current + "_sum" || name == current + "_count") << line;
        else
            EXPECT_EQ(name, current) << line;
        EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"), std::string::npos) << line;
        if (line[end] == '{') {
            do {
                const auto quote = line.find("=\"", end);
                bool escaped = false;
                for (end = quote + 2; end < line.size() && (escaped || line[end] != '"'); ++end) {
                    escaped = !escaped && line[end] == '\\';
                    EXPECT_TRUE(line[end] >= 0x20 && line[end] < 0x7f) << line;
                }
            } while (line.substr(end, 2) == "\",");
            EXPECT_EQ(line.substr(end, 3), "\"} ") << line;
            end += 2;
        }
        std::size_t used = 0;
        const auto value = std::stod(line.substr(end + 1), &used);
        EXPECT_EQ(used, line.size() - end - 1) << line;
        EXPECT_TRUE(out.emplace(line.substr(0, end), value).second) << line;
    }
    EXPECT_EQ(types, helps);
    return out;
}

TEST(MetricsTest, AHubIsToldInFull) {
    Hub hub;
    Result<Hub::Viewer> viewer = Hub::Viewer{};
    const std::string odd = "a\"b\\c\n\xff";
    for (const auto& name : {std::string("anna"), odd}) {
        const auto publisher = *hub.publish(
            name, [] {}, start);
        ASSERT_TRUE(hub.receive_packet(publisher, write_packet(live_header(1, 50)), start));
        ASSERT_TRUE(hub.receive_packet(publisher, write_packet(live_intra(0, 50)), start));
        if (name == "anna")
            viewer = hub.watch(
                name, [] {}, {.texts = false}, start);
        ASSERT_TRUE(hub.receive_packet(publisher, {1, 2, 3}, start));
        ASSERT_TRUE(hub.receive_packet(publisher, write_packet(live_tracked(5, 50)), start));
        ASSERT_TRUE(hub.receive_text(publisher, R"({"type":"heartbeat"})", start + 1s));
    }
    ASSERT_TRUE(viewer);
    hub.next(*viewer, start);  // the header; the I-frame waits
    EXPECT_FALSE(hub.watch(
        "nobody", [] {}, {}, start));
    const auto metrics = read_metrics(
        metrics_text({.hub = &hub, .refused = {{"token", 7}}, .connections = 3, .started = start}, start + 2500ms));
    const std::map<std::string, double> expected = {
        {"htvm_uptime_seconds", 2.5},
        {"htvm_connections", 3},
        {"htvm_ready", 1},
        {"htvm_packet_seconds_bucket{le=\"5e-04\"}", 1},
        {"htvm_packet_seconds_bucket{le=\"+Inf\"}", 1},
        {"htvm_packet_seconds_count", 1},
        {"htvm_packet_seconds_sum", 0},
        {"htvm_refused_total{cause=\"token\"}", 7},
        {"htvm_refused_total{cause=\"viewer_no_stream\"}", 1},
        {"htvm_refused_total{cause=\"publisher_stream_busy\"}", 0},
        {"htvm_streams", 2},
        {"htvm_packets_in_total", 6},
        {"htvm_bytes_in_total", 6 * 86},
        {"htvm_packets_out_total", 1},
        {"htvm_bytes_out_total", 86},
        {"htvm_damaged_messages_total", 2},
        {"htvm_memory_bytes", 6 * 86},
        {"htvm_dropped_packets_total", 0},
        {"htvm_refused_total{cause=\"publisher_slow\"}", 0},
        {"htvm_refused_total{cause=\"viewer_slow\"}", 0},
        {"htvm_dropped_frames_total{cause=\"undecodable\"}", 2},
        {"htvm_dropped_frames_total{cause=\"slow_viewer\"}", 0},
        {"htvm_key_frame_requests_total", 2},
        {"htvm_stream_published{stream=\"anna\"}", 1},
        {"htvm_stream_published{stream=\"a\\\"b\\\\c%0A%FF\"}", 1},
        {"htvm_stream_viewers{stream=\"anna\"}", 1},
        {"htvm_stream_queue_bytes{stream=\"anna\"}", 86},
        {"htvm_stream_kept_bytes{stream=\"anna\"}", 3 * 86},
        {"htvm_stream_packet_age_seconds{stream=\"anna\"}", 2.5},
        {"htvm_stream_heartbeat_age_seconds{stream=\"anna\"}", 1.5},
    };
    for (const auto& [name, value] : expected) {
        ASSERT_TRUE(metrics.contains(name)) << name;
        EXPECT_EQ(metrics.at(name), value) << name;
    }
    EXPECT_FALSE(metrics.contains("htvm_recording_files_total"));
}

TEST(MetricsTest, TimesAndEndsAreTold) {
    Traffic traffic;
    traffic.closed["idle"] = 2;
    for (const auto time : {400us, 20000us, 20000us, 60000us}) traffic.answer_time["file"].add(time);
    const auto metrics = read_metrics(metrics_text({.traffic = &traffic, .ready = false, .started = start}, start));
    EXPECT_EQ(metrics.at("htvm_ready"), 0);
    EXPECT_EQ(metrics.at("htvm_closed_total{cause=\"http_idle\"}"), 2);
    EXPECT_EQ(metrics.at("htvm_answer_seconds_bucket{handler=\"file\",le=\"5e-04\"}"), 1);
    EXPECT_EQ(metrics.at("htvm_answer_seconds_bucket{handler=\"file\",le=\"0.01\"}"), 1);
    EXPECT_EQ(metrics.at("htvm_answer_seconds_bucket{handler=\"file\",le=\"0.025\"}"), 3);
    EXPECT_EQ(metrics.at("htvm_answer_seconds_bucket{handler=\"file\",le=\"0.1\"}"), 4);
    EXPECT_EQ(metrics.at("htvm_answer_seconds_count{handler=\"file\"}"), 4);
    EXPECT_DOUBLE_EQ(metrics.at("htvm_answer_seconds_sum{handler=\"file\"}"), 0.1004);
}

TEST(MetricsTest, RecordingsAreToldWhereThereAreSome) {
    const auto recorder = Recorder::open({.folder = "."});
    ASSERT_TRUE(recorder);
    const auto metrics = read_metrics(metrics_text({.recorder = &*recorder, .started = start}, start));
    EXPECT_EQ(metrics.at("htvm_recording_files_total"), 0);
    EXPECT_EQ(metrics.at("htvm_recording_faults_total"), 0);
    EXPECT_FALSE(metrics.contains("htvm_streams"));
}

}  // namespace
}  // namespace htvm::live
