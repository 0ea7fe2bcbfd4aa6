#include "container/mp4_file.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "container/box.h"
#include "container/fragment.h"
#include "container/movie_box.h"
#include "container/stream_samples.h"

namespace htvm {
namespace {

// Goes through all samples of a stream.
Result<std::uint64_t> for_each_sample(const std::function<Result<PacketSource>()>& open, StreamSampler& sampler,
                                      const std::function<Result<void>(StreamSample)>& take) {
    auto source = open();
    if (!source) return tl::unexpected(source.error());
    bool first = true;
    while (auto packet = (*source)()) {
        if (std::exchange(first, false) && packet->kind == PacketKind::front_index) continue;
        if (auto sample = sampler.push(std::move(*packet)))
            if (auto taken = take(std::move(*sample)); !taken) return tl::unexpected(taken.error());
    }
    if (auto sample = sampler.finish())
        if (auto taken = take(std::move(*sample)); !taken) return tl::unexpected(taken.error());
    return sampler.total_us();
}

// Puts the samples of a second side by side, track after track.
class Interleaver {
public:
    // flush: takes samples of a track that follow each other in the file and have the same entry.
    using Flush = std::function<Result<void>(std::size_t track, std::span<const TrackSample> samples)>;
    explicit Interleaver(Flush flush) : flush_(std::move(flush)) {}
    Result<void> take(StreamSample sample) {
        constexpr std::int64_t together_us = 1000000;
        if (!waiting_[0].empty() && sample.mesh().time - waiting_[0].front().time >= together_us)
            if (auto done = finish(); !done) return done;
        for (std::size_t track = 0; track < sample_tracks; ++track)
            for (auto& one : sample.tracks[track]) waiting_[track].push_back(std::move(one));
        return {};
    }
    Result<void> finish() {
        for (std::size_t track = 0; track < sample_tracks; ++track) {
            const auto samples = std::exchange(waiting_[track], {});
            for (std::size_t begin = 0; begin < samples.size();) {
                auto end = begin + 1;
                while (end < samples.size() && samples[end].entry == samples[begin].entry) ++end;
                if (auto done = flush_(track, std::span(samples).subspan(begin, end - begin)); !done) return done;
                begin = end;
            }
        }
        return {};
    }

private:
    Flush flush_;
    std::array<std::vector<TrackSample>, sample_tracks> waiting_;
};

// The tables of all samples; places count from the first byte of data. bytes: of all data.
Result<Movie> measure(const std::function<Result<PacketSource>()>& open, std::uint64_t& bytes) {
    Movie movie;
    StreamSampler sampler;
    bytes = 0;
    Interleaver interleaver([&](std::size_t track, std::span<const TrackSample> samples) -> Result<void> {
        auto& table = movie.tables[track];
        table.chunks.push_back({bytes, static_cast<std::uint32_t>(samples.size()), samples[0].entry});
        for (const auto& sample : samples) {
            if (sample.bytes.size() > 0xffffffff) return fail(ErrorKind::limit, "a frame is larger than 4 GiB");
            table.sizes.push_back(static_cast<std::uint32_t>(sample.bytes.size()));
            table.times.push_back(sample.time);
            table.last_duration = sample.duration;
            if (sample.sync && track != 2) table.sync.push_back(static_cast<std::uint32_t>(table.sizes.size()));
            bytes += sample.bytes.size();
        }
        return {};
    });
    const auto total = for_each_sample(open, sampler, [&](StreamSample sample) {
        if (sample.mesh().sync) movie.tables[0].needs.push_back(sample.needs);
        return interleaver.take(std::move(sample));
    });
    if (!total) return tl::unexpected(total.error());
    if (auto done = interleaver.finish(); !done) return tl::unexpected(done.error());
    if (movie.tables[0].sizes.empty()) return fail(ErrorKind::bad_input, "there is no frame for an .mp4");
    movie.entries = sampler.entries();
    movie.total_us = *total;
    for (const std::size_t track : {0, 1}) {
        auto& table = movie.tables[track];
        if (table.times.empty()) continue;
        const auto left = static_cast<std::int64_t>(*total) - table.times.back();
        table.last_duration = static_cast<std::uint32_t>(std::clamp<std::int64_t>(left, 0, 0x7fffffff));
    }
    if (!movie.tables[1].times.empty()) movie.first_picture_time = movie.tables[1].times.front();
    if (!movie.tables[2].times.empty()) movie.first_sound_time = movie.tables[2].times.front();
    return movie;
}

Result<void> write_progressive(const std::function<Result<PacketSource>()>& open, Movie movie, std::uint64_t bytes,
                               const ByteSink& sink) {
    BoxWriter data_header;
    constexpr std::uint64_t most_small = 0xffff0000;
    data_header.u32(bytes > most_small ? 1 : bytes + 8);
    data_header.text("mdat");
    if (bytes > most_small) data_header.u64(bytes + 16);
    const auto begin = write_movie(movie).size() + data_header.size();
    for (auto& table : movie.tables)
        for (auto& chunk : table.chunks) chunk.offset += begin;
    if (auto written = sink(write_movie(movie)); !written) return written;
    if (auto written = sink(data_header.take()); !written) return written;
    Interleaver interleaver([&](std::size_t, std::span<const TrackSample> samples) -> Result<void> {
        for (const auto& sample : samples)
            if (auto written = sink(sample.bytes); !written) return written;
        return {};
    });
    StreamSampler sampler;
    const auto done =
        for_each_sample(open, sampler, [&](StreamSample sample) { return interleaver.take(std::move(sample)); });
    if (!done) return tl::unexpected(done.error());
    return interleaver.finish();
}

Result<void> write_fragmented(const std::function<Result<PacketSource>()>& open, Movie movie, double seconds,
                              const ByteSink& sink) {
    const auto shift = movie.sound_shift();
    movie.fragmented = true;
    movie.tables = {};
    if (auto written = sink(write_movie(movie)); !written) return written;
    RangeCutter cutter({.seconds = seconds});
    std::uint32_t sequence = 0;
    const auto write = [&](const std::optional<SampleRange>& range) -> Result<void> {
        if (!range) return {};
        const auto fragment = write_fragment(*range, ++sequence, shift, true);
        if (!fragment) return tl::unexpected(fragment.error());
        return sink(*fragment);
    };
    StreamSampler sampler;
    const auto total =
        for_each_sample(open, sampler, [&](StreamSample sample) { return write(cutter.push(std::move(sample))); });
    if (!total) return tl::unexpected(total.error());
    return write(cutter.finish(*total));
}

}  // namespace

Result<void> write_mp4(const std::function<Result<PacketSource>()>& open, const std::optional<Packet>& index,
                       const Mp4Options& options, const ByteSink& sink) {
    std::uint64_t bytes = 0;
    auto movie = measure(open, bytes);
    if (!movie) return tl::unexpected(movie.error());
    if (index) movie->index = write_packet(*index);
    if (options.fragmented) return write_fragmented(open, std::move(*movie), options.fragment_seconds, sink);
    return write_progressive(open, std::move(*movie), bytes, sink);
}

}  // namespace htvm
