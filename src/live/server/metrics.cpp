#include "live/server/metrics.h"

#include <array>
#include <charconv>
#include <map>
#include <vector>

namespace htvm::live {
namespace {

// Within the quotes of a label. Names of streams may be any bytes; of those that are no printable ASCII the escapes of
// an address are shown, since the text must be UTF-8 on lines of its own.
std::string label_value(const std::string& text) {
    constexpr const char* digits = "0123456789ABCDEF";
    std::string out;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte > 0x7e)
            out += {'%', digits[byte >> 4], digits[byte & 15]};
        else if (c == '"' || c == '\\')
            out += {'\\', c};
        else
            out += c;
    }
    return out;
}

std::string number_text(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}
std::string number_text(std::uint64_t value) { return std::to_string(value); }

class Metrics {
public:
    // One value for each stream, cause, ...; the ones of a name come together.
    struct Sample {
        std::string label;
        std::string value;
    };
    void add(const std::string& name, const char* type, const char* help, const char* label,
             const std::vector<Sample>& samples) {
        if (samples.empty()) return;
        text_ += "# HELP htvm_" + name + ' ' + help + "\n# TYPE htvm_" + name + ' ' + type + '\n';
        for (const auto& sample : samples) {
            text_ += "htvm_" + name;
            if (*label) text_ += std::string("{") + label + "=\"" + label_value(sample.label) + "\"}";
            text_ += ' ' + sample.value + '\n';
        }
    }
    // times: by the label's value, which may be "" where there is no label.
    void histogram(const std::string& name, const char* help, const char* label,
                   const std::map<std::string, Histogram>& times) {
        if (times.empty()) return;
        text_ += "# HELP htvm_" + name + ' ' + help + "\n# TYPE htvm_" + name + " histogram\n";
        for (const auto& [value, time] : times) {
            const auto own = *label ? std::string(label) + "=\"" + label_value(value) + '"' : "";
            const auto up_to = time.up_to();
            for (std::size_t i = 0; i < up_to.size(); ++i)
                text_ += "htvm_" + name + "_bucket{" + own + (own.empty() ? "" : ",") + "le=\"" +
                         (i < Histogram::bounds.size() ? number_text(Histogram::bounds[i]) : "+Inf") + "\"} " +
                         number_text(up_to[i]) + '\n';
            const auto labels = own.empty() ? own : '{' + own + '}';
            text_ += "htvm_" + name + "_sum" + labels + ' ' + number_text(time.seconds()) + '\n';
            text_ += "htvm_" + name + "_count" + labels + ' ' + number_text(up_to.back()) + '\n';
        }
    }
    template <class Number>
    void counter(const std::string& name, const char* help, Number value) {
        add(name, "counter", help, "", {{"", number_text(value)}});
    }
    template <class Number>
    void gauge(const std::string& name, const char* help, Number value) {
        add(name, "gauge", help, "", {{"", number_text(value)}});
    }
    std::string text() && { return std::move(text_); }

private:
    std::string text_;
};

double seconds(std::chrono::milliseconds time) { return static_cast<double>(time.count()) / 1000; }

void add_hub(Metrics& metrics, const Hub& hub, Hub::Clock::time_point now) {
    const auto streams = hub.streams(now);
    const auto total = hub.counters();
    metrics.gauge("streams", "Live streams, those included whose publishers are away", std::uint64_t{streams.size()});
    metrics.counter("packets_in_total", "Packets from publishers", total.packets_in);
    metrics.counter("bytes_in_total", "Bytes of these packets", total.bytes_in);
    metrics.counter("packets_out_total", "Packets to viewers", total.packets_out);
    metrics.counter("bytes_out_total", "Bytes of these packets", total.bytes_out);
    metrics.counter("damaged_messages_total", "Messages from publishers that were no sound packet",
                    total.damaged_messages);
    metrics.add(
        "dropped_frames_total", "counter",
        "Frames not sent: undecodable ones to nobody, others not to a viewer who was too slow", "cause",
        {{"undecodable", number_text(total.undecodable_frames)}, {"slow_viewer", number_text(total.dropped_frames)}});
    metrics.gauge("memory_bytes", "Of packets, kept and waiting, and of those that came in part",
                  std::uint64_t{total.memory});
    metrics.counter("dropped_packets_total", "From publishers, when the memory for packets was used up",
                    total.dropped_for_memory);
    metrics.counter("gave_way_total", "How often a stream gave memory back that others needed", total.gave_way);
    metrics.counter("viewers_fallen_behind_total", "How often viewers were too slow", total.fallen_behind);
    metrics.counter("key_frame_requests_total", "Requests passed to publishers", total.key_frame_requests);
    metrics.counter("silent_publishers_total", "Publishers' connections that ended since nothing was heard",
                    total.silent_publishers);

    const auto each = [&](const std::string& name, const char* type, const char* help, const auto& value) {
        std::vector<Metrics::Sample> samples;
        for (const auto& stream : streams)
            if (const auto text = value(stream); !text.empty()) samples.push_back({stream.name, text});
        metrics.add(name, type, help, "stream", samples);
    };
    using Info = StreamInfo;
    const auto age = [](const std::optional<std::chrono::milliseconds>& since) {
        return since ? number_text(seconds(*since)) : std::string();
    };
    each("stream_published", "gauge", "1: its publisher is connected",
         [](const Info& stream) { return number_text(std::uint64_t{stream.published}); });
    each("stream_viewers", "gauge", "Viewers now",
         [](const Info& stream) { return number_text(std::uint64_t{stream.viewers}); });
    each("stream_packets_in_total", "counter", "Packets from its publishers",
         [](const Info& stream) { return number_text(stream.publisher.packets); });
    each("stream_bytes_in_total", "counter", "Bytes of these packets",
         [](const Info& stream) { return number_text(stream.publisher.bytes); });
    each("stream_queue_bytes", "gauge", "Waiting for its viewers",
         [](const Info& stream) { return number_text(std::uint64_t{stream.queue_bytes}); });
    each("stream_kept_bytes", "gauge", "Kept for viewers who may still come",
         [](const Info& stream) { return number_text(std::uint64_t{stream.kept_bytes}); });
    each("stream_packet_age_seconds", "gauge", "Since its last packet",
         [&](const Info& stream) { return age(stream.since_packet); });
    each("stream_heartbeat_age_seconds", "gauge", "Since its publisher's last heartbeat",
         [&](const Info& stream) { return age(stream.since_heartbeat); });
}

void add_refused(Metrics& metrics, const MetricsSources& sources) {
    auto refused = sources.refused;
    if (sources.hub) {
        const auto total = sources.hub->counters();
        refused["publisher_stream_busy"] += total.refused_publishers_busy;
        refused["publisher_limit"] += total.refused_publishers_limit;
        refused["publisher_message"] += total.refused_publishers_message;
        refused["publisher_slow"] += total.slow_publishers;
        refused["viewer_no_stream"] += total.refused_viewers_no_stream;
        refused["viewer_limit"] += total.refused_viewers_limit;
        refused["viewer_message"] += total.refused_viewers_message;
        refused["viewer_slow"] += total.slow_viewers;
    }
    std::vector<Metrics::Sample> samples;
    for (const auto& [cause, count] : refused) samples.push_back({cause, number_text(count)});
    metrics.add("refused_total", "counter", "Requests and connections that were refused or ended", "cause", samples);
}

void add_traffic(Metrics& metrics, const MetricsSources& sources) {
    std::map<std::string, std::uint64_t> closed;
    std::map<std::string, Histogram> answers, late, packets;
    if (sources.traffic) {
        for (const auto& [why, count] : sources.traffic->closed) closed["http_" + why] = count;
        answers = sources.traffic->answer_time;
        late[""] = sources.traffic->late;
    }
    if (sources.hub) {
        const auto total = sources.hub->counters();
        closed.insert(total.closed.begin(), total.closed.end());
        packets[""] = total.packet_time;
    }
    std::vector<Metrics::Sample> samples;
    for (const auto& [why, count] : closed) samples.push_back({why, number_text(count)});
    metrics.add("closed_total", "counter", "Connections that ended, by whose they were and why", "cause", samples);
    metrics.histogram("answer_seconds", "From a request's header to its response", "handler", answers);
    metrics.histogram("packet_seconds", "From a packet's arrival until it is taken to be written to a viewer", "",
                      packets);
    if (sources.hub)
        metrics.histogram("late_seconds", "By how much what is due ten times a second came late", "", late);
}

void add_nats(Metrics& metrics, const NatsCounters& nats) {
    const auto& hubs = nats.hubs;
    metrics.gauge("nats_connected", "Whether NATS is", std::uint64_t{hubs.connected});
    metrics.counter("nats_connections_total", "Connections to NATS that were made", nats.connections);
    metrics.counter("nats_slow_consumer_total", "How often NATS or its library dropped messages for us",
                    nats.slow_consumer);
    metrics.add("nats_dropped_messages_total", "counter", "Messages between hubs that were dropped here", "direction",
                {{"to", number_text(nats.dropped_to + hubs.unsent)}, {"from", number_text(nats.dropped_from)}});
    metrics.gauge("hubs", "Other hubs that were heard of lately", std::uint64_t{hubs.hubs});
    metrics.gauge("far_streams", "Streams published on other hubs", std::uint64_t{hubs.far_streams});
    metrics.gauge("far_streams_watched", "Of these, watched here", std::uint64_t{hubs.watched});
    metrics.gauge("streams_sent_to_hubs", "Streams published here and watched elsewhere",
                  std::uint64_t{hubs.sent_streams});
    metrics.counter("hub_messages_sent_total", "Messages to other hubs", hubs.sent);
    metrics.counter("hub_messages_received_total", "Messages from other hubs", hubs.received);
    metrics.counter("hub_messages_damaged_total", "Those that were no message, or not their sender's to say",
                    hubs.damaged);
    metrics.counter("hub_messages_incomplete_total", "Those of which parts did not come", hubs.incomplete);
    metrics.counter("far_packets_total", "Packets from other hubs", hubs.packets);
    metrics.counter("far_bytes_total", "Bytes of these packets", hubs.bytes);
    metrics.counter("far_gaps_total", "How often packets from other hubs were missing", hubs.gaps);
    metrics.counter("far_closures_total", "How often what the newest frame needs was taken from another hub",
                    hubs.closures);
    metrics.counter("lost_claims_total", "Publishers here who lost their stream to one on another hub",
                    hubs.lost_claims);
}

void add_segments(Metrics& metrics, const MetricsSources& sources) {
    if (!sources.segments) return;
    const auto made = sources.segments->counters();
    metrics.gauge("segments_streams", "Live streams that have segments, those included that ended lately",
                  made.streams);
    metrics.counter("segments_total", "Segments of live streams that were made", made.segments);
    metrics.counter("segments_parts_total", "Parts of segments that were made", made.parts);
    metrics.counter("segments_bytes_total", "Bytes of segments and maps that were made", made.bytes);
    metrics.gauge("segments_held_bytes", "Of segments and maps, in memory", made.held_bytes);
    metrics.counter("segments_lost_total", "Segments given up: no memory, or nowhere to start for too long", made.lost);
    metrics.gauge("segments_waiting", "Requests that wait for what is not there yet", made.waiting);
    metrics.counter("segments_refused_waiting_total", "Requests refused since too many waited", made.refused_waiting);
    if (!sources.traffic) return;
    const auto& traffic = *sources.traffic;
    std::vector<Metrics::Sample> samples;
    for (const auto& [what, count] : traffic.segment_requests) samples.push_back({what, number_text(count)});
    metrics.add("segments_requests_total", "counter", "Requests for playlists, segments, maps and parts, by answer",
                "answer", samples);
    metrics.counter("segments_sent_bytes_total", "Bytes of the answers", traffic.segment_bytes);
}

}  // namespace

std::string metrics_text(const MetricsSources& sources, Hub::Clock::time_point now) {
    Metrics metrics;
    metrics.gauge("uptime_seconds", "Since the program began",
                  seconds(std::chrono::duration_cast<std::chrono::milliseconds>(now - sources.started)));
    metrics.gauge("connections", "Open now", std::uint64_t{sources.connections});
    metrics.gauge("ready", "0: the server is ending", std::uint64_t{sources.ready});
    add_refused(metrics, sources);
    if (const auto* authority = sources.authority)
        metrics.add("authority_answers_total", "counter", "What the authority was asked, by its answer", "answer",
                    {{"yes", number_text(authority->yes)},
                     {"no", number_text(authority->no)},
                     {"none", number_text(authority->none)},
                     {"remembered", number_text(authority->remembered)}});
    add_traffic(metrics, sources);
    if (sources.hub) add_hub(metrics, *sources.hub, now);
    add_segments(metrics, sources);
    if (sources.nats) add_nats(metrics, *sources.nats);
    if (sources.recorder) {
        const auto recorded = sources.recorder->counters();
        metrics.gauge("recording_streams", "Streams being recorded", recorded.streams);
        metrics.counter("recording_files_total", "Files begun", recorded.files);
        metrics.counter("recording_packets_total", "Packets recorded", recorded.packets);
        metrics.counter("recording_bytes_total", "Bytes of these packets", recorded.bytes);
        metrics.counter("recording_dropped_frames_total", "Frames not recorded, since the disk was too slow",
                        recorded.dropped_frames);
        metrics.counter("recording_faults_total", "Recordings that could not begin or ended early", recorded.faults);
    }
    return std::move(metrics).text();
}

}  // namespace htvm::live
