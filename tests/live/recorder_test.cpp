// Live streams as files: what is in them can be decoded, whatever happens to the disk, the line or the program.
#include "live/server/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <thread>

#include "htvm/decoder.hpp"
#include "htvm/stream_index.hpp"
#include "live_packets.h"
#include "soon.h"

// In place of the C library's, so that the tests see what the disk is waited for; they go on to the kernel.
namespace {
std::mutex sync_mutex;
std::function<void(const std::string& path)> on_sync;

int synced(int file, long call) {
    {
        const std::lock_guard lock(sync_mutex);
        if (on_sync) on_sync(std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file)).string());
    }
    return static_cast<int>(syscall(call, file));
}
}  // namespace
extern "C" int fsync(int file) { return synced(file, SYS_fsync); }
extern "C" int fdatasync(int file) { return synced(file, SYS_fdatasync); }

namespace htvm::live {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr Recorder::Clock::time_point start{};
const auto evening = std::chrono::system_clock::from_time_t(1795352751);  // 2026-11-22 13:05:51

SharedPacket shared(const Packet& packet) {
    return std::make_shared<LivePacket>(LivePacket{packet, write_packet(packet), {}});
}
SharedPacket header(std::uint32_t session) { return shared(live_header(session)); }
SharedPacket intra(std::uint32_t frame, std::size_t bytes = 300) { return shared(live_intra(frame, bytes)); }
SharedPacket tracked(std::uint32_t frame, std::size_t bytes = 100) { return shared(live_tracked(frame, bytes)); }

class RecorderTest : public testing::Test {
protected:
    void SetUp() override {
        fs::remove_all(options.folder);
        fs::create_directories(options.folder);
    }
    void TearDown() override { fs::remove_all(options.folder); }

    Recorder open() {
        auto out = Recorder::open(options);
        EXPECT_TRUE(out);
        return std::move(*out);
    }
    bool record(Recorder& recorder, const SharedPacket& packet, Recorder::Clock::duration after = 0ms) {
        return recorder.record("anna", packet, start + after,
                               evening + std::chrono::duration_cast<std::chrono::seconds>(after));
    }
    std::vector<std::string> files() const {
        std::vector<std::string> out;
        for (const auto& entry : fs::directory_iterator(options.folder)) out.push_back(entry.path().filename());
        std::sort(out.begin(), out.end());
        return out;
    }
    std::vector<Packet> packets(const std::string& name) const {
        std::ifstream in(options.folder / name, std::ios::binary);
        const std::string bytes(std::istreambuf_iterator<char>(in), {});
        PacketReader reader;
        reader.push({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
        std::vector<Packet> out;
        while (auto packet = reader.pull()) out.push_back(std::move(*packet));
        EXPECT_EQ(reader.damaged_bytes(), 0u) << name;
        EXPECT_EQ(reader.pending_bytes(), 0u) << name;
        return out;
    }
    // The frames in a file, each of which can be decoded from what comes before it there.
    std::vector<std::uint32_t> frames(const std::string& name) const {
        std::vector<PacketHeader> headers;
        std::vector<std::uint32_t> out;
        for (const auto& packet : packets(name)) {
            headers.push_back(packet);
            if (!frame_type(packet.kind)) continue;
            out.push_back(packet.frame);
            EXPECT_FALSE(closure(headers, headers.size() - 1).empty()) << name << " frame " << packet.frame;
        }
        return out;
    }
    std::vector<std::string> events(Recorder& recorder) {
        std::vector<std::string> out;
        for (const auto& event : recorder.new_events()) {
            EXPECT_EQ(event.stream, "anna");
            out.push_back(event.name);
        }
        return out;
    }

    RecorderOptions options{.folder = fs::temp_directory_path() / ("htvm_recorder_test_" + std::to_string(getpid()))};
};
using Frames = std::vector<std::uint32_t>;
using Names = std::vector<std::string>;

TEST_F(RecorderTest, ASessionBecomesAFileWithItsIndexInFront) {
    {
        auto recorder = open();
        EXPECT_FALSE(record(recorder, header(1)));
        for (std::uint32_t i = 0; i < 10; ++i) EXPECT_FALSE(record(recorder, i % 5 == 0 ? intra(i) : tracked(i)));
        EXPECT_TRUE(soon([&] { return recorder.counters().packets == 11; }));
        // As it grows it has its name, and all that was written.
        EXPECT_EQ(files(), Names{"anna-20261122-130551.htvm"});
        EXPECT_EQ(frames("anna-20261122-130551.htvm").size(), 10u);
        EXPECT_EQ(recorder.counters().streams, 1u);
        recorder.end("anna");
        EXPECT_EQ(recorder.counters().streams, 0u);
    }
    EXPECT_EQ(files(), Names{"anna-20261122-130551.htvm"});
    const auto recorded = packets("anna-20261122-130551.htvm");
    ASSERT_EQ(recorded.size(), 12u);
    const auto index = read_index(recorded[0]);
    ASSERT_TRUE(index);
    EXPECT_EQ(index->frames, 10u);
    ASSERT_EQ(index->points.size(), 2u);
    EXPECT_EQ(index->points[1].frame, 5u);
    EXPECT_EQ(recorded[1].kind, PacketKind::sequence);
    EXPECT_EQ(recorded[2].payload, std::vector<std::uint8_t>(300, 0));
}

TEST_F(RecorderTest, AFileBeginsWithAFrameThatCanBeDecodedByItself) {
    auto recorder = open();
    EXPECT_FALSE(record(recorder, tracked(8)));  // nothing is known of the stream yet
    record(recorder, header(1));
    EXPECT_TRUE(record(recorder, tracked(9)));
    EXPECT_TRUE(files().empty());
    EXPECT_FALSE(record(recorder, intra(10)));
    EXPECT_FALSE(record(recorder, tracked(11)));
    EXPECT_TRUE(soon([&] { return recorder.counters().packets == 3; }));
    EXPECT_EQ(frames("anna-20261122-130551.htvm"), (Frames{10, 11}));
    EXPECT_EQ(recorder.counters().dropped_frames, 0u);
}

TEST_F(RecorderTest, AnotherSessionAndAnotherHourBeginAnotherFile) {
    options.file_length = 1h;
    {
        auto recorder = open();
        record(recorder, header(1));
        record(recorder, intra(0));
        record(recorder, header(1));  // repeated
        record(recorder, tracked(1), 30min);
        EXPECT_TRUE(record(recorder, tracked(2), 60min));  // it goes on until one that can be decoded by itself comes
        EXPECT_FALSE(record(recorder, intra(3), 61min));
        record(recorder, header(2), 62min);
        record(recorder, intra(0), 62min);
        record(recorder, header(3), 62min);
        record(recorder, intra(0), 62min);
    }
    EXPECT_EQ(files(), (Names{"anna-20261122-130551.htvm", "anna-20261122-140651.htvm", "anna-20261122-140751-2.htvm",
                              "anna-20261122-140751.htvm"}));
    EXPECT_EQ(frames("anna-20261122-130551.htvm"), (Frames{0, 1, 2}));
    EXPECT_EQ(frames("anna-20261122-140651.htvm"), Frames{3});
    EXPECT_EQ(packets("anna-20261122-140751.htvm").at(1).reference, 2u);
    EXPECT_EQ(packets("anna-20261122-140751-2.htvm").at(1).reference, 3u);
}

TEST_F(RecorderTest, WhatASlowDiskDoesNotTakeIsDroppedUpToAFrameThatCanBeDecodedByItself) {
    options.waiting_bytes = 1;
    constexpr std::uint32_t most = 10000;  // some packet soon finds another one waiting; none of it is timed
    std::uint32_t sent = 0;
    std::uint64_t dropped = 0;
    {
        auto recorder = open();
        record(recorder, header(1));
        for (std::uint32_t more = 300; sent < most && more > 0; ++sent) {
            record(recorder, sent % 10 == 0 ? intra(sent, 300000) : tracked(sent, 100000));
            if (recorder.counters().dropped_frames > 0) --more;
        }
        dropped = recorder.counters().dropped_frames;
        EXPECT_GT(dropped, 0u);
        EXPECT_THAT(events(recorder), testing::Contains("recording_behind"));
    }
    Frames recorded;
    for (const auto& name : files())
        for (const auto frame : frames(name)) recorded.push_back(frame);
    ASSERT_FALSE(recorded.empty());
    EXPECT_LE(recorded.size() + dropped, sent);
    for (std::size_t i = 1; i < recorded.size(); ++i)
        EXPECT_TRUE(recorded[i] == recorded[i - 1] + 1 || recorded[i] % 10 == 0) << recorded[i];
}

TEST_F(RecorderTest, AFaultStopsTheRecordingUntilItIsTriedAgain) {
    options.retry = 1min;
    auto recorder = open();
    record(recorder, header(1));
    fs::remove_all(options.folder);
    record(recorder, intra(0));
    EXPECT_TRUE(soon([&] { return recorder.counters().faults == 1; }));
    EXPECT_EQ(events(recorder), Names{"recording_failed"});
    fs::create_directories(options.folder);
    record(recorder, tracked(1), 1s);
    EXPECT_EQ(recorder.counters().streams, 0u);
    record(recorder, intra(2), 60s);
    EXPECT_TRUE(files().empty());
    record(recorder, intra(3), 61s);
    EXPECT_TRUE(soon([&] { return recorder.counters().packets == 2; }));
    EXPECT_EQ(frames("anna-20261122-130652.htvm"), Frames{3});
    EXPECT_EQ(events(recorder), Names{"recording"});
}

// While it lives, act(path) is called before the disk is waited for.
class WatchedDisk {
public:
    explicit WatchedDisk(std::function<void(const std::string& path)> act) { set(std::move(act)); }
    WatchedDisk(const WatchedDisk&) = delete;
    ~WatchedDisk() { set({}); }

private:
    static void set(std::function<void(const std::string& path)> act) {
        const std::lock_guard lock(sync_mutex);
        on_sync = std::move(act);
    }
};

TEST_F(RecorderTest, WhereOnlyTrackedFramesWereDroppedItGoesOnAtOneThatNeedsNone) {
    options.waiting_bytes = 1000;
    options.sync = 0ms;
    std::atomic<bool> stuck = true, waited_for = false;
    const WatchedDisk disk([&](const std::string&) {
        while (stuck) {
            waited_for = true;
            std::this_thread::sleep_for(1ms);
        }
    });
    const auto needs_reference = [](PacketKind kind, std::uint32_t frame, std::uint32_t reference) {
        return shared(live_packet(kind, frame, reference, packet_flag::referred | packet_flag::access, 100));
    };
    const auto all_written = [](Recorder& recorder, std::uint64_t packets) {
        return soon([&] { return recorder.counters().packets == packets; });
    };
    {
        auto recorder = open();
        record(recorder, header(1));
        record(recorder, intra(0));
        for (std::uint32_t i = 1; i <= 20; ++i) record(recorder, tracked(i));
        const auto taken = 22 - recorder.counters().dropped_frames;
        EXPECT_LT(taken, 22u);
        stuck = false;
        EXPECT_TRUE(all_written(recorder, taken));
        EXPECT_TRUE(record(recorder, tracked(21)));
        EXPECT_FALSE(record(recorder, needs_reference(PacketKind::tracked, 22, 0)));
        EXPECT_FALSE(record(recorder, tracked(23)));
        EXPECT_TRUE(all_written(recorder, taken + 2));
        // A reference that is not in the file is nothing to go on from.
        waited_for = false;
        stuck = true;
        record(recorder, tracked(24));
        EXPECT_TRUE(soon([&] { return waited_for.load(); }));  // no packet leaves room for another one from here on
        for (std::uint32_t i = 25; i <= 40; ++i) record(recorder, tracked(i));
        EXPECT_TRUE(record(recorder, needs_reference(PacketKind::patched, 41, 0)));
        stuck = false;
        EXPECT_TRUE(record(recorder, needs_reference(PacketKind::tracked, 42, 41)));
    }
    const auto recorded = frames("anna-20261122-130551.htvm");
    EXPECT_THAT(recorded, testing::IsSupersetOf({0u, 22u, 23u}));
    EXPECT_THAT(recorded,
                testing::Not(testing::AnyOf(testing::Contains(21u), testing::Contains(41u), testing::Contains(42u))));
}

TEST_F(RecorderTest, AFileThatGrowsIsOnTheDiskAfterAMomentAndNobodyElseWaitsForThat) {
    options.sync = 50ms;
    const auto name = "anna-20261122-130551.htvm";
    std::mutex mutex;
    std::map<std::string, std::uintmax_t> on_disk;  // by path: a file's size
    const auto waited_for = [&](const fs::path& path) {
        const std::lock_guard lock(mutex);
        return on_disk.contains(path) ? on_disk[path] : 0;
    };
    const WatchedDisk disk([&, here = std::this_thread::get_id()](const std::string& path) {
        const std::lock_guard lock(mutex);
        on_disk[path] = fs::is_regular_file(path) ? fs::file_size(path) : 1;
        EXPECT_NE(std::this_thread::get_id(), here);
    });
    auto recorder = open();
    record(recorder, header(1));
    record(recorder, intra(0));
    EXPECT_TRUE(soon([&] { return recorder.counters().packets == 2; }));
    const auto first = fs::file_size(options.folder / name);
    EXPECT_TRUE(soon([&] { return waited_for(options.folder / name) == first; }));  // although nothing more comes
    EXPECT_EQ(waited_for(options.folder), 1u);                                      // its name
    record(recorder, tracked(1));
    EXPECT_TRUE(soon([&] { return waited_for(options.folder / name) > first; }));
}

TEST_F(RecorderTest, TheFileWithItsIndexTakesThePlaceOfTheOtherOnceTheDiskHasIt) {
    const auto path = options.folder / "anna-20261122-130551.htvm";
    std::vector<PacketKind> first;  // of both files, when the disk has the new one
    const WatchedDisk disk([&](const std::string& waited_for) {
        if (waited_for != path.string() + ".partial") return;
        for (const auto& name : {waited_for, path.string()})
            first.push_back(packets(fs::path(name).filename())[0].kind);
    });
    auto recorder = open();
    record(recorder, header(1));
    record(recorder, intra(0));
    recorder.finish();
    EXPECT_EQ(first, (std::vector<PacketKind>{PacketKind::front_index, PacketKind::sequence}));
    EXPECT_EQ(packets(path.filename())[0].kind, PacketKind::front_index);
}

// What a child process does, and how it ended.
template <class Work>
int status_of(const Work& work) {
    const auto child = fork();
    if (child == 0) {
        work();
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return status;
}

TEST_F(RecorderTest, AFullDiskLeavesAFileOfWholePackets) {
    const auto status = status_of([&] {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{5000, 5000};
        setrlimit(RLIMIT_FSIZE, &limit);
        auto recorder = open();
        record(recorder, header(1));
        for (std::uint32_t i = 0; i < 10; ++i) record(recorder, i == 0 ? intra(i, 1000) : tracked(i, 1000));
        while (recorder.counters().faults == 0) std::this_thread::sleep_for(1ms);
        record(recorder, tracked(10));
        _exit(recorder.counters().streams == 0 ? 0 : 1);
    });
    EXPECT_EQ(status, 0);
    EXPECT_EQ(frames("anna-20261122-130551.htvm"), (Frames{0, 1, 2, 3}));
}

TEST_F(RecorderTest, AProgramThatIsKilledLeavesAllThatItHadWritten) {
    const auto status = status_of([&] {
        auto recorder = open();
        record(recorder, header(1));
        for (std::uint32_t i = 0; i < 50; ++i) record(recorder, i == 0 ? intra(i) : tracked(i));
        while (recorder.counters().packets < 51) std::this_thread::sleep_for(1ms);
        std::raise(SIGKILL);
    });
    EXPECT_EQ(status, SIGKILL);
    EXPECT_EQ(files(), Names{"anna-20261122-130551.htvm"});
    EXPECT_EQ(frames("anna-20261122-130551.htvm").size(), 50u);
}

TEST_F(RecorderTest, NoMoreStreamsAreRecordedThanAllowed) {
    options.streams = 1;
    auto recorder = open();
    record(recorder, header(1));
    EXPECT_FALSE(recorder.record("ben", header(1), start, evening));
    EXPECT_FALSE(recorder.record("ben", intra(0), start, evening));
    EXPECT_EQ(recorder.counters().faults, 1u);
}

TEST_F(RecorderTest, AFolderThatCannotBeWrittenToIsToldAtOnce) {
    options.folder /= "none";
    const auto opened = Recorder::open(options);
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().message, "streams cannot be recorded: there is no folder " + options.folder.string());
    options.folder = options.folder.parent_path();
}

TEST(RecordingNameTest, ANameOfAStreamMakesAHarmlessNameOfAFile) {
    EXPECT_EQ(recording_name("anna", evening), "anna-20261122-130551");
    EXPECT_EQ(recording_name("..a b/c%\n\"", evening), "%2E.a%20b%2Fc%25%0A%22-20261122-130551");
    EXPECT_EQ(recording_name("caf\xc3\xa9", evening), "caf\xc3\xa9-20261122-130551");
    EXPECT_EQ(recording_name(std::string(1000, 'a'), evening), std::string(200, 'a').append("-20261122-130551"));
}

}  // namespace
}  // namespace htvm::live
