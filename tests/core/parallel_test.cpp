#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <new>
#include <stdexcept>
#include <utility>

namespace htvm::internal {
namespace {

using Pieces = std::vector<std::pair<std::size_t, std::size_t>>;

Pieces pieces_of(std::size_t count, unsigned threads, std::size_t grain) {
    std::mutex mutex;
    Pieces out;
    parallel_for(count, threads, grain, [&](std::size_t begin, std::size_t end) {
        const std::scoped_lock lock(mutex);
        out.emplace_back(begin, end);
    });
    std::sort(out.begin(), out.end());
    return out;
}

TEST(ParallelFor, CoversTheRangeOnceInPiecesOfAtLeastHalfTheGrain) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 7u, 8u, 9u, 64u, 65u, 1000u})
        for (const unsigned threads : {1u, 2u, 3u, 7u})
            for (const std::size_t grain : {0u, 1u, 2u, 8u, 64u, 5000u}) {
                const auto pieces = pieces_of(count, threads, grain);
                std::size_t next = 0;
                for (const auto& [begin, end] : pieces) {
                    EXPECT_EQ(begin, next);
                    EXPECT_GT(end, begin) << "no empty piece";
                    EXPECT_TRUE(pieces.size() == 1 || 2 * (end - begin) >= grain) << count << " " << grain;
                    next = end;
                }
                EXPECT_EQ(next, count);
                EXPECT_LE(pieces.size(), threads);
            }
}

TEST(ParallelFor, UsesAllThreadsOnALongRange) { EXPECT_EQ(pieces_of(1000, 4, 10).size(), 4u); }

TEST(ParallelInvoke, RunsBothOnce) {
    for (const unsigned threads : {1u, 2u, 8u}) {
        std::atomic<int> first = 0, second = 0;
        parallel_invoke(
            threads, [&] { ++first; }, [&] { ++second; });
        EXPECT_EQ(first, 1);
        EXPECT_EQ(second, 1);
    }
}

TEST(ParallelFor, AnExceptionOfAnyPieceReachesTheCallerWhenAllPiecesAreDone) {
    for (const unsigned threads : {1u, 2u, 4u})
        for (std::size_t failing = 0; failing < 4; ++failing) {
            std::atomic<std::size_t> done = 0;
            auto body = [&](std::size_t begin, std::size_t end) {
                done += end - begin;
                if (begin <= failing * 25 && failing * 25 < end) throw std::bad_alloc();
            };
            EXPECT_THROW(parallel_for(100, threads, 1, body), std::bad_alloc);
            EXPECT_EQ(done, 100u);
        }
}

TEST(ParallelFor, WhereAllPiecesThrowOneExceptionReachesTheCaller) {
    auto body = [](std::size_t, std::size_t) { throw std::length_error("too long"); };
    EXPECT_THROW(parallel_for(1000, 8, 1, body), std::length_error);
}

TEST(ParallelInvoke, AnExceptionOfEitherReachesTheCaller) {
    auto nothing = [] {};
    auto failing = [] { throw std::bad_alloc(); };
    for (const unsigned threads : {1u, 2u}) {
        EXPECT_THROW(parallel_invoke(threads, failing, nothing), std::bad_alloc);
        EXPECT_THROW(parallel_invoke(threads, nothing, failing), std::bad_alloc);
        EXPECT_THROW(parallel_invoke(threads, failing, failing), std::bad_alloc);
    }
}

TEST(ThreadCount, ZeroIsOneACore) {
    EXPECT_GE(thread_count(0), 1u);
    EXPECT_EQ(thread_count(3), 3u);
}

}  // namespace
}  // namespace htvm::internal
